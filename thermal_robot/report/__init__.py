"""Reports of results: text, HTML, figures, and the JSON Schema of their data; nothing is computed here.

Nothing is loaded before it is used; Matplotlib only where something is drawn.
"""

from __future__ import annotations

import json
from importlib import import_module
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thermal_robot.report.motion_words import (
        motion_advice,
        motion_comparison_headline,
        motion_comparison_text,
        motion_headline,
        motion_text,
    )
    from thermal_robot.report.page import (
        comparison_fragment,
        comparison_html,
        fleet_html,
        fragment,
        html,
        motion_fragment,
        motion_html,
        wear_fragment,
        wear_html,
    )
    from thermal_robot.report.plain_text import calibration_text, crash_headline, crash_text, text
    from thermal_robot.report.plots import (
        explain_figure,
        overview,
        plot_differences,
        plot_how_far,
        plot_map,
        plot_motions,
        plot_remainder,
        plot_wear,
        plot_where,
        plot_which,
    )
    from thermal_robot.report.text_campaigns import (
        comparison_headline,
        comparison_text,
        fleet_text,
        wear_headline,
        wear_text,
    )
    from thermal_robot.report.words import advice, headline

__all__ = [
    "advice",
    "calibration_text",
    "comparison_fragment",
    "comparison_headline",
    "comparison_html",
    "comparison_schema",
    "comparison_text",
    "crash_headline",
    "crash_text",
    "explain_figure",
    "fleet_html",
    "fleet_text",
    "fragment",
    "headline",
    "html",
    "motion_advice",
    "motion_comparison_headline",
    "motion_comparison_text",
    "motion_fragment",
    "motion_headline",
    "motion_html",
    "motion_schema",
    "motion_text",
    "overview",
    "plot_differences",
    "plot_how_far",
    "plot_map",
    "plot_motions",
    "plot_remainder",
    "plot_wear",
    "plot_where",
    "plot_which",
    "schema",
    "text",
    "wear_fragment",
    "wear_headline",
    "wear_html",
    "wear_text",
]
_HOMES = ("words", "plain_text", "text_campaigns", "motion_words", "plots", "page")
"""Modules of these names, the lightest first: the last two load Matplotlib, and Jinja2."""


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the format ``thermal-robot/diagnosis/2``."""
    return dict(json.loads(files(__name__).joinpath("diagnosis.schema.json").read_text(encoding="utf-8")))


def motion_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of ``thermal-robot/diagnosis/2`` that measures ``motion``."""
    return dict(json.loads(files(__name__).joinpath("motion.schema.json").read_text(encoding="utf-8")))


def comparison_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the format ``thermal-robot/comparison/1``."""
    return dict(json.loads(files(__name__).joinpath("comparison.schema.json").read_text(encoding="utf-8")))


def __getattr__(name: str) -> Any:
    for home in _HOMES if name in __all__ else ():
        found = getattr(import_module(f"{__name__}.{home}"), name, None)
        if found is not None:
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
