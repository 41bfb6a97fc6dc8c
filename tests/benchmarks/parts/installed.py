"""What an installation takes on the disk: the package with its core dependencies, by distribution."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution

from benchmarks.parts import Part
from packaging.requirements import Requirement

LEAST = 10.0
"""MB, from which on a distribution has a row of its own."""
TEXT = (
    "Files of the distributions that `pip install thermal-robot` brings, no extra. What `pin` brings is not ours to "
    "choose; `yourdfpy`, the reader of meshes, brings ray casting, graphs and shapes with it. **Missed**: asked were "
    "400 MB without `pin`. Tables by pandas cost the most that could be spared, and are what users bring."
)


def _needed(name, extras=(), found=None):
    """Names of a distribution and of all that it needs."""
    found = {} if found is None else found
    name = re.sub(r"[-_.]+", "-", name).lower()
    known = found.get(name)
    if known is not None and set(extras) <= known:
        return found
    found[name] = (known or set()) | set(extras)
    try:
        needs = distribution(name).requires or ()
    except PackageNotFoundError:
        del found[name]
        return found
    for line in needs:
        need = Requirement(line)
        if need.marker is None or any(need.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            _needed(need.name, tuple(need.extras), found)
    return found


def _size(name):
    """MB of the files of a distribution."""
    paths = [file.locate() for file in distribution(name).files or ()]
    return sum(path.stat().st_size for path in paths if path.is_file()) / 1e6


def measured(effort, peers):
    """Sum up the files."""
    every, bare = set(_needed("thermal-robot")), set(_needed("pin"))
    reader = set(_needed("yourdfpy"))
    others = [set(_needed(name)) for name in ("numpy", "scipy", "matplotlib", "pandas", "rich")]
    alone = reader - set().union(*others) - bare
    size = {name: _size(name) for name in every}
    ours = every - (bare - {"numpy"})
    rows = [("distribution", "MB", "brought by")]
    totals = (
        ("all", every),
        ("without what `pin` brings", ours),
        ("… and without what `yourdfpy` alone brings", ours - alone),
    )
    rows += [(what, f"{sum(size[name] for name in names):.0f}", "") for what, names in totals]
    for name in sorted(every, key=lambda name: -size[name]):
        if size[name] >= LEAST:
            whose = "`pin`" if name not in ours else "`yourdfpy`" if name in alone else ""
            rows.append((name, f"{size[name]:.0f}", whose))
    return Part("What is installed", TEXT, (tuple(rows),))
