"""motion.toml and data frames: what becomes of units, names, stamps and labels, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from motion.arms import JOINTS, TOML, log, put, read, tables

from thermal_robot.errors import CampaignError
from thermal_robot.motion import Servo, read_motion


def test_a_log_of_two_files_keeps_the_stamps_of_each(tmp_path):
    state, command = tables(3)
    found = read(tmp_path)
    assert found.joints == JOINTS
    assert [motion.name for motion in found.motions] == ["m0", "m1", "m2"]
    one = found.motions[1]
    rows = state[state.motion == "m1"]
    np.testing.assert_allclose(one.position.time, rows.time)
    np.testing.assert_allclose(one.position.values[:, 2], rows["q.joint_3"])
    np.testing.assert_allclose(one.command.values[:, 0], command[command.motion == "m1"]["cmd.joint_1"])
    assert one.velocity is not None
    assert one.torque is None
    assert found.notes == ()
    for one, other in zip(found.motions, log(state, command).motions, strict=True):  # frames are read alike
        np.testing.assert_allclose(one.velocity.values, other.velocity.values, atol=1e-12)
    assert repr(found) == f"<MotionLog {tmp_path.name!r}: 3 motions of 5 joints, 60 s>"


def test_units_and_names_are_met_once():
    state, command = tables(2)
    plain = log(state, command)
    other = state.rename(columns={f"q.{j}": f"{j}.pos" for j in JOINTS} | {"time": "stamp"})
    other["stamp"] = 1.7e18 + 1e9 * np.round(other["stamp"], 6)
    other[[f"{j}.pos" for j in JOINTS]] *= 180 / np.pi
    command = command.assign(stamp=1.7e18 + 1e9 * np.round(command["time"], 6)).drop(columns="time")
    told = {"q": {"column": "{joint}.pos", "unit": "deg"}, "time": {"column": "stamp", "unit": "ns"}}
    found = log(other, command, channels=told)
    for one, same in zip(plain.motions, found.motions, strict=True):
        np.testing.assert_allclose(one.position.values, same.position.values, atol=1e-12)
        np.testing.assert_allclose(one.position.time, same.position.time, atol=1e-6)


def test_what_the_file_says_of_servos_payload_and_tolerance(tmp_path):
    more = "[servo.joint_2]\nkp = 30.0\ndead_band = 0.002\n[payload]\nmass = 0.5\ncom = [0, 0, 0.1]\n"
    found = read(tmp_path, toml=f"{TOML}{more}[tolerance]\njoint_1 = 1e-3\n")
    assert found.servos == {"joint_2": Servo(kp=30.0, dead_band=0.002)}
    assert found.payload[0] == 0.5
    assert found.payload[1].tolist() == [0.0, 0.0, 0.1]
    assert found.tolerance == {"joint_1": 1e-3}


def test_one_column_of_volts_is_of_all_joints_and_gaps_stay_gaps():
    state, command = tables(1)
    state["volts"], state.loc[5, "q.joint_1"] = 7.4, np.nan
    motion = log(state, command).motions[0]
    assert motion.volts.values.shape == (len(state), 5)
    assert np.isnan(motion.position.values[5]).tolist() == [True, False, False, False, False]


def test_an_interruption_parts_a_motion():
    state, command = tables(1)
    found = log(state[(state.time < 8) | (state.time > 11)], command)
    assert [motion.name for motion in found.motions] == ["m0", "m0 (2)"]
    assert "interrupted 1 times" in found.notes[0]
    assert all(motion.position.time[0] < 1.6 for motion in found.motions)


def test_a_motion_of_a_second_and_a_half_is_read():
    state, command = tables(1)
    assert len(log(state[state.time < 1.5], command[command.time < 1.5]).motions) == 1


SPOILT = [
    ('urdf = "builtin:rv_m2"', "", "neither", "urdf or mjcf"),
    ('angle_unit = "rad"', "", "motion.angle_unit", "is missing"),
    ('angle_unit = "rad"', 'angle_unit = "rad"\n[servo.joint_9]\nkp = 1.0', "row 6", "no such joint"),
    ('angle_unit = "rad"', 'angle_unit = "rad"\n[servo.joint_2]\nkp = -1.0', "row 6", "a number above 0"),
    ('angle_unit = "rad"', 'angle_unit = "rad"\n[channels]\nq = "pos"', "row 7", "a pattern with {joint}"),
    (
        'angle_unit = "rad"',
        'angle_unit = "rad"\n[channels]\nqdd = "pos"',
        "row 7",
        "unknown channel; did you mean 'qd'",
    ),
    ('angle_unit = "rad"', 'angle_unit = "rad"\n[channels]\n"q.joint_1" = "pos"', "'pos'", "there is no such column"),
    ("state.csv", "stat.csv", "stat.csv", "there is no such file"),
]


@pytest.mark.parametrize(("old", "new", "where", "said"), SPOILT)
def test_a_motion_toml_that_is_refused_says_where_and_why(tmp_path, old, new, where, said):
    with pytest.raises(CampaignError) as caught:
        read(tmp_path, toml=TOML.replace(old, new))
    assert where in str(caught.value)
    assert said in str(caught.value)


def _swapped_rows(state, command):
    state.loc[[40, 41]] = state.loc[[41, 40]].to_numpy()
    return state, command


def _foreign_joint(state, command):
    return state.rename(columns={"q.joint_1": "q.elbo", "qd.joint_1": "qd.elbo"}), command


def _no_command(state, command):
    return state, command[["motion", "time"]]


def _by_hand(state, command):
    return state, command.assign(**{f"cmd.{joint}": 0.1 for joint in JOINTS})


def _copied(state, command):
    own = {f"cmd.{joint}": np.interp(command.time, state.time, state[f"q.{joint}"]) for joint in JOINTS}
    return state, command.assign(**own)


def _copied_with_gaps(state, command):
    gaps = {f"q.{joint}": state[f"q.{joint}"].mask(state.index == 7 + k) for k, joint in enumerate(JOINTS)}
    return _copied(state.assign(**gaps), command)


def _slow(state, command):
    return state[state.index % 3 == 0], command


def _fed_forward(state, command):
    own = {f"q.{joint}": np.interp(state.time, command.time, command[f"cmd.{joint}"]) for joint in JOINTS}
    return state.assign(**{name: values + 1e-4 * np.sin(state.time) for name, values in own.items()}), command


def _torque_off(state, command):
    """Half a second after its command came to rest the first joint falls by a radian."""

    def resting(table, names, since):
        return table[names].where(table.time <= since).groupby(table.motion).ffill()

    state, command = state.copy(), command.copy()
    q, cmd = ([f"{kind}.{joint}" for joint in JOINTS] for kind in ("q", "cmd"))
    state[q], command[cmd] = resting(state, q, 4.3), resting(command, cmd, 4.0)
    state[q[0]] += np.clip(2.0 * (state.time - 4.5), 0.0, 1.0)
    return state, command


def _without_labels(state, command):
    command = command.drop(columns="motion")
    return state, command.assign(time=0.02 * command.index)


@pytest.mark.parametrize(
    ("spoil", "motions", "said"),
    [
        (_swapped_rows, 1, "row 41, column 'time': rows are out of order"),
        (_foreign_joint, 1, "the robot has no joint 'elbo'"),
        (_no_command, 1, "no command is recorded"),
        (_by_hand, 2, "external force"),
        (_torque_off, 2, "where the torque is off, the weight"),
        (_copied, 1, "external force"),
        (_copied_with_gaps, 1, "encoder.s own reading"),
        (_slow, 1, "sampled too slowly; found 16.6 Hz"),
        (_fed_forward, 1, "feed-forward unknown"),
        (_without_labels, 2, "has no labels of motions"),
        (lambda state, command: (state, command.drop(columns="motion")), 2, "or two motions have one label"),
    ],
)
def test_a_log_that_tells_nothing_is_refused_with_the_reason(spoil, motions, said):
    state, command = spoil(*tables(motions))
    with pytest.raises(CampaignError, match=said.replace("'", ".")):
        log(state, command)


def test_a_torque_channel_makes_up_for_an_unknown_feed_forward():
    state, command = _fed_forward(*tables(1))
    state = state.assign(**{f"tau.{joint}": 1.0 for joint in JOINTS})
    found = log(state, command)
    assert "feed-forward unknown" in found.notes[-1]
    assert found.motions[0].torque.values.shape == (len(state), 5)


def test_a_file_that_is_not_there_says_what_is(tmp_path):
    put(tmp_path)
    with pytest.raises(CampaignError, match=r"campaigns there: 'motion\.toml'"):
        read_motion(tmp_path / "motoin.toml")
