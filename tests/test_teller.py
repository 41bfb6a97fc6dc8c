"""Who tells is asked for late, and the last one counts."""

import pytest

from thermal_robot import teller


def test_the_last_one_registered_counts(monkeypatch):
    monkeypatch.setattr(teller, "_tellers", [])
    with pytest.raises(RuntimeError, match="import thermal_robot, or call told_by"):
        teller.registered()
    first, last = object(), object()
    teller.told_by(first)
    assert teller.registered() is first
    teller.told_by(last)
    assert teller.registered() is last
