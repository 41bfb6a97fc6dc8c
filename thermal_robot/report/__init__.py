"""Draws a diagnosis, computes none: text, HTML, figures, and the schema of its JSON.

Nothing is loaded before it is used; Matplotlib only where something is drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis


def text(diagnosis: Diagnosis) -> str:
    """Return the report as plain text, at most 96 columns wide."""
    from thermal_robot.report.plain_text import plain_text

    return plain_text(diagnosis)
