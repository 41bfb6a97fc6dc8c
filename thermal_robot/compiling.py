"""Numba compilation of loops (the extra ``fast``), and their execution in threads."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Set
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

THREADS = 0
"""Threads that run compiled loops; 0 for one on each processor that this process may use."""
PIECE = 16_384
"""Number of rows in the slice of a batch that a thread works on at a time."""
MOST_UNKEPT = 50
"""Number of retries where a full disk cannot keep a compiled function; a kernel is made of twenty at most."""


def compiled(
    function: Callable[..., Any], loosened: Set[str] | bool = frozenset({"contract"}), inline: bool = False
) -> Any:
    """Return a function that Numba compiles at its first call (``nogil``); cached on disk where possible.

    ``loosened``: LLVM's fast-math flags; by default only ``contract``, a product and a sum rounded once, so that NaN
    stays NaN. ``inline``: into the functions that call it, where a call would cost as much as what it does.
    """
    import numba

    compiler: Any = numba.njit
    fastmath = loosened if isinstance(loosened, bool) else set(loosened)
    how = {"nogil": True, "fastmath": fastmath, "error_model": "numpy", "inline": "always" if inline else "never"}
    try:
        return compiler(cache=True, **how)(function)
    except RuntimeError:  # numba finds no folder for its cache
        return compiler(**how)(function)


@cache
def loads(kernels: str) -> bool:
    """Whether numba is installed and a module of compiled functions can be loaded; the first call loads it."""
    if find_spec("numba") is None:
        return False
    try:
        import_module(kernels)
    except ImportError as error:
        warnings.warn(
            f"numba is installed but cannot be loaded ({error}); batches go on without it, several times slower: "
            'mend it with pip install --upgrade "thermal-robot[fast]"',
            RuntimeWarning,
            stacklevel=2,
        )
        return False
    return True


def threads() -> int:
    """Return the number of threads for a batch: ``THREADS``, or if 0 the processors that this process may use."""
    if THREADS:
        return THREADS
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def rows_at_once() -> int:
    """Return the number of rows that all threads together process at a time."""
    return PIECE * threads()


def in_pieces(kernel: Callable[..., None], constants: tuple[Any, ...], rows: int, out: tuple[Any, ...]) -> None:
    """Call ``kernel(*constants, first, last, *out)`` for each slice of about ``PIECE`` of the ``rows``, in threads."""
    count = max(1, rows // PIECE)
    workers = min(threads(), count)
    count = -(-count // workers) * workers  # as many for each, so that none waits for another
    cuts = [rows * piece // count for piece in range(count + 1)]

    def work(piece: int) -> None:
        # a full disk stops numba when it has compiled a function and is to keep it; the next try goes on from there
        for left in range(MOST_UNKEPT, -1, -1):
            try:
                return kernel(*constants, cuts[piece], cuts[piece + 1], *out)
            except OSError:
                if not left:
                    raise

    if workers < 2:
        for piece in range(count):
            work(piece)
        return
    promised = [_pool(workers).submit(work, piece) for piece in range(count)]
    try:
        for one in promised:
            one.result()
    finally:  # what was interrupted writes no more when the caller goes on
        for one in promised:
            one.cancel()
        wait(promised)


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, "compiled loops")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads are not forked
