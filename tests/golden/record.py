"""What the program says of public and simulated campaigns, written down, so that a move of code can be held against it.

usage: python tests/golden/record.py [--check] [--only NAME ...]

Without ``--check`` the files beside this script are written anew. With it nothing is written: every campaign is
diagnosed again and each figure compared, to 1e-9 of its size (what BLAS may round). Needs ``THERMAL_ROBOT_DATA``, the
demo excepted. The test beside it compares to 1e-6, as other machines round otherwise.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermal_robot.diagnosis import Diagnosis

HERE = Path(__file__).parent
TOLERANCE = 1e-9
"""Relative: BLAS rounds by about 1e-16, the fits' condition numbers reach 1e6."""
ELSEWHERE = 1e-6
"""Relative: other processors and versions of BLAS round otherwise, and fits multiply that by their condition."""
NOTHING = 1e-11
"""Below this a figure is rounding of nothing: p-values and shares that underflow."""
CHANCES = ("probability",)
"""Compared absolutely: beside nothing the relative change of a probability is the change of an evidence of 1e4 nats."""
_WORDS = ("summary", "advice", "warnings", "reasons", "describes", "name", "schema", "next", "where", "title", "random")
REAL = ("ur5_jacobi", "wam_jacobi", "ipa_ur10_d")


def names() -> list[str]:
    """Return the campaigns that are held: 22 open cases, three real ones, and the demo."""
    return [*(f"open_cases/case_{k:03d}" for k in range(22)), *REAL, "demo"]


def campaign(name: str) -> Path:
    """Return a campaign's folder; ``KeyError`` where ``THERMAL_ROBOT_DATA`` is not set."""
    if name == "demo":
        from thermal_robot.datasets import demo_directory

        return demo_directory()
    return Path(os.environ["THERMAL_ROBOT_DATA"]) / name


def golden(name: str) -> Path:
    """Return the file that holds a campaign's figures."""
    return HERE / (name.replace("/", "_") + ".json")


@cache
def diagnosed(name: str) -> Diagnosis:
    """Diagnose a campaign, once in a process: the real ones take a minute each."""
    from thermal_robot import diagnose

    return diagnose(campaign(name))


def said(name: str) -> dict[str, object]:
    """Return a campaign's verdict and figures, without the words."""
    plain = json.loads(json.dumps(diagnosed(name).to_dict()))
    plain["effects"] = {e["name"]: e for e in plain["effects"]}
    for effect in plain["effects"].values():
        effect["parameters"] = {p["name"]: [p["value"], p["std"]] for p in effect["parameters"] if p["identified"]}
        effect["locations"] = {place["name"]: place["share"] for place in effect["locations"]}
    return _pruned({**plain, "covariates": plain["where"]["covariates"]})


def _pruned(plain):  # type: ignore[no-untyped-def]
    if isinstance(plain, dict):
        return {k: _pruned(v) for k, v in plain.items() if k not in _WORDS and v not in (None, [], {})}
    if isinstance(plain, list):
        return [_pruned(v) for v in plain]
    return float(f"{plain:.12g}") if isinstance(plain, float) else plain


def differences(old: object, new: object, tolerance: float, path: str = "") -> list[str]:
    """Return one line for each figure or word that is not the same."""
    if isinstance(old, dict) and isinstance(new, dict):
        return [
            line
            for key in sorted({*old, *new})
            for line in differences(old.get(key, 0.0), new.get(key, 0.0), tolerance, f"{path}/{key}")
        ]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [line for k, (a, b) in pairs for line in differences(a, b, tolerance, f"{path}[{k}]")]
    if isinstance(old, (int, float)) and isinstance(new, (int, float)):
        floor = tolerance if path.endswith(CHANCES) else NOTHING
        same = math.isclose(old, new, rel_tol=tolerance, abs_tol=floor)
        return [] if same else [f"{path}: {old!r} became {new!r}"]
    return [] if old == new else [f"{path}: {old!r} became {new!r}"]


REWRITE = "python tests/golden/record.py --only {name}"


def unchanged(name: str, tolerance: float = ELSEWHERE) -> None:
    """Assert that the same is said as before."""
    old = json.loads(golden(name).read_text(encoding="utf-8"))
    lines = differences(old, said(name), tolerance)
    rewrite = REWRITE.format(name=name)
    assert not lines, (
        f"{name}: {len(lines)} figures changed, the first: {lines[:3]}. If that is meant, write them anew with "
        f"`{rewrite}`, and let the commit message tell what changed, where and why."
    )


def shrinks(found: Diagnosis) -> float:
    """Held-out rows, not those of the fit, say so; and the interval holds the figure."""
    held_out = found.gap.held_out
    low, high = held_out.shrinkage_ci95
    assert 0.0 < low <= held_out.shrinkage <= high < 1.0
    assert held_out.rms_after < held_out.rms_before
    return held_out.shrinkage


def main() -> int:
    """Write or compare; the exit status is 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--only", nargs="+", default=names())
    options = parser.parse_args()
    from concurrent.futures import ProcessPoolExecutor

    changed = 0
    with ProcessPoolExecutor(2) as pool:
        for name, found in zip(options.only, pool.map(said, options.only), strict=True):
            if not options.check:
                golden(name).write_text(json.dumps(found, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
                continue
            old = json.loads(golden(name).read_text(encoding="utf-8"))
            lines = differences(old, found, TOLERANCE)
            changed += bool(lines)
            for line in lines[:2]:
                print(f"{name}{line}")
            if len(lines) > 2:
                print(f"{name}: {len(lines) - 2} more")
    print("written" if not options.check else f"{changed} of {len(options.only)} campaigns differ")
    return int(options.check and changed > 0)


if __name__ == "__main__":
    sys.exit(main())
