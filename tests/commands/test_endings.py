"""An ending that is not the format's is refused before anything is read or computed."""

import sys

import numpy as np
import pandas as pd
import pytest
from commanded import refused

from thermal_robot.commands.endings import EXTRAS, FORMS
from thermal_robot.commands.table import COMMANDS

NOWHERE = "no/such/campaign.toml"
WRONG = [
    (("diagnose", NOWHERE, "--report", "r.xyz"), "r.xyz: is no page", ".html"),
    (("diagnose", NOWHERE, "--json", "d.yaml"), "d.yaml: is no JSON file", "found .yaml"),
    (("diagnose", NOWHERE, "--model", "x.xlsx"), "x.xlsx", "expected .json"),
    (("diagnose", NOWHERE, "--mjcf", "arm.urdf"), "arm.urdf: is no MJCF", ".xml"),
    (("predict", NOWHERE, NOWHERE, "-o", "p.json"), "p.json: is no table", ".csv, .parquet, .pq, .xlsx, .ods"),
    (("correct", NOWHERE, NOWHERE, "-o", "c.xyz"), "c.xyz: is no table", ".xlsx"),
    (("correct", NOWHERE, "--urdf", "r.json"), "r.json: is no URDF", ".urdf"),
    (("correct", NOWHERE, "--dh", "dh.xlsx"), "dh.xlsx: is no CSV table", "expected .csv"),
    (("correct", NOWHERE, "--ur-kinematics", "k.toml"), "k.toml: is no YAML file", ".yaml"),
    (("compare", NOWHERE, NOWHERE, "--report", "r.md"), "r.md: is no page", ".html"),
    (("wear", NOWHERE, NOWHERE, NOWHERE, "--json", "w.csv"), "w.csv: is no JSON file", ".json"),
    (("iso9283", NOWHERE, "--csv", "c.html"), "c.html: is no table", ".csv"),
    (("plan", "builtin:rv_m2", "-o", "plan.xlsx"), "plan.xlsx: is no folder or CSV table", ".csv"),
    (("import", "table", NOWHERE, "-o", "made.csv"), "made.csv: is no folder", "without the ending"),
    (("blind", "--report", "trial.json"), "trial.json: is no page", ".html"),
    (("demo", "--report", "demo.JSON"), "demo.JSON: is no page", "found .json"),
]


@pytest.mark.parametrize(("words", "said", "expected"), WRONG, ids=[" ".join(words) for words, *_ in WRONG])
def test_another_formats_ending_is_refused_before_the_campaign_is_read(run, words, said, expected):
    refused(run(*words), said, "by its ending", expected)


def test_every_file_that_is_written_has_a_form():
    options = [option for command in COMMANDS.values() for option in command.options]
    assert [option.names for option in options if option.stream == "out" and option.form not in FORMS] == []
    assert {module for form in FORMS.values() for module in form.endings.values() if module} == {*EXTRAS}


def test_an_ending_whose_library_is_missing_is_refused_with_its_extra(run, monkeypatch):
    for module in EXTRAS:
        monkeypatch.setitem(sys.modules, module, None)
    asked = ("predict", NOWHERE, NOWHERE, "-o")
    refused(run(*asked, "p.xlsx"), "openpyxl, which is not installed", 'pip install "thermal-robot[excel]"')
    monkeypatch.setattr("thermal_robot.commands.campaigns.diagnosed", lambda _: pytest.fail("it is computed"))
    refused(run("demo", "--report", "d.PDF"), "weasyprint, which is not installed", '"thermal-robot[pdf]"')
    refused(run(*asked, "p.csv"), NOWHERE)


def test_a_name_without_ending_is_taken(run, folder, diagnosed, tmp_path):
    assert run("predict", diagnosed.model, folder / "fresh.csv", "-o", tmp_path / "predicted")[0] == 0
    assert len(pd.read_csv(tmp_path / "predicted"))


@pytest.mark.parametrize(("ending", "module"), [("xlsx", "openpyxl"), ("ods", "odf"), ("parquet", "pyarrow")])
def test_workbooks_and_parquet_go_in_and_out(run, folder, diagnosed, tmp_path, ending, module):
    pytest.importorskip(module)
    samples, plain, book = tmp_path / f"s.{ending}", tmp_path / "p.csv", tmp_path / f"p.{ending}"
    read, kind = (pd.read_parquet, "parquet") if ending == "parquet" else (pd.read_excel, "excel")
    getattr(pd.read_csv(folder / "fresh.csv"), f"to_{kind}")(samples, index=False)
    assert run("predict", diagnosed.model, folder / "fresh.csv", "-o", plain)[0] == 0
    assert run("predict", diagnosed.model, samples, "-o", book)[0] == 0
    written, wanted = read(book), pd.read_csv(plain)
    wanted["outside"] = wanted["outside"].fillna("" if kind == "parquet" else np.nan)
    pd.testing.assert_frame_equal(written, wanted, check_dtype=False, rtol=1e-12)
    assert run("correct", diagnosed.model, samples, "-o", book)[0] == 0
    assert "miss.direction" in read(book)
