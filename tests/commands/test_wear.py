"""`thermal-robot wear`: text, JSON and page of campaigns in files, and complaints of one line."""

import json

import pytest

from thermal_robot import simulate, write_campaign

DATES = ("2026-01-01", "2026-02-01", "2026-03-01")


@pytest.fixture(scope="module")
def folders(rv_m2, tmp_path_factory):
    made = []
    for k, zero in enumerate((1e-3, 1e-3, 1.5e-3)):
        known = dict(rows=40, noise=2e-5, seed=k, base_known=True, tool_known=True)
        folder = tmp_path_factory.mktemp(f"run_{k}")
        write_campaign(simulate(rv_m2, {"joint_offset": {"joint_3": zero}}, **known), folder)
        made.append(str(folder))
    return made


def test_text_json_and_page(run, folders, tmp_path):
    page = tmp_path / "wear.html"
    status, out, err = run(
        "wear", *folders, "--dates", *DATES, "--only", "joint_offset", "--limit", "joint_offset=0.002", "--json",
        tmp_path / "wear.json", "--report", page,
    )  # fmt: skip
    assert (status, err) == (0, "")
    assert "zero offset, joint_3 jumped by" in out
    found = json.loads((tmp_path / "wear.json").read_text(encoding="utf-8"))
    assert found["parameters"][0]["alarm"]
    assert found["parameters"][0]["crossing"]["limit"] == 0.002
    assert "<svg" in page.read_text(encoding="utf-8")


def test_json_takes_the_place_of_the_text(run, folders):
    status, out, _ = run("wear", *folders, "--only", "joint_offset", "--false-alarm", "0.05", "--json", "-")
    assert status == 0
    assert json.loads(out)["false_alarm"] == 0.05


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--limit", "backlash"), "EFFECT=VALUE"),
        (("--dates", "2026-01-01"), "1 dates for 3 campaigns"),
        (("--limit", "backlsh=1"), "did you mean 'backlash'"),
        (("--false-alarm", "2"), "no rate of false alarms"),
    ],
)
def test_complaints_have_one_line(run, folders, more, said):
    status, out, err = run("wear", *folders, *more)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err
