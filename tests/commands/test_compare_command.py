"""`thermal-robot compare`: what is printed, written and refused."""

import json

import pytest
from compared import ONLY, campaign, moved

import thermal_robot as tr
from thermal_robot.campaign import write_campaign


@pytest.fixture(scope="module")
def days(tmp_path_factory):
    root = tmp_path_factory.mktemp("days")
    write_campaign(campaign(1), root / "before")
    write_campaign(campaign(3, moved(4e-4)), root / "after")
    arm = tr.load_robot("example-robot-data:ur5", "tool0")
    write_campaign(tr.simulate(arm, rows=40, noise=3e-5), root / "other")
    return root


def test_it_prints_the_text_and_writes_json_and_page(run, days, tmp_path):
    said = run(
        "compare",
        days / "before",
        days / "after",
        "--json",
        tmp_path / "c.json",
        "--report",
        tmp_path / "c.html",
        "--only",
        *ONLY,
    )
    assert said[0] == 0, said
    plain = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert said[1].splitlines()[0] == plain["summary"][: len(said[1].splitlines()[0])]
    assert [(c["effect"], c["place"], c["since"]) for c in plain["changes"]] == [("joint_offset", "joint_3", "after")]
    assert "zero offset, joint_3" in (tmp_path / "c.html").read_text(encoding="utf-8")


def test_what_is_quiet_is_the_sentence_alone(run, days):
    status, out, _ = run("compare", "-q", "--only", *ONLY, days / "before", days / "before")
    assert status == 0
    assert out.count("\n") == 1
    assert out.startswith("Nothing changed")


def test_one_campaign_and_another_robot_are_bad_input(run, days, tmp_path):
    status, out, told = run("compare", days / "before")
    assert (status, out) == (2, "")
    assert "two campaigns or more" in told
    status, out, told = run(
        "compare", days / "before", days / "other", "--only", "joint_offset", "--json", tmp_path / "c.json"
    )
    assert (status, out) == (2, "")
    assert "joints differ" in told
    assert told.count("\n") == 1
    assert not (tmp_path / "c.json").exists()
    assert run("compare", days / "before", days / "none")[0] == 2


def test_a_model_file_stands_for_its_campaign(run, days, tmp_path):
    model = tmp_path / "before.model.json"
    assert run("diagnose", days / "before", "--only", *ONLY, "--model", model)[0] == 0
    page = tmp_path / "c.html"
    status, out, _ = run("compare", model, days / "after", "--only", *ONLY, "--report", page)
    assert status == 0
    assert "joint_3 changed since after" in " ".join(out.split())
    assert "before.model.json: A model file" in out
    assert "before.model.json" in page.read_text(encoding="utf-8")  # with its checksum
    model.write_text(model.read_text().replace("joint_offset", "joint_offsat"))
    status, _, told = run("compare", model, days / "after")
    assert (status, told.count("\n")) == (2, 1)
    assert "joint_offsat" in told
