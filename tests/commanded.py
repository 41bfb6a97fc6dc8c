"""Running commands in tests, and what they must say of bad input."""

import csv
import io
from contextlib import redirect_stderr, redirect_stdout
from types import SimpleNamespace

import numpy as np
import pytest

import thermal_robot.diagnosing
from thermal_robot import cli


def diagnosed_files(folder, out, diagnose):
    """Run `diagnose` with every file that it can write; give status, text, complaint and the files' paths."""
    files = {"json": out / "d.json", "report": out / "r.html", "model": out / "m.json"}
    wanted = [word for kind, path in files.items() for word in (f"--{kind}", str(path))]
    text, complaint = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(text), redirect_stderr(complaint):
        patch.setattr(thermal_robot.diagnosing, "diagnose", diagnose)
        status = cli.main(["diagnose", str(folder), *wanted])
    return SimpleNamespace(status=status, text=text.getvalue(), complaint=complaint.getvalue(), **files)


def refused(result, *words):
    """Assert that a command said in one plain line what is wrong with its input."""
    status, out, err = result
    assert status == 2
    assert out == ""
    assert err.startswith("thermal-robot: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for word in words:
        assert str(word) in err, f"{word} is not in: {err}"


def table(path):
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)
