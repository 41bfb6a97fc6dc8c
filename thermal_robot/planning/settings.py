"""Every number that was chosen to plan a first campaign."""

NOISE, NOISE_TURN = 20e-6, 1e-4
"""m and rad, one sigma per axis: a laser tracker at a few metres, and the turn of its target with three reflectors."""
SECONDS_A_ROW = 60.0
"""s: an arm moves, settles and is measured in less; slower, so that the arm warms while it is measured."""
COLD, RISE = 20.0, 6.0
"""°C at the start, the temperature to which lengths refer; and K by which an arm at work warms in an hour or two."""
WARMING, CONSTANT = 0.6, 0.2
"""Shares of the campaign: how long the arm warms, before it cools; and the time constant of either."""
BLOCKS = 3
"""How often each payload comes round: so it is not confounded with time, and nobody changes it at each pose."""
CHOICES, MOST_CANDIDATES, FEWEST_CHOICES = 60, 4000, 4
"""Poses among which each place in the order is filled, but no more rows of all together than this, nor fewer poses
than that."""
FEWEST_ROWS, MOST_ROWS = 6, 1000
"""Rows that a plan may have: with fewer not even the frames are known, more are not planned but measured."""
ORDERS, SWAPS = 16, 3000
"""Orders of the poses that are compared, and exchanges of two that are tried to make each balanced."""
BALANCED = 0.1
"""Share by which the approaches from one side may differ from half in an order that is taken as balanced."""
