"""Draws a diagnosis, computes none: text, HTML, figures, and the JSON Schema of its data.

Nothing is loaded before it is used; Matplotlib only where something is drawn.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thermal_robot.report.json_schema import comparison_schema, schema
    from thermal_robot.report.next_step import advice
    from thermal_robot.report.page import fragment, html
    from thermal_robot.report.page_comparison import comparison_fragment, comparison_html
    from thermal_robot.report.page_fleet import fleet_html
    from thermal_robot.report.plain_text import text
    from thermal_robot.report.plots_explain import explain_figure
    from thermal_robot.report.plots_how_far import plot_how_far
    from thermal_robot.report.plots_map import plot_map
    from thermal_robot.report.plots_overview import overview
    from thermal_robot.report.plots_remainder import plot_remainder
    from thermal_robot.report.plots_wear import plot_wear
    from thermal_robot.report.plots_where import plot_where
    from thermal_robot.report.plots_which import plot_which
    from thermal_robot.report.sentence import headline
    from thermal_robot.report.text_calibration import calibration_text
    from thermal_robot.report.text_comparison import comparison_headline, comparison_text
    from thermal_robot.report.text_fleet import fleet_text
    from thermal_robot.report.wear_page import wear_html

_HOME = {
    "advice": "next_step",
    "calibration_text": "text_calibration",
    "comparison_fragment": "page_comparison",
    "comparison_headline": "text_comparison",
    "comparison_html": "page_comparison",
    "comparison_schema": "json_schema",
    "comparison_text": "text_comparison",
    "explain_figure": "plots_explain",
    "fleet_html": "page_fleet",
    "fleet_text": "text_fleet",
    "fragment": "page",
    "html": "page",
    "overview": "plots_overview",
    "plot_how_far": "plots_how_far",
    "plot_map": "plots_map",
    "plot_remainder": "plots_remainder",
    "plot_wear": "plots_wear",
    "plot_where": "plots_where",
    "plot_which": "plots_which",
    "schema": "json_schema",
    "headline": "sentence",
    "text": "plain_text",
    "wear_html": "wear_page",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


__all__ = [
    "advice",
    "calibration_text",
    "comparison_fragment",
    "comparison_headline",
    "comparison_html",
    "comparison_schema",
    "comparison_text",
    "explain_figure",
    "fleet_html",
    "fleet_text",
    "fragment",
    "headline",
    "html",
    "overview",
    "plot_how_far",
    "plot_map",
    "plot_remainder",
    "plot_wear",
    "plot_where",
    "plot_which",
    "schema",
    "text",
    "wear_html",
]
