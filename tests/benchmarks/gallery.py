"""Pictures of docs/gallery.md, each drawn from what `thermal-robot diagnose --json` wrote of a public campaign."""

import argparse
import io
import json
from pathlib import Path

from matplotlib.patches import Patch
from PIL import Image

from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, INK, SMALL, THIRD, Drawing, tidy, title

LARGEST_FILE = 60_000
"""Bytes: pages of many pictures load at once."""
_LISTED = 8  # bars in a panel that can be read at the width of a page
_WORTH = 0.005  # share below which a bar cannot be seen


def picture(plain):
    """Draw the gap before and after, the effects that were found and the places where it enters."""
    figure = Drawing(10.0, 3.4)
    gap, which, where = figure.subplots(1, 3, width_ratios=(1.0, 1.5, 1.5))
    unit = "rad" if plain["campaign"]["measures"] == "motion" else "m"
    held = plain["gap"]["held_out"]
    sizes = (held["rms_before"], held["rms_after"])
    gap.bar(("before", "after"), sizes, color=(BEFORE, AFTER), width=0.62)
    for place, told in enumerate(units.together(sizes, unit)):
        gap.annotate(told, (place, sizes[place]), (0, 3), textcoords="offset points", ha="center", color=INK)
    gap.set_yticks([])
    gap.margins(y=0.15)
    tidy(gap, grid="")
    title(gap, "The gap, held out")
    found = {e["name"]: e["shrinkage"] for e in plain["effects"] if e["name"] in plain["verdict"]["effects"]}
    _bars(which, found, "Which effect", dict.fromkeys(found, AFTER))
    joints, links = plain["where"]["joints"], plain["where"]["links"]
    _bars(where, {**joints, **links}, "Where", {**dict.fromkeys(joints, AFTER), **dict.fromkeys(links, THIRD)})
    if links:
        where.legend(
            handles=[Patch(color=AFTER, label="joint"), Patch(color=THIRD, label="link")],
            loc="lower right",
            frameon=False,
            fontsize=SMALL,
        )
    return figure


def _bars(axes, shares, heading, colours):
    told = sorted(((share, name) for name, share in shares.items() if abs(share) > _WORTH), reverse=True)[:_LISTED]
    names = [name for _, name in told]
    axes.barh(names, [100.0 * share for share, _ in told], color=[colours[name] for name in names], height=0.62)
    axes.invert_yaxis()
    axes.set_xlabel("share of the gap's mean square (%)")
    tidy(axes, grid="x")
    title(axes, heading)


def small(figure):
    """Return the figure as a PNG with few colours."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=100)
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(64).save(packed, format="png", optimize=True)
    return packed.getvalue()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", type=Path, help="what `thermal-robot diagnose --json` wrote")
    parser.add_argument("picture", type=Path, help="PNG to write")
    asked = parser.parse_args()
    content = small(picture(json.loads(asked.json.read_text(encoding="utf-8"))))
    if len(content) > LARGEST_FILE:
        raise SystemExit(f"{asked.picture} would have {len(content)} bytes, more than {LARGEST_FILE}")
    asked.picture.write_bytes(content)
    print(f"{asked.picture}: {len(content)} bytes")


if __name__ == "__main__":
    main()
