"""The table says what each diagnosis says, exactly, and equal rows are equal bytes."""

import pyarrow as pa
import pyarrow.parquet
import pytest
from fleet.robots import ONLY

import thermal_robot as tr
from thermal_robot.diagnosis.values import Misfit
from thermal_robot.fleet.rows import failed, rows_of, schema, write_rows


@pytest.fixture(scope="module")
def found():
    return tr.diagnose(tr.demo_campaign(), only=[*ONLY, "thermal_elongation", "link_compliance"])


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
        known = [p for p in effect["parameters"] if p["identified"]]
        assert [(p["name"], p["value"], p["std"], p["unit"]) for p in row["parameters"]] == [
            (p["name"], p["value"], p["std"], p["unit"]) for p in known
        ]


def test_a_table_that_does_not_fit_its_robot_is_one_row_with_the_reason(found):
    from dataclasses import replace

    (row,) = rows_of(replace(found, misfit=Misfit(away=0.3), summary="Nothing fits.", advice="Look."))
    assert (row["outcome"], row["reason"]) == ("unusable", "Nothing fits. Look.")
    assert "effect" not in row


def test_what_is_written_is_read_again(found, tmp_path):
    rows = [{"campaign": "a", "hall": "1", **row} for row in rows_of(found)]
    rows += [{"campaign": "b", "hall": "2", **row} for row in failed("it is empty")]
    for name in ("one", "two"):
        write_rows(tmp_path / name, ["hall"], iter(rows))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    table = pa.parquet.read_table(tmp_path / "one")
    assert table.schema.equals(schema(["hall"]))
    for read, given in zip(table.to_pylist(), rows, strict=True):
        assert {k: v for k, v in read.items() if v is not None} == {k: v for k, v in given.items() if v is not None}


def test_a_table_of_many_rows_is_written_a_few_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr("thermal_robot.fleet.settings.ROWS_AT_ONCE", 7)
    write_rows(tmp_path / "t", [], ({"campaign": str(k), "outcome": "failed"} for k in range(20)))
    file = pa.parquet.ParquetFile(tmp_path / "t")
    assert file.num_row_groups == 3
    assert file.read()["campaign"].to_pylist() == [str(k) for k in range(20)]
    file.close()
