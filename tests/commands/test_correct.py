"""`thermal-robot correct`: from a model to the calibrated robot's files."""

import pytest
from commanded import refused


def test_correct_reads_a_stream_and_leaves_what_it_reads(run, diagnosed, stdin, tmp_path):
    out = tmp_path / "r.urdf"
    assert run("correct", diagnosed.model, "--urdf", out) == (0, "", "")
    stdin(diagnosed.model)
    assert run("correct", "-", "--urdf", tmp_path / "again.urdf") == (0, "", "")
    assert (tmp_path / "again.urdf").read_text() == out.read_text()
    refused(run("correct", diagnosed.model, "--urdf", diagnosed.model), "is read from")
    refused(run("correct", diagnosed.model, "--urdf", out, "--dh", out), "two outputs")


@pytest.mark.parametrize("words", [[], ["--min-sigma", "2"]])
def test_nothing_to_write_is_refused(run, diagnosed, words):
    refused(run("correct", diagnosed.model, *words), "nothing to write", "--urdf")


def test_what_is_no_model_is_refused(run, folder, tmp_path):
    refused(run("correct", folder / "truth.json", "--urdf", tmp_path / "r.urdf"), "truth.json", "not a model")
    assert not (tmp_path / "r.urdf").exists()
