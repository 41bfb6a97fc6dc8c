"""How often what was found, where, and whether it gathers."""

import numpy as np
from fleet.robots import told_rows, write_told

from thermal_robot.fleet.rows import overview
from thermal_robot.fleet.summary import _counted


def table(path, chance, robots=60, halls=3, gathered=None):
    rng = np.random.default_rng(chance)

    def campaign(k):
        share = 0.9 if f"hall {k % halls}" == gathered else 0.1
        found = rng.random() < share
        return told_rows(
            f"r{k}", {"hall": f"hall {k % halls}"}, {"backlash": (found, f"joint_{k % 2}", {})}, gap=k * 1e-6
        )

    return write_told(path / "t.parquet", [campaign(k) for k in range(robots)])


def test_counts_places_and_the_largest_gaps(tmp_path, monkeypatch):
    monkeypatch.setattr("thermal_robot.fleet.settings.MOST_LISTED", 3)
    file = table(tmp_path, 1, gathered="hall 0")
    known = overview(file, ("hall",))
    (count,), _, cases = _counted(file, known)
    assert (count.effect, count.testable, count.parameters) == ("backlash", 60, True)
    assert count.found == sum(count.places.values())
    assert [c.rms_before for c in cases] == sorted((c.rms_before for c in cases), reverse=True)
    assert len(cases) == 3


def test_what_gathers_in_a_hall_is_told_and_what_does_not_is_not(tmp_path):
    file = table(tmp_path, 1, gathered="hall 2")
    (found,) = _counted(file, overview(file, ("hall",)))[1]
    assert (found.label, found.group, found.robots, found.robots_elsewhere) == ("hall", "hall 2", 20, 40)
    assert found.found > 12
    assert found.p_value < 1e-4
    false = 0
    for chance in range(60):
        file = table(tmp_path, [2, chance])
        false += bool(_counted(file, overview(file, ("hall",)))[1])
    assert false <= 3


def test_several_campaigns_of_a_robot_count_once_and_laws_by_what_they_follow(tmp_path):
    rows = [told_rows(f"d{k}", {"robot": "a"}, {f"discovered.{k}": (True, "joint_3", {})}) for k in (1, 2)]
    for row in (row for some in rows for row in some):
        row["quantity"] = "time"
    file = write_told(tmp_path / "t.parquet", rows, ("robot",))
    (count,), gathered, cases = _counted(file, overview(file, ("robot",)))
    assert (count.effect, count.found, count.testable, count.places) == ("a law of time", 1, 1, {"joint_3": 1})
    assert not count.parameters
    assert gathered == ()
    assert [c.campaign for c in cases] == ["d1", "d2"]


def test_every_robot_with_a_gap_is_listed_what_is_in_doubt_or_unexplained_too(tmp_path):
    gaps = {"sure": 6e-5, "doubtful": 3e-4, "strange": 2e-4, "sound": 1e-5}
    rows = {
        name: told_rows(name, {}, {e: (name == "sure", "joint_2", {}) for e in ("backlash", "drift")}, gap=gap)
        for name, gap in gaps.items()
    }
    backlash, drift = rows["doubtful"]
    backlash |= {"status": "confounded", "confounded_with": ["drift"], "places": rows["sure"][0]["places"]}
    drift |= {"status": "confounded", "confounded_with": ["backlash"]}
    for row in rows["strange"]:
        row["unexplained"] = True
    file = write_told(tmp_path / "t.parquet", rows.values(), ())
    counts, _, cases = _counted(file, overview(file, ()))
    told = [(case.robot, case.effect, case.confounded_with) for case in cases]
    assert told[:2] == [("doubtful", "backlash", ("drift",)), ("strange", "", ())]
    assert {case[0] for case in told[2:]} == {"sure"}
    assert {c.effect: (c.found, c.confounded) for c in counts} == {"backlash": (2, 1), "drift": (1, 0)}
