"""The page: tables and plots of what was measured, from figures that are kept beside it as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict

from benchmarks.timing import exponent

NAME, FIGURES = "performance.md", "performance.json"
HEAD = """# How fast it is

Made by one command, `python tests/benchmarks/run.py --peers FOLDER`, where
`python tests/benchmarks/peers/environments.py FOLDER` has made the environments of the programs compared with it.
What is compared takes turns in one run, as a shared machine is now fast and now slow: ratios are what counts. A figure
is the median of up to seven turns, after a call that is not counted, as it loads and compiles. Plots are logarithmic;
*p* is the exponent of N^p fitted to the three largest sizes.
"""
LARGEST = 3
"""Points at the end of a curve to which its exponent is fitted: what small sizes cost is the call."""


def read(folder):
    """Return the figures by part that were kept; none where there are none."""
    path = folder / FIGURES
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def plain(part, state, spent):
    """Return a part as plain values, with the machine's state."""
    return {**asdict(part), "state": state, "spent": spent}


def write(folder, parts, anew=()):
    """Write page and figures, and the plots of the parts that are named or have none."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FIGURES).write_text(json.dumps(parts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    blocks = [HEAD]
    for name, part in parts.items():
        blocks.append(f"## {part['title']}\n\n{part['text']}\n")
        blocks += [_table(rows) for rows in part["tables"]]
        for plot in part["plots"]:
            picture = folder / f"performance_{plot['name']}.svg"
            if name in anew or not picture.exists():
                _draw(picture, plot)
            blocks.append(f"![{plot['title']}]({picture.name})\n")
        blocks.append(f"Took {part['spent']}.\n")
    state = list(parts.values())[-1]["state"]
    blocks.append("## The machine\n\n" + _table([("", ""), *state.items()]))
    (folder / NAME).write_text("\n".join(blocks), encoding="utf-8")


def _table(rows):
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]]) + "\n"


def _draw(path, plot):
    """Draw curves into a file."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = figure.add_subplot()
    for curve in plot["curves"]:
        power = exponent(curve["sizes"][-LARGEST:], curve["seconds"][-LARGEST:])
        label = curve["name"] if power is None else f"{curve['name']}, p = {power:.2f}"
        axes.loglog(curve["sizes"], curve["seconds"], "o-", ms=3.0, lw=1.2, label=label)
    axes.set(title=plot["title"], xlabel=plot["size"], ylabel="s")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    # neither the day nor chance in the file: the same figures give the same picture
    with rc_context({"svg.hashsalt": plot["name"]}):
        figure.savefig(path, metadata={"Date": None})
