"""Which effects: what each brings on rows that were not used for the fit, and how probable it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, FAINT, INK, MUTED, SMALL, Drawing, note, plain, tidy, title
from thermal_robot.report.words import by_status, needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.parts import Finding
    from thermal_robot.diagnosis.result import Diagnosis

_LOOK: dict[str, dict[str, Any]] = {
    "found": {"color": AFTER, "edgecolor": AFTER},
    "confounded": {"color": "none", "edgecolor": AFTER, "hatch": "////"},
    "contained": {"color": FAINT, "edgecolor": AFTER},
    "not_found": {"color": FAINT, "edgecolor": MUTED},
}
_FURTHEST_BELOW_ZERO, _FURTHEST = -0.25, 1.5


def plot_which(diagnosis: Diagnosis) -> Figure:
    """Draw every candidate's share of the gap on held-out rows with its 95 % interval, and its probability.

    Returns
    -------
    Figure
        Filled: found; hatched: cannot be told apart from another; pale: in question, then not found. What is not
        testable says why.
    """
    figure = Drawing(7.6, 1.3 + 0.27 * max(len(diagnosis.effects), 3))
    axes = figure.subplots()
    draw_which(axes, diagnosis)
    title(axes, "What each effect explains, and how probable it is")
    return figure


def draw_which(axes: Axes, diagnosis: Diagnosis, *, brief: bool = False) -> None:
    """Draw the candidates into a panel, ``brief`` where there is no room to say what an effect would need."""
    ordered = by_status(diagnosis)
    if not ordered:
        note(axes, "No effect was tried.")
        return
    low, high = -0.02, 1.0
    for line, finding in enumerate(ordered):
        if finding.status == "not_testable":
            said = "not testable" if brief else f"not testable: needs {needs(finding, diagnosis.joint_names)}"
            axes.text(1.0, line, plain(said), va="center", fontsize=SMALL, color=MUTED, style="italic")
            continue
        low = min(low, *(finding.shrinkage_ci95 or (0.0, 0.0)))
        high = max(high, *(finding.shrinkage_ci95 or (0.0, 0.0)))
        _draw_bar(axes, line, finding)
        axes.text(
            1.02,
            line,
            units.probability(finding.probability),
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=SMALL,
            color=INK if finding.status in ("found", "confounded") else MUTED,
        )
    axes.text(
        1.02,
        -0.95,
        "probability",
        transform=axes.get_yaxis_transform(),
        fontsize=SMALL,
        color=MUTED,
        va="center",
    )
    axes.set_yticks(range(len(ordered)), [plain(f.name) for f in ordered])
    axes.set_ylim(len(ordered) - 0.4, -1.3)
    axes.set_xlim(100.0 * max(low, _FURTHEST_BELOW_ZERO) - 1.0, 100.0 * min(high, _FURTHEST) + 2.0)
    axes.axvline(0.0, color=MUTED, linewidth=0.8)
    axes.set_xlabel("share of the gap's mean square on rows held out, 95 % interval (%)")
    tidy(axes, grid="x")
    axes.tick_params(axis="y", length=0)
    for label, finding in zip(axes.get_yticklabels(), ordered, strict=True):
        label.set_color(INK if finding.status in ("found", "confounded") else MUTED)


def _draw_bar(axes: Axes, line: int, finding: Finding) -> None:
    share = 100.0 * (finding.shrinkage or 0.0)
    axes.barh(line, share, height=0.62, linewidth=0.9, **_LOOK[finding.status])
    if finding.shrinkage_ci95 is not None:
        low, high = (100.0 * b for b in finding.shrinkage_ci95)
        axes.plot([low, high], [line, line], color=INK, linewidth=1.1)
        axes.plot([low, high], [line, line], linestyle="none", marker="|", markersize=6, color=INK)
