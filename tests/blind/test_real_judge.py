"""Whether answers to changed real campaigns are judged as the rules say."""

from thermal_robot.blind.real import judged

ELBOW = {"kind": "joint", "name": "elbow_joint"}

SLIP = {"places": [ELBOW], "quantities": ["time", "order"]}

LOST = {"parts": {"backlash": {"places": [ELBOW], "size": 1e-3}}}

WARM = {"places": [], "quantities": ["time", "order"]}


def said(verdict=(), unexplained=False, place="elbow_joint", follows="order", **effects):
    """A diagnosis as JSON, with what the judge reads."""
    plain = {"status": "found", "locations": [], "parameters": [], "needs": []}
    return {
        "gap": {"held_out": {"rms_after": 1e-4}},
        "verdict": {"effects": list(verdict), "unexplained": unexplained},
        "effects": [{"name": name, **plain} for name in verdict if name not in effects]
        + [{"name": name.replace("_1", ".1"), **plain, **more} for name, more in effects.items()],
        "unexplained": {
            "locations": [{"kind": "joint", "name": place}],
            "depends_on": [{"covariate": follows}, {"covariate": "elbow_joint"}],
        },
    }


def right(fault, diagnosis, truth, after=None, before=None):
    record = {"said": diagnosis, "truth": truth, "fresh": None if after is None else {"rms_after": after}}
    control = None if before is None else {"fresh": {"rms_after": before}}
    return judged(fault, record, control, 1e-4)[0]


def lost(value, place="elbow_joint", status="found"):
    parameters = [{"name": "lost motion, elbow_joint", "value": value}]
    finding = {"status": status, "locations": [{"kind": "joint", "name": place}], "parameters": parameters}
    return said(["geometric", "backlash"], backlash=finding)


def test_judge_of_lost_motion():
    assert right("backlash", lost(1.25e-3), LOST)
    assert not right("backlash", lost(1.35e-3), LOST)
    assert not right("backlash", lost(0.65e-3), LOST)
    assert not right("backlash", lost(1e-3, "wrist_1_joint"), LOST)
    assert not right("backlash", lost(1e-3, status="not_found"), LOST)
    assert not right("backlash", said(["geometric"]), LOST)


def test_judge_of_a_slip():
    assert right("slip", said(unexplained=True), SLIP)
    assert right("slip", said(unexplained=True, follows="time"), SLIP)
    assert not right("slip", said(), SLIP)
    assert not right("slip", said(unexplained=True, place="wrist_1_joint"), SLIP)
    assert not right("slip", said(unexplained=True, follows="elbow_joint"), SLIP)
    law = {"quantity": "time", "locations": [ELBOW]}
    elsewhere = {"unexplained": True, "place": "wrist_1_joint", "follows": "elbow_joint"}
    assert right("slip", said(**elsewhere, discovered_1=law), SLIP)
    assert not right("slip", said(**elsewhere, discovered_1={**law, "quantity": "elbow_joint"}), SLIP)


def test_judge_of_temperature():
    asks = {"status": "not_testable", "needs": ["temperature"]}
    assert right("hidden", said(unexplained=True, thermal_elongation=asks), WARM)
    assert not right("hidden", said(thermal_elongation=asks), WARM)
    assert not right("hidden", said(unexplained=True, follows="elbow_joint", thermal_elongation=asks), WARM)
    assert not right("hidden", said(["thermal_elongation"], unexplained=True), WARM)
    assert right("temperature", said(["geometric", "thermal_elongation"]), WARM)
    assert not right("temperature", said(["geometric", "drift"]), WARM)


def test_judge_of_what_is_left_on_fresh_rows():
    for fault, cause in (("offset", "joint_offset"), ("scale", "instrument_scale")):
        assert right(fault, said(["geometric"]), {}, 1.09e-4, 1e-4)
        assert right(fault, said([cause]), {}, 1.09e-4, 1e-4)
        assert not right(fault, said(["geometric"]), {}, 1.11e-4, 1e-4)
        assert not right(fault, said(["joint_gain"]), {}, 1e-4, 1e-4)
        assert not right(fault, said(["geometric"]), {}, 1e-4)
        assert not right(fault, said(["geometric"]), {})
    assert right("nothing", said(["geometric"]), {}, 1.09e-4)
    assert not right("nothing", said(["geometric"]), {}, 1.11e-4)
    assert right("later", said(), {}, 1.2e-4)
    assert not right("later", said(), {}, 1.3e-4)
    assert not right("later", said(), {}, 0.4e-4)


def test_the_answer_is_told_in_short_words():
    after = {"rms_after": 1.2e-4}
    record = {"said": said(["geometric"]), "truth": {}, "fresh": after}
    assert judged("nothing", record, None, 1e-4) == (False, "geometric; leaves 0.120 mm, README 0.100 mm")
    assert judged("later", record, None, 1e-4)[1] == "geometric; claims 0.100 mm, reaches 0.120 mm"
    assert judged("offset", record, None, 1e-4) == (False, "geometric; leaves 0.120 mm, no control")
    assert judged("offset", record, {"fresh": after}, 1e-4)[1] == "geometric; leaves 0.120 mm, control 0.120 mm"
    assert judged("nothing", {**record, "fresh": None}, None, 1e-4) == (False, "geometric; nothing predicted")
    slip = judged("slip", {**record, "said": said(), "truth": SLIP}, None, 1e-4)
    assert slip == (False, "no effect; not flagged: elbow_joint, order")
    assert judged("backlash", {"said": lost(0.9e-3), "truth": LOST}, None, 1e-4) == (
        True, "geometric backlash; backlash first at elbow_joint, 0.9 mrad at elbow_joint",
    )  # fmt: skip


def test_no_diagnosis_is_no_right_answer():
    for fault in ("nothing", "offset", "scale", "backlash", "slip", "temperature", "hidden", "later"):
        assert judged(fault, {"said": None, "truth": {}, "error": "late"}, None, 1e-4) == (False, "late")
        assert judged(fault, {"said": None, "truth": {}}, None, 1e-4) == (False, "no diagnosis")
