"""How kernels are compiled: imported only where numba is installed."""

from __future__ import annotations

from collections.abc import Callable, Set
from typing import Any

import numba


def compiled(function: Callable[..., Any], loosened: Set[str] | bool = frozenset({"contract"})) -> Any:
    """Compile a function when it is first called, and keep it on disk where that can be written.

    Products and sums may be contracted to one rounding unless more or less is ``loosened``; in no case are numbers
    that are none: what is no number stays none.
    """
    compiler: Any = numba.njit
    fastmath = loosened if isinstance(loosened, bool) else set(loosened)
    try:
        return compiler(cache=True, nogil=True, fastmath=fastmath)(function)
    except RuntimeError:  # numba finds no folder for its cache
        return compiler(nogil=True, fastmath=fastmath)(function)
