"""`thermal-robot predict`: the same rows with what is predicted of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
from commanded import refused, table

from thermal_robot import CorrectedModel, read_campaign
from thermal_robot.campaign import write_campaign

NOISE = 25e-6
PLACE, STD = ["x", "y", "z"], ["std.x", "std.y", "std.z"]


def test_predict_writes_the_same_rows_in_order_and_nothing_else(run, folder, diagnosed, tmp_path):
    model, out = diagnosed.model, tmp_path / "p.csv"
    assert run("predict", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    own, written = (pd.read_csv(file, dtype=str) for file in (folder / "fresh.csv", out))
    kept = [name for name in own.columns if name not in PLACE]
    assert list(written.columns) == [*kept, *PLACE, *STD, "outside"]
    pd.testing.assert_frame_equal(written[kept], own[kept])  # as they stand, to the last digit
    predicted, std = (written[columns].to_numpy(float) for columns in (PLACE, STD))
    truth = np.loadtxt(folder / "fresh_truth_mm.txt")
    assert predicted.shape == truth.shape == (30, 3)
    assert np.sqrt(((predicted - truth) ** 2).mean()) < 0.5e3 * NOISE
    assert (np.abs(predicted - truth) < 1.96 * std).mean() > 0.85
    assert run("predict", "--noise", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    assert (pd.read_csv(out)[STD].to_numpy() > std).all()
    # the campaign's own table, measured columns and all, is as good a table of samples
    assert run("predict", model, folder / "measurements.csv", "--output", out)[0] == 0
    again = pd.read_csv(out)
    assert [list(again.columns).count(name) for name in (*PLACE, *STD)] == [1] * 6
    assert len(again) == 120


def test_predict_writes_quaternions_for_poses(run, poses, diagnosed_poses, tmp_path):
    model, out = diagnosed_poses.model, tmp_path / "p.csv"
    assert run("predict", model, poses / "fresh.csv", "-o", out) == (0, "", "")
    predicted = pd.read_csv(out)
    assert len(predicted) == 30
    np.testing.assert_allclose(np.linalg.norm(predicted[["qw", "qx", "qy", "qz"]], axis=1), 1.0, atol=1e-12)


def test_predict_says_what_it_misses(run, folder, diagnosed, tmp_path):
    model = diagnosed.model
    header, *rows = (folder / "fresh.csv").read_text().splitlines()
    at = header.split(",").index("temperature")
    less = [",".join(c for k, c in enumerate(line.split(",")) if k != at) for line in (header, *rows)]
    (tmp_path / "less.csv").write_text("\n".join(less))
    refused(run("predict", model, tmp_path / "less.csv", "-o", tmp_path / "p.csv"), "less", "'temperature'")
    assert not (tmp_path / "p.csv").exists()
    refused(run("predict", folder / "truth.json", folder / "fresh.csv", "-o", tmp_path / "p.csv"), "truth.json")
    refused(run("predict", model, tmp_path / "absent.csv", "-o", tmp_path / "p.csv"), "absent.csv")
    refused(run("predict", model, folder / "fresh.csv", "-o", tmp_path / "no" / "p.csv"), "p.csv", "cannot be written")


def test_predict_names_the_file_that_misses_a_column(run, folder, diagnosed, tmp_path):
    model, samples = diagnosed.model, tmp_path / "less.csv"
    lines = (folder / "fresh.csv").read_text().splitlines()
    joints = len(read_campaign(folder).robot.joint_names)
    samples.write_text("\n".join(",".join(line.split(",")[:joints]) for line in lines))
    refused(run("predict", model, samples, "-o", tmp_path / "p.csv"), samples, "'temperature'")


def test_predict_writes_parquet_where_the_name_says_so(run, folder, diagnosed, tmp_path):
    for out in (tmp_path / "p.csv", tmp_path / "p.parquet"):
        assert run("predict", diagnosed.model, folder / "fresh.csv", "-o", out) == (0, "", "")
    written = pd.read_csv(tmp_path / "p.csv")
    frame = pd.read_parquet(tmp_path / "p.parquet")
    written["outside"] = written["outside"].fillna("").astype(frame["outside"].dtype)
    pd.testing.assert_frame_equal(frame, written, check_dtype=False)


def test_predict_reads_and_writes_streams(run, folder, diagnosed, stdin, tmp_path):
    model, samples, out = diagnosed.model, folder / "fresh.csv", tmp_path / "p.csv"
    assert run("predict", model, samples, "-o", out) == (0, "", "")
    stdin(samples)
    assert run("predict", model, "-", "-o", "-") == (0, out.read_text(), "")
    stdin(model)
    assert run("predict", "-", samples, "-o", tmp_path / "again.csv") == (0, "", "")
    assert (tmp_path / "again.csv").read_text() == out.read_text()
    refused(run("predict", "-", "-", "-o", out), "one standard input", "model", "samples")
    lines = samples.read_text().splitlines()
    stdin("\n".join([*lines[:3], "wrong," + lines[3].split(",", 1)[1]]).encode())
    refused(run("predict", model, "-", "-o", "-"), "standard input, row 4", "wrong")


def test_units_of_the_campaign_are_units_of_its_prediction(run, folder, diagnosed, tmp_path):
    campaign = read_campaign(folder)
    other = replace(campaign, units=type(campaign.units)("deg", "um"))
    write_campaign(other, tmp_path / "um")
    header, degrees = table(tmp_path / "um" / "measurements.csv")
    assert np.abs(degrees[:, header.index("joint_1")]).max() > 10.0
    assert run("diagnose", tmp_path / "um", "--model", tmp_path / "m.json")[0] == 0
    places = []
    for where, model in ((folder, diagnosed.model), (tmp_path / "um", tmp_path / "m.json")):
        assert run("predict", model, where / "measurements.csv", "-o", tmp_path / "p.csv")[0] == 0
        places.append(pd.read_csv(tmp_path / "p.csv")[[*PLACE, *STD]].to_numpy())
    np.testing.assert_allclose(places[1], 1e3 * places[0], rtol=0, atol=1e-2)


def test_predict_tells_a_session_that_the_model_has_not_seen(run, folder, diagnosed, tmp_path):
    model = CorrectedModel.load(diagnosed.model)
    spread = replace(model.spread, levels={"session": ("mon", "tue")}, between=np.array([1e-3, 0.0, 0.0]))
    replace(model, spread=spread).save(tmp_path / "model.json")
    rows = pd.read_csv(folder / "fresh.csv")
    for session, said in (("wed", "the model has not seen 'wed', but 'mon', 'tue'"), ("mon", "")):
        rows.assign(session=session).to_csv(tmp_path / "rows.csv", index=False)
        status, _, told = run("predict", tmp_path / "model.json", tmp_path / "rows.csv", "-o", tmp_path / "p.csv")
        assert status == 0
        assert (said in told) if said else not told
        written = pd.read_csv(tmp_path / "p.csv", keep_default_na=False)
        assert written["outside"].str.contains("session").all() == bool(said)
        assert (written["std.x"] > 1.0).all() == bool(said)  # mm
