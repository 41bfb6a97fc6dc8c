"""Type alias of floating-point arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers in double precision, of any shape; the docstring of a function tells the shape and the unit."""
