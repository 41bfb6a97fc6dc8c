"""The room as a whole: what it offers, and what it must not load."""

import subprocess
import sys

import pytest

from thermal_robot import report


def test_text_loads_no_matplotlib_and_drawing_no_pyplot():
    code = (
        "import sys, thermal_robot.report as r; r.text, r.schema; print('matplotlib' in sys.modules);"
        "r.html, r.overview, r.explain_figure; print('matplotlib' in sys.modules, 'matplotlib.pyplot' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["False", "True", "False"]


def test_the_room_lists_what_it_has():
    assert set(report.__all__) <= set(dir(report))
    assert all(callable(getattr(report, name)) for name in report.__all__)
    with pytest.raises(AttributeError, match="no attribute 'plot_nothing'"):
        report.plot_nothing  # noqa: B018
