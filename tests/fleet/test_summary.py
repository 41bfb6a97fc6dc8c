"""The summary of a fleet is plain values, and says of a small table what stands in it."""

import json

import numpy as np
from fleet.robots import told_rows, write_told

from thermal_robot.fleet.summary import SCHEMA, summarise


def test_it_counts_names_and_is_json(tmp_path):
    rng = np.random.default_rng(0)
    rows = []
    for k in range(30):
        values = {"play": (rng.normal() + 60.0 * (k == 4), 1.0), "shift": (5.0 + rng.normal(), 1.0)}
        rows.append(told_rows(f"r{k}", {"hall": str(k % 2)}, {"backlash": (k == 4, "joint_1", values)}, gap=1e-6 * k))
    rows.append(told_rows("bad", {"hall": "1"}, {}, outcome="failed", reason="it is empty"))
    stages = []
    found = summarise(write_told(tmp_path / "t", rows), ["hall"], lambda *stage: stages.append(stage))
    assert (found.campaigns, found.robots, found.labels) == (31, 31, ("hall", "model"))
    assert found.outcomes == {"diagnosed": 30, "failed": 1}
    assert found.failures == (("bad", "failed", "it is empty"),)
    assert [(e.effect, e.found, e.testable) for e in found.effects] == [("backlash", 1, 30)]
    assert [(s.parameter, s.label) for s in found.shared] == [("shift", "")]
    assert [(a.robot, a.parameter) for a in found.apart] == [("r4", "play")]
    assert [(c.robot, c.place) for c in found.found] == [("r4", "joint_1")]
    assert found.parameters == 2
    assert stages == [("effects compared", 1, 1)]
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["schema"] == SCHEMA
    assert plain["apart"][0]["robot"] == "r4"


def test_a_table_of_failures_alone_has_a_summary(tmp_path):
    rows = [told_rows("bad", {"hall": "1"}, {}, outcome="failed", reason="it is empty")]
    found = summarise(write_told(tmp_path / "t", rows), ["hall"])
    assert (found.outcomes, found.effects, found.shared, found.apart) == ({"failed": 1}, (), (), ())
