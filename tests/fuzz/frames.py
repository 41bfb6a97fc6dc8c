"""Data frames whose columns are of every kind that pandas has."""

from __future__ import annotations

import datetime
import decimal
from random import Random

import numpy as np
import pandas as pd
from fuzz.extremes import NUMBERS, OTHERS, WORDS

DTYPES = (
    "float16", "float32", "int8", "int64", "uint64", "bool", "object", "complex128", "str", "string", "category",
    "Int64", "Float64",
    "boolean", "datetime64[ns]", "timedelta64[ns]",
)  # fmt: skip


ODD = (
    pd.NA, pd.NaT, np.float32(1), decimal.Decimal("NaN"), decimal.Decimal("1e999"), datetime.date(2020, 1, 1), b"1",
    1 + 2j, np.array([1.0]),
)  # fmt: skip


def spoilt_frame(rng: Random, frame: pd.DataFrame) -> pd.DataFrame:
    """The frame with one column of another type, odd cells, odd names, or an odd index."""
    frame = frame.copy()
    if not len(frame) or not frame.columns.is_unique or isinstance(frame.columns, pd.MultiIndex):
        return frame
    name, n = rng.choice(list(frame.columns)), len(frame)
    kind = rng.randrange(8)
    if kind == 0:
        try:
            frame[name] = frame[name].astype(rng.choice(DTYPES))
        except (TypeError, ValueError, OverflowError):
            pass  # what pandas refuses does not reach us
    elif kind in (1, 2):
        cells = list(frame[name].astype(object))
        cells[rng.randrange(n)] = rng.choice((rng.choice(NUMBERS), rng.choice(OTHERS), rng.choice(WORDS), *ODD))
        frame[name] = pd.Series(cells, index=frame.index, dtype=object)
    elif kind == 3:
        frame = frame.rename(columns={name: rng.choice((*OTHERS[:3], 5, 1.5, ("x", "y"), *WORDS[:8], "x"))})
    elif kind == 4:
        frame = _with_index(rng, frame)
    elif kind == 5:
        frame = frame.drop(columns=name) if rng.random() < 0.5 else frame.iloc[: rng.randrange(n)]
    elif kind == 6:
        frame[name] = rng.choice(NUMBERS) if rng.random() < 0.5 else rng.choice(WORDS)
    else:
        frame = pd.concat([frame, frame[[name]]], axis=1)
    return frame


def _with_index(rng: Random, frame: pd.DataFrame) -> pd.DataFrame:
    n = len(frame)
    ways = (
        lambda: frame.set_index(pd.Index([0] * n)),
        lambda: frame.set_index(pd.Index(np.arange(n) - 5)),
        lambda: frame.set_index(pd.Index(np.arange(n) + 2.0**60)),
        lambda: frame.set_index(pd.date_range("2020", periods=n)),
        lambda: frame.set_index(list(frame.columns[:2])),
        lambda: frame.set_index(pd.Index(["a"] * n, name="x")),
        lambda: frame.set_index(pd.Index(np.arange(n, dtype=np.uint64) + np.uint64(2**63))),
        lambda: frame.set_axis(pd.MultiIndex.from_product([["a"], frame.columns]), axis=1),
    )
    return rng.choice(ways)()
