"""A tracker's rows read as distances: which of the tracker's names they tell, and how far the parameters agree.

usage: python tests/benchmarks/measure_distances.py CAMPAIGN [RADIUS]

Row after row is read as the distance to the next of four anchors, RADIUS (1 m) from the middle of the rows. No row of
a tracker lies in a socket or on a plane, so that these cannot be made of it.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

import thermal_robot as tr

CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) / np.sqrt(3.0)


def as_distances(tracked, radius):
    """Return a tracker's campaign with one distance a row in place of its positions."""
    anchor = np.arange(tracked.samples) % len(CORNERS)
    drawn = np.linalg.norm(tracked.position - tracked.position.mean(axis=0) - radius * CORNERS[anchor], axis=1)
    labels = {**tracked.labels, "kind": np.full(tracked.samples, "distance"), "anchor": anchor.astype(str)}
    return replace(
        tracked, position=None, orientation=None, base_known=True, readings={"distance": drawn}, labels=labels
    )


def parameters(found):
    """Return value and standard deviation of each determined parameter of an effect that is told."""
    return {(f.name, p.name): (p.value, p.std) for f in found.effects if f.status in ("found", "contained")
            for p in f.parameters if p.identified and not f.quantity}  # fmt: skip


def main(path, radius=1.0):
    """Print what both tell, and how many parameters that both have agree within three standard deviations."""
    tracked = tr.read_campaign(path)
    both = [tr.diagnose(one) for one in (tracked, as_distances(tracked, float(radius)))]
    for found in both:
        print(f"{', '.join(found.verdict)}; held out {1e3 * found.gap.held_out.rms_after:.4f} mm", flush=True)
    one, other = (parameters(found) for found in both)
    z = {key: (one[key][0] - other[key][0]) / np.hypot(one[key][1], other[key][1]) for key in one.keys() & other.keys()}
    near = sum(abs(each) < 3.0 for each in z.values())
    print(f"{near} of {len(z)} parameters that both tell within three sigma; {len(one)} and {len(other)} are told")
    for key, each in sorted(z.items(), key=lambda pair: -abs(pair[1]))[:8]:
        print(f"  {key[0]}, {key[1]}: {each:.1f} sigma apart")


if __name__ == "__main__":
    main(*sys.argv[1:])
