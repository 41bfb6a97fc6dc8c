"""The table says what each diagnosis says, exactly, and what the data alone say of every effect."""

import sys
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from fleet.robots import ONLY

import thermal_robot as tr
from thermal_robot.diagnosis.values import Misfit
from thermal_robot.errors import ThermalRobotError
from thermal_robot.fleet import settings
from thermal_robot.fleet.rows import failed, free, needed, rows_of, schema, write_rows


@pytest.fixture(scope="module")
def found():
    return tr.diagnose(tr.demo_campaign(), only=[*ONLY, "thermal_elongation", "link_compliance"])


def diagnosed(robot, effects, seed, **options):
    campaign = tr.simulate(robot, effects, rows=40, noise=20e-6, seed=seed, base_known=False, tool_known=False)
    return tr.diagnose(campaign, **{"only": ONLY, **options})


def test_a_row_is_what_the_diagnosis_tells_of_an_effect(found):
    told = found.to_dict()
    rows = rows_of(found)
    assert [row["effect"] for row in rows] == [effect["name"] for effect in told["effects"]]
    for row, effect in zip(rows, told["effects"], strict=True):
        assert row["rms_before"] == told["gap"]["rms_before"]
        assert row["held_out"] == told["gap"]["held_out"]["shrinkage"]
        assert row["unexplained"] == told["verdict"]["unexplained"]
        for name in ("status", "probability", "shrinkage", "needs", "confounded_with", "quantity", "shape"):
            assert row[name] == effect[name]
        assert row["places"] == effect["locations"]
        known = [p for p in effect["parameters"] if p.pop("identified")]
        assert row["parameters"] == known


def test_a_table_that_does_not_fit_its_robot_is_one_row_with_the_reason(found):
    (row,) = rows_of(replace(found, misfit=Misfit(away=0.3), summary="Nothing fits.", advice="Look."))
    assert (row["outcome"], row["reason"]) == ("unusable", "Nothing fits. Look.")
    assert "effect" not in row


def test_what_is_written_is_read_again_a_few_rows_at_a_time(found, tmp_path, monkeypatch):
    monkeypatch.setattr(settings, "ROWS_AT_ONCE", 2)
    rows = [{"campaign": "a", "hall": "1", **row} for row in rows_of(found)]
    rows += [{"campaign": "b", "hall": "2", **row} for row in failed("it is empty")]
    for name in ("one", "two"):
        write_rows(tmp_path / name, ["hall"], iter(rows))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    with pa.parquet.ParquetFile(tmp_path / "one") as file:
        assert file.num_row_groups == (len(rows) + 1) // 2
        table = file.read()
    assert table.schema.equals(schema(["hall"]))
    for read, given in zip(table.to_pylist(), rows, strict=True):
        assert {k: v for k, v in read.items() if v is not None} == {k: v for k, v in given.items() if v is not None}


def test_a_module_that_is_missing_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ThermalRobotError, match=r"needs distributed.*pip install 'thermal-robot\[fleet\]'"):
        needed("distributed")


@pytest.mark.parametrize("effects", [{}, {"backlash": {"joint_2": 4e-4}}], ids=["nothing found", "one found"])
def test_free_values_are_least_squares_beside_what_was_found(rv_m2, effects):
    """Against a dense solution with a row for each prior; the frames and the effect in question have none."""
    fit = diagnosed(rv_m2, effects, 3, only=["backlash", "joint_gain"]).fit
    e, name = fit.explanation, "joint_gain"
    own, others = fit.blocks_of(name)[0], [b for b in e.best.blocks if fit.families[b] != name]
    assert [fit.families[b] for b in others] == list(effects)
    assert fit.probability("backlash") < settings.MAY_BE or effects
    blocks = [e.linear.blocks[b] for b in (own, *others)]
    root = np.sqrt(e.whitening.weights)[:, None, None] / (e.whitening.sigma()[:, :, None] * e.best.noise)
    columns = np.concatenate([e.linear.frames, *(b.columns for b in blocks)], axis=2) * root
    columns = columns.reshape(-1, columns.shape[2])
    gap = (e.linear.gap[:, :, None] * root).ravel()
    flat, width = e.linear.frames.shape[2], len(blocks[0].sizes)
    prior = np.concatenate([np.full(flat + width, np.inf), *(e.held(b) for b in others)])
    size = np.concatenate([1e-3 * np.ones(flat), *(b.sizes for b in blocks)])
    # the last joint turns about the target: next to nothing is seen of its gain
    inverse = np.linalg.pinv(np.vstack([columns, np.diag(1.0 / prior)]) * size, rcond=1e-5)
    answer = size * (inverse @ np.append(gap, np.zeros(len(prior))))
    spread = size * np.sqrt((inverse**2).sum(axis=1))
    names = [p.name for p in blocks[0].parameters]
    found = free(fit)[name]
    assert found
    for parameter in found:
        k = flat + names.index(parameter["name"])
        assert parameter["value"] == pytest.approx(answer[k], abs=1e-4 * spread[k])
        assert parameter["std"] == pytest.approx(spread[k], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 6e-5], ids=["absent", "found in some"])
def test_free_values_scatter_about_the_truth_by_their_deviation(rv_m2, size):
    off, found = [], []
    for seed in range(24):
        diagnosis = diagnosed(rv_m2, {"backlash": {"joint_2": size}}, seed)
        found.append("backlash" in diagnosis.verdict)
        for parameter in free(diagnosis.fit, ["backlash"])["backlash"]:
            true = size if parameter["name"] == "lost motion, joint_2" else 0.0
            off.append((parameter["value"] - true) / parameter["std"])
    assert any(found) == (size > 0.0)
    assert not all(found)
    assert len(off) >= 48
    assert np.mean(off) == pytest.approx(0.0, abs=4.0 / np.sqrt(len(off)))
    # of 48 values the root mean square is known to 10 %: twice that
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)


def test_free_values_are_told_in_all_joints_and_of_nothing_that_the_data_do_not_see(rv_m2):
    """Else no robot could stand out by a fault of its own; the zero of joint 1 is the direction of the base."""
    found = diagnosed(rv_m2, {"backlash": {"joint_2": 6e-4}}, 4)
    assert {place.name for place in found.finding("backlash").locations if place.share > 0.0} == {"joint_2"}
    told = free(found.fit, ["joint_gain"])
    zeros = [parameter["name"] for parameter in told["joint_offset"]]
    assert zeros
    assert "zero offset, joint_1" not in zeros
    assert len(told["backlash"]) >= 4
    for p in told["backlash"]:
        assert abs(p["value"] - 6e-4 * (p["name"] == "lost motion, joint_2")) < 4.0 * p["std"]
    assert len(told["joint_gain"]) >= 2  # which the diagnosis was not asked for
    assert all(abs(p["value"]) < 4.0 * p["std"] for p in told["joint_gain"])
