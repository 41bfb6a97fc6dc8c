"""How sound input is spoilt: bytes, numbers in text, trees of values, tables, XML."""

from __future__ import annotations

import copy
import re
import xml.etree.ElementTree as ET
from random import Random
from typing import Any

from fuzz.extremes import NUMBERS, OTHERS, WORDS

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def spoilt_bytes(rng: Random, data: bytes) -> bytes:
    """Bits flipped, bytes put in, a part dropped, doubled or moved, the end cut off."""
    if not data:
        return bytes(rng.randrange(256) for _ in range(rng.randrange(1, 40)))
    i, j = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    j = min(j, i + 2 ** rng.randrange(10))
    part = data[i:j]
    k = rng.randrange(len(data) + 1)
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
    places = [place for place in _places(tree) if place[0] is not None]
    if not places:
        return rng.choice(OTHERS)
    holder, key = rng.choice(places)
    kind = rng.randrange(7)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, dict):
        holder[rng.choice((rng.choice(WORDS), f"{key}x", str(key).upper()))] = holder.pop(key)
    elif kind == 1:
        holder.insert(key, copy.deepcopy(holder[key]))
    elif kind == 2:
        other, name = rng.choice(places)
        holder[key] = copy.deepcopy(other[name])
    elif kind == 3:
        holder[key] = rng.choice(OTHERS)
    elif kind == 4:
        holder[key] = rng.choice(WORDS)
    elif kind == 5 and isinstance(holder[key], (int, float)) and not isinstance(holder[key], bool):
        holder[key] = _scaled(holder[key], rng.choice((-1, 0, 10, 1e-6, 1e6, 1e150)))
    else:
        holder[key] = rng.choice(NUMBERS)
    return tree


def _scaled(number: float, factor: float) -> float:
    try:
        return number * factor
    except OverflowError:
        return factor


def _places(tree: Any) -> list[tuple[Any, Any]]:
    inner: list[tuple[Any, Any]] = []
    if isinstance(tree, dict):
        inner = [(tree, key) for key in tree]
    elif isinstance(tree, list):
        inner = [(tree, i) for i in range(len(tree))]
    return inner + [place for holder, key in inner for place in _places(holder[key])]


def spoilt_table(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    """Rows of cells with cells, columns, rows or names changed."""
    rows = [list(row) for row in rows]
    wide = min(len(row) for row in rows)
    if not wide:
        return rows[:-1] or [[""]]
    i, j = rng.randrange(len(rows)), rng.randrange(wide)
    k, m = rng.randrange(len(rows)), rng.randrange(wide)
    kind = rng.randrange(11)
    if kind == 0:
        rows[i][j] = extreme(rng)
    elif kind == 1:
        for row in rows[1:]:
            row[j] = extreme(rng)
    elif kind == 2:
        value = extreme(rng)
        for row in rows[1:]:
            row[j] = value
    elif kind == 3:
        rows = [[cell for n, cell in enumerate(row) if n != j] for row in rows]
    elif kind == 4:
        rows = [[*row, row[j]] for row in rows]
        rows[0][-1] = rng.choice(
            (rows[0][j], rows[0][j] + "x", "time", "order", "session", "noise", "x.1", rng.choice(WORDS))
        )
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
    parent, child = rng.choice(pairs)
    _, another = rng.choice(pairs)
    kind = rng.randrange(10)
    if kind == 0:
        parent.remove(child)
    elif kind == 1:
        parent.append(copy.deepcopy(child))
    elif kind == 2:
        another.append(copy.deepcopy(child))
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
    n = rng.randrange(len(parts))
    kind = rng.randrange(6)
    if kind == 0:
        del element.attrib[key]
    elif kind == 1:
        element.attrib[rng.choice(("x", "xyz", "rpy", "name", "value"))] = element.attrib.pop(key)
    elif kind == 2 and other.attrib:
        element.attrib[key] = other.attrib[rng.choice(sorted(other.attrib))]
    elif kind == 3:
        parts[n:] = parts[n:] * rng.randrange(3)
        element.attrib[key] = " ".join(parts)
    else:
        parts[n] = _no_control(extreme(rng))
        element.attrib[key] = " ".join(parts)


def _no_control(word: str) -> str:
    """Without what XML cannot hold: bytes are flipped elsewhere."""
    return "".join(c for c in word if c >= " ")
