"""What is said of a campaign, held against the file beside this module."""

import json

from golden.record import differences, golden, said

TOLERANCE = 1e-6
"""Relative: other processors and versions of BLAS round otherwise, and fits multiply that by their condition."""
REWRITE = "python tests/golden/record.py --only {name}"


def unchanged(name, tolerance=TOLERANCE):
    """Assert that the same is said as before."""
    old = json.loads(golden(name).read_text(encoding="utf-8"))
    lines = differences(old, said(name), tolerance)
    rewrite = REWRITE.format(name=name)
    assert not lines, (
        f"{name}: {len(lines)} figures changed, the first: {lines[:3]}. If that is meant, write them anew with "
        f"`{rewrite}`, and let the commit message tell what changed, where and why."
    )


def shrinks(found):
    """Held-out rows, not those of the fit, say so; and the interval holds the figure."""
    held_out = found.gap.held_out
    low, high = held_out.shrinkage_ci95
    assert 0.0 < low <= held_out.shrinkage <= high < 1.0
    assert held_out.rms_after < held_out.rms_before
    return held_out.shrinkage
