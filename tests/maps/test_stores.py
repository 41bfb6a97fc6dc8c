"""Maps on disk: chunks whole or not there."""

import numpy as np
import pytest

from thermal_robot.errors import CampaignError
from thermal_robot.maps.stores import store


@pytest.fixture(params=["parquet", "zarr"])
def kept(request, tmp_path):
    pytest.importorskip({"parquet": "pyarrow", "zarr": "zarr"}[request.param], reason="its extra is not installed")
    return store(tmp_path / f"map.{request.param}")


def chunk(start, count):
    return {"place": np.arange(start, start + count), "value": np.linspace(0.0, 1.0, count)}


def test_chunks_come_back_as_they_were(kept):
    assert (kept.notes, kept.done) == ({}, 0)
    kept.begin({"robot": "arm", "parts": 2})
    kept.add(chunk(0, 5))
    kept.add(chunk(5, 0))
    kept.add(chunk(5, 3))
    assert (kept.notes["robot"], kept.done) == ("arm", 3)
    parts = list(kept.chunks(["value", "place"]))
    assert [len(part["place"]) for part in parts] == [5, 0, 3]
    np.testing.assert_array_equal(parts[2]["place"], [5, 6, 7])
    np.testing.assert_array_equal(parts[0]["value"], np.linspace(0.0, 1.0, 5))
    kept.begin({"robot": "other"})
    assert (kept.notes, kept.done) == ({"robot": "other"}, 0)


def test_a_chunk_that_was_not_finished_does_not_count(kept, monkeypatch):
    kept.begin({})
    kept.begin({"robot": "arm"})
    kept.add(chunk(0, 4))

    class Stopped(Exception):
        pass

    class Torn(dict):
        def items(self):
            yield "place", np.arange(4, 9)
            raise Stopped

        __iter__ = None

    torn = Torn(chunk(4, 5))
    with pytest.raises((Stopped, TypeError)):
        kept.add(torn)
    assert kept.done == 1
    kept.add(chunk(4, 2))
    assert [len(part["place"]) for part in kept.chunks()] == [4, 2]
    np.testing.assert_array_equal(list(kept.chunks(["place"]))[1]["place"], [4, 5])


@pytest.mark.parametrize("name", ["map", "map.csv"])
def test_another_ending_is_refused(tmp_path, name):
    with pytest.raises(CampaignError, match=r"no kind of map.*expected \.zarr or \.parquet"):
        store(tmp_path / name)
