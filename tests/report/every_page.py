"""Every kind of page that the program writes, of results that are at hand."""

from blind_records import trial, trial_of_several
from motion.found import found as motion
from report.cases import CASES, case
from report.comparisons import comparison
from report.fleets import SUMMARY
from wear_cases import by_hand

from thermal_robot import report
from thermal_robot.blind.report.page import html as blind_html
from thermal_robot.blind.score import score
from thermal_robot.diagnosis.values import DataFault, Misfit

FILES = {"campaign.toml": "0123456789abcdef" * 4, "measurements.csv": "fedcba9876543210" * 4}
WHEN = "2026-11-27 11:05"
ABOUT = {"robot_serial": "20185500123", "instrument": "tracker 750123", "operator": "A. Novak", "date": "2026-11-26"}
FAULT = DataFault(("metric unit",), "positions stand in mm, not in m", "correct length_unit", 413.0, 8e-5, (3,))
EVERY = {
    **{kind: (report.html, CASES[kind]) for kind in CASES},
    "found": (report.html, lambda: case("found", about=ABOUT, left_out=("drift", "geometric"))),
    "misfit": (report.html, lambda: case("unexplained", misfit=Misfit(FAULT))),
    "motion": (report.motion_html, lambda: motion(flagged=True, rivals=(("lag", ("delay",)),))),
    "compare_3": (report.comparison_html, lambda: comparison(3)),
    "compare_8": (report.comparison_html, lambda: comparison(8)),
    "fleet": (report.fleet_html, lambda: SUMMARY),
    "wear": (report.wear_html, by_hand),
    "wear_undated": (report.wear_html, lambda: by_hand(dated=False)),
    "blind": (blind_html, lambda: score([*trial(), *trial_of_several()])),
}
"""By the page's kind what writes it, and what it is of."""
FEW = ("motion", "fleet")
"""Kinds of every commit, beside the diagnosis with its arm."""


def page(kind):
    """The page of a kind."""
    write, make = EVERY[kind]
    files = () if write in (report.fleet_html, blind_html) else (FILES,)
    return write(make(), WHEN, *files)
