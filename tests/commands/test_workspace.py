"""``thermal-robot map``: the best places on stdout, the map and its picture on disk."""

import json

import pytest

from thermal_robot import cli
from thermal_robot.maps import Map

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")

LINE = ["--axis", "0", "1", "0", "--x", "0", "0", "1", "--y", "0.42", "0.48", "4", "--z", "0.2", "0.2", "1"]


@pytest.fixture
def run(capsys, tmp_path):
    def run(*more, status=0):
        arguments = ["map", "builtin:rv_m2", "--tool", "tool0", "-o", str(tmp_path / "map.parquet"), *more]
        assert cli.main(arguments) == status
        return capsys.readouterr()

    return run


def test_the_best_places_are_told(run, tmp_path):
    said = run(*LINE, "--figure", str(tmp_path / "map.png"), "--json", str(tmp_path / "best.json")).out
    assert "4 of 4 places are reached, in 4 postures" in said
    assert len(said.splitlines()) == 4 + 4
    best = json.loads((tmp_path / "best.json").read_text())
    assert [row["required_warm"] for row in best] == sorted(row["required_warm"] for row in best)
    assert Map(tmp_path / "map.parquet").complete
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_what_places_must_have_counts(run):
    said = run(*LINE, "--where", "y>=0.45", "x<=0.1").out
    assert "420.0" not in said
    assert "480.0" in said
    assert "No place has what is asked for" in run(*LINE, "--where", "y>=3").out


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ([], "map: does not say where, expected --x, --y and --z, or --joints"),
        (["--joints", "5", *LINE], "does not say where"),
        (["--x", "0", "1", "two", *LINE[8:]], "column '--x': no span; found 0 1 two, expected FROM TO N"),
        (["--joints", "5", "--sigma", "much"], "column '--sigma': no number; found much"),
        (["--joints", "5", "--sigma", "joint_1=1e-5"], "joint_2"),
        (["--joints", "5", "--where", "z=1"], "column '--where': no rule; found z=1"),
        (["--joints", "5", "--by", "cost"], "no such column"),
    ],
)
def test_what_cannot_be_mapped_is_one_line(run, more, message):
    said = run(*more, status=2).err
    assert message in said.splitlines()[-1]


def test_an_ending_that_is_no_picture_is_refused_before_the_map_is_made(run, tmp_path):
    said = run(*LINE, "--figure", str(tmp_path / "q.xyz"), status=2).err
    assert "q.xyz: is no picture by its ending; found .xyz, expected" in said
    assert not (tmp_path / "map.parquet").exists()
