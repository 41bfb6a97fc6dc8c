"""How sound input is spoilt: bytes, numbers in text, trees of values, tables, data frames, XML; and extreme values."""

from __future__ import annotations

import copy
import datetime
import decimal
import re
import xml.etree.ElementTree as ET
from contextlib import suppress
from random import Random
from typing import Any

import numpy as np
import pandas as pd

WORDS = (
    "", " ", "nan", "NaN", "NA", "null", "None", "inf", "-inf", "Infinity", "true", "0", "-0.0", "+5", "1e308",
    "-1e308", "1e309", "1e-320", "1e400", "-1e999", "0x10", "1_000", "1,5", "1.234,5", "−1", "١٢", "½", "1e", "+",
    "--1", "1.5.2", ".", "5 mm", "1d3", "18446744073709551616", "9007199254740993", "1" * 400, "9" * 5000, "2020-01-01",
    "é", "🤖",
    "\u202e1", "\ufeff1", "\x00", "\x1b[31m", "a" * 70_000, "../x", "/dev/zero", "/", "%s%n", "{}", "=1+1", '"', "'",
    "<a>", "&amp;", "]]>", "a\nb", "a\rb",
)  # fmt: skip
"""Values that have broken readers before: as text, in a cell, an attribute or a string."""
NUMBERS = (
    0, -0.0, 1, -1, 0.5, 3, 7, 90, 180, 360, 1000, 1e-3, 1e-9, 1e9, 1e15, 1e16, 1e22, 1e100, 1e154, 1e155, 1e200, 1e300,
    1e308, -1e308, 1.7976931348623157e308, 1e-100, 1e-300, 5e-324, 2**31, -(2**31) - 1, 2**53 + 1, 2**63, -(2**63) - 1,
    2**64, 10**400, float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
"""As numbers; whole ones beyond every machine's among them."""
OTHERS = (
    None, True, False, [], {}, [1], [0.0, 0.0, 0.0], [[]], {"a": 1}, [None], [1, "a"], "", "x", [1e308] * 3, [0.0] * 4,
)  # fmt: skip
"""Of another kind than what stood there."""
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def spoilt_bytes(rng: Random, data: bytes) -> bytes:
    """Bits flipped, bytes put in, a part dropped, doubled or moved, the end cut off."""
    if not data:
        return bytes(rng.randrange(256) for _ in range(rng.randrange(1, 40)))
    i, j = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    j = min(j, i + 2 ** rng.randrange(10))
    part, k = data[i:j], rng.randrange(len(data) + 1)
    ways = (
        lambda: data[:i] + bytes(b ^ (1 << rng.randrange(8)) for b in part[:4]) + data[i + len(part[:4]) :],
        lambda: data[:i] + bytes(rng.randrange(256) for _ in range(rng.randrange(1, 9))) + data[i:],
        lambda: data[:i] + data[j:],
        lambda: data[:i] + part * rng.choice((2, 3, 200)) + data[j:],
        lambda: data[:k] + part + data[k:],
        lambda: data[:k],
        lambda: data[k:],
        lambda: data[:i] + rng.choice(WORDS).encode("utf-8", "surrogatepass") + data[j:],
    )
    return rng.choice(ways)()


def spoilt_number(rng: Random, data: bytes) -> bytes:
    """One number of a text replaced by an extreme one."""
    found = list(_NUMBER.finditer(data))
    if not found:
        return spoilt_bytes(rng, data)
    place = rng.choice(found)
    return data[: place.start()] + extreme(rng).encode("utf-8", "surrogatepass") + data[place.end() :]


def extreme(rng: Random) -> str:
    """An extreme number or word, as text."""
    return rng.choice(WORDS) if rng.random() < 0.5 else written(rng.choice(NUMBERS))


def written(number: float) -> str:
    """A number as text; a whole one of any length."""
    return repr(number) if abs(number) < 1e300 or isinstance(number, float) else f"{number:d}"


def spoilt_tree(rng: Random, tree: Any) -> Any:
    """A tree of dicts and lists with one value replaced, dropped, doubled, renamed, or exchanged for another of it."""
    tree = copy.deepcopy(tree)
    places = _places(tree)
    if not places:
        return rng.choice(OTHERS)
    (holder, key), (other, name) = rng.choice(places), rng.choice(places)
    value, kind = holder[key], rng.randrange(7)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, dict):
        holder[rng.choice((rng.choice(WORDS), f"{key}x", str(key).upper()))] = holder.pop(key)
    elif kind == 1:
        holder.insert(key, copy.deepcopy(value))
    elif kind == 5 and isinstance(value, (int, float)) and not isinstance(value, bool):
        factor = rng.choice((-1, 0, 10, 1e-6, 1e6, 1e150))
        with suppress(OverflowError):
            holder[key] = value * factor
    else:
        ways = {2: copy.deepcopy(other[name]), 3: rng.choice(OTHERS), 4: rng.choice(WORDS)}
        holder[key] = ways.get(kind, rng.choice(NUMBERS))
    return tree


def _places(tree: Any) -> list[tuple[Any, Any]]:
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    inner = [(tree, key) for key in keys]
    return inner + [place for holder, key in inner for place in _places(holder[key])]


def spoilt_table(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    """Rows of cells with cells, columns, rows or names changed."""
    rows = [list(row) for row in rows]
    wide = min(len(row) for row in rows)
    if not wide:
        return rows[:-1] or [[""]]
    i, k = rng.randrange(len(rows)), rng.randrange(len(rows))
    j, m = rng.randrange(wide), rng.randrange(wide)
    kind = rng.randrange(11)
    if kind == 0:
        rows[i][j] = extreme(rng)
    elif kind in (1, 2):
        value = extreme(rng)
        for row in rows[1:]:
            row[j] = value if kind == 2 else extreme(rng)
    elif kind == 3:
        rows = [[cell for n, cell in enumerate(row) if n != j] for row in rows]
    elif kind == 4:
        names = (rows[0][j], rows[0][j] + "x", "time", "order", "session", "noise", "x.1", rng.choice(WORDS))
        rows = [[*row, row[j]] for row in rows]
        rows[0][-1] = rng.choice(names)
    elif kind == 5:
        rows[0][j] = rng.choice((rng.choice(WORDS), rows[0][m], rows[0][j].upper(), "order", "pose", "tilt.x", "sim.x"))
    elif kind == 6:
        rows[i:k] = []
    elif kind == 7:
        rows.extend([list(rows[i])] * rng.choice((1, 2, 50)))
    elif kind == 8:
        rows[i] = rows[i][:j] + rows[i][j:] * rng.randrange(3)
    elif kind == 9:
        for row in rows:
            row[j], row[m] = row[m], row[j]
    else:
        rows[i], rows[k] = rows[k], rows[i]
    return rows or [[""]]


def spoilt_xml(rng: Random, data: bytes) -> bytes:
    """One element dropped, doubled, moved, renamed, or an attribute of it dropped, renamed, replaced or exchanged."""
    root = ET.fromstring(data)
    pairs = [(parent, child) for parent in root.iter() for child in parent]
    if not pairs:
        return spoilt_bytes(rng, data)
    (parent, child), (_, another) = rng.choice(pairs), rng.choice(pairs)
    kind = rng.randrange(10)
    if kind == 0:
        parent.remove(child)
    elif kind in (1, 2):
        (parent if kind == 1 else another).append(copy.deepcopy(child))
    elif kind == 3:
        child.tag = rng.choice((another.tag, "x", child.tag.upper()))
    elif kind == 4:
        child.text = rng.choice(("x", "1 2 3", "\n"))
    elif child.attrib:
        _spoil_attribute(rng, child, another)
    return ET.tostring(root)


def _spoil_attribute(rng: Random, element: ET.Element, other: ET.Element) -> None:
    key = rng.choice(sorted(element.attrib))
    parts = element.attrib[key].split() or [""]
    n, kind = rng.randrange(len(parts)), rng.randrange(6)
    if kind == 0:
        del element.attrib[key]
    elif kind == 1:
        element.attrib[rng.choice(("x", "xyz", "rpy", "name", "value"))] = element.attrib.pop(key)
    elif kind == 2 and other.attrib:
        element.attrib[key] = other.attrib[rng.choice(sorted(other.attrib))]
    else:
        # without what XML cannot hold: bytes are flipped elsewhere
        parts[n:] = parts[n:] * rng.randrange(3) if kind == 3 else ["".join(c for c in extreme(rng) if c >= " ")]
        element.attrib[key] = " ".join(parts)


DTYPES = (
    "float16", "float32", "int8", "int64", "uint64", "bool", "object", "complex128", "str", "string", "category",
    "Int64", "Float64", "boolean", "datetime64[ns]", "timedelta64[ns]",
)  # fmt: skip
ODD = (
    pd.NA, pd.NaT, np.float32(1), decimal.Decimal("NaN"), decimal.Decimal("1e999"), datetime.date(2020, 1, 1), b"1",
    1 + 2j, np.array([1.0]),
)  # fmt: skip


def spoilt_frame(rng: Random, frame: pd.DataFrame) -> pd.DataFrame:
    """A data frame with one column of another type, odd cells, odd names, or an odd index."""
    frame = frame.copy()
    if not len(frame) or not frame.columns.is_unique or isinstance(frame.columns, pd.MultiIndex):
        return frame
    name, n, kind = rng.choice(list(frame.columns)), len(frame), rng.randrange(8)
    if kind == 0:
        with suppress(TypeError, ValueError, OverflowError):  # what pandas refuses does not reach us
            frame[name] = frame[name].astype(rng.choice(DTYPES))
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
