"""Every number that was chosen to propose what to measure next: its value, its unit, and why that one."""

LEADING, MOST_LEADING = 0.01, 4
"""Probability of an explanation that is to be told apart, and how many are."""
LEAST_LEADING = 1e-3
"""Explanations that are less probable are not worth a measurement."""
DECIDED, WORTHWHILE = 0.9, 1.0
"""An explanation so probable is decided where further samples would bring less than so many nats for any rival."""
WIDE = 2.4
"""rad: as far as a joint without a limit is sent; nearly once round."""
BEYOND = 5.0
"""K outside the campaign's temperatures: a hall on another day."""
LOOSE = 0.1
"""m and rad: where the data leave a frame open, it is somewhere there."""
TIE = 1e-3
"""Weight of the information on parameters beside that on explanations, when samples are proposed: it breaks ties."""
FEW_PAYLOADS = 6
"""A campaign with no more payloads than this is offered these; another its lightest and heaviest."""
