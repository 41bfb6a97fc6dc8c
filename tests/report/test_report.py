"""The room as a whole: what it offers, and what it must not load."""

import subprocess
import sys

import pytest

from thermal_robot import report


def test_what_is_light_stays_light():
    code = (
        "import sys; from thermal_robot import report as r; r.text, r.schema(), r.headline;"
        "print([m for m in ('matplotlib', 'jsonschema') if m in sys.modules]);"
        "r.html, r.overview, r.explain_figure;"
        "print([m for m in ('matplotlib', 'matplotlib.pyplot') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines() == ["[]", "['matplotlib']"]


def test_the_room_lists_what_it_has():
    assert set(report.__all__) <= set(dir(report))
    assert all(callable(getattr(report, name)) for name in report.__all__)
    with pytest.raises(AttributeError, match="no attribute 'plot_nothing'"):
        report.plot_nothing  # noqa: B018
