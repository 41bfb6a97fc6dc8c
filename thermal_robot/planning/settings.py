"""Every number that was chosen to plan a first campaign."""

NOISE, NOISE_TURN = 20e-6, 1e-4
"""m and rad, one sigma per axis: a laser tracker at a few metres, and the turn of its target with three reflectors."""
CHOICES, MOST_CANDIDATES, FEWEST_CHOICES = 60, 4000, 4
"""Poses among which each place in the order is filled, but no more rows of all together than this, nor fewer poses
than that."""
FEWEST_ROWS, MOST_ROWS = 6, 1000
"""Rows that a plan may have: with fewer not even the frames are known, more are not planned but measured."""
ORDERS = 16
"""Orders of the poses that are compared, each balanced first."""
