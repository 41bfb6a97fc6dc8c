"""Chosen numbers of the measurement models, with unit and reason."""

FLAT = 1e-9
"""m by which points of a board leave its plane through rounding: a flat board tells two of its axes."""
LEAST_VOLUME = 1e-12
"""Determinant below which a direct linear transformation is no rotation, at any scale."""
