"""Every number of the comparison over time that somebody chose, with its unit and its reason."""

FEWEST = 3
"""Campaigns. Two tell that something changed, not whether at once or bit by bit."""

WIDE = 30.0
"""Prior deviation of what a parameter is throughout, in expected sizes: it holds what no campaign determines, and takes
next to nothing from what one does, so that only changes are weighed."""

ANY_CHANGE = 0.2
"""Prior probability that anything moves in a series, however many parameters are followed: the more there are, the less
likely is each. Robots are measured anew where somebody suspects a change, and mostly nothing has."""

KINDS = {"jump": 0.4, "trend": 0.4, "walk": 0.2}
"""Share of each kind among what moves. Jumps (collisions, new zeros) and trends (wear) are what is known to happen;
what wanders without a direction is rarer (a loose fixture, temperature that nobody recorded)."""

SCALES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Prior deviation of a change in expected sizes of its parameter, each as likely: what has been corrected moves by less
than the robot was off at first, and a collision by more."""

SCATTER = (1.0, 1.12, 1.25, 1.4, 1.6, 2.0, 2.5, 3.2, 4.0, 6.0, 10.0)
"""How much more campaigns scatter about each other than their deviations say: what is named nowhere shifts each
campaign by another amount, as each measures other poses."""

SCATTER_SPREAD = 0.3
"""Prior deviation of the logarithm of that factor, above 1 alone: deviations are mostly right within a third."""

BEAM = 10
"""Explanations that are carried on from one number of moving parameters to the next."""

MOST_MOVING = 6
"""Parameters at once: what moves more of them is another robot, or another model."""

NEGLIGIBLE = 12.0
"""Natural logarithm of odds: explanations less likely than the best by this are not carried on."""

SUBSTITUTE = 0.95
"""Correlation of the changes of two parameters, frames and constants taken off, above which the data cannot tell them
apart: to name the right one takes more than three times the change that it takes to see it."""

COMPARABLE = 0.3
"""Share of its prior deviation (one expected size) below which a change of a parameter must be known for it to be
compared at all; otherwise unknown frames, or the poses, hide it."""

FALSE_ALARM = 0.01
"""Probability that a series without any change rings at all: one in a hundred, as on a control chart of three sigma
with a few points."""

ROUNDS = 3
"""Linearisations about the common model. Errors are of mrad, so that each leaves a thousandth of the one before."""

CROSSING = 1.959963984540054
"""Deviations of a two-sided interval of 95 %."""

SCATTER_TOLD = 1.3
"""Factor of scatter from which on a reader is told: by chance it is above in one series of thousands."""

HIDDEN = 1e-6
"""Share of a move's information that is left beside others, below which nothing can be told of it: its square is then
three digits above the rounding of the sums."""
