"""Plans without an instrument: the robot reaches what they name, and what comes back names causes."""

import numpy as np
import pandas as pd
import pytest

import thermal_robot as tr
from thermal_robot.planning import plan, text, write_plan
from thermal_robot.planning.plan import FRAMES, foreseen

ROWS, NOISE, TARGET = 36, 5e-5, (0.03, 0.0, 0.05)
ASKED = ("joint_offset", "joint_compliance")


def planned(robot, kind, **changed):
    return plan(robot, ROWS, ASKED, noise=NOISE, target=TARGET, measures=kind, **changed)


@pytest.fixture(scope="module")
def led(rv_m2):
    """A plan of sockets."""
    return planned(rv_m2, "socket")


def places(campaign):
    """Where the target is, root frame."""
    return tr.observe(campaign).position


def test_postures_bring_the_ball_into_the_sockets_that_the_plan_names(led):
    rows, at = led.commands, places(led.commands)
    for row, (stand, socket) in enumerate(zip(rows.labels["stand"], rows.labels["socket"], strict=True)):
        found = led.artefacts[f"stand {stand}"]
        assert np.linalg.norm(at[row] - found.points[found.sockets.index(socket)]) < 6.0 * NOISE
    assert {name for name in led.artefacts} == {f"stand place {k}" for k in range(3)}
    assert ((rows.q >= rows.robot.lower) & (rows.q <= rows.robot.upper)).all()


def test_postures_bring_the_tip_onto_the_planes_that_the_plan_names(rv_m2):
    found = planned(rv_m2, "plane")
    at = places(found.commands)
    for own, point in zip(found.commands.labels["plane"], at, strict=True):
        surface = found.artefacts[f"plane {own}"]
        assert abs(surface.normal @ point - surface.offset) < 6.0 * NOISE


def test_cameras_see_the_target_where_the_plan_says(rv_m2):
    found = planned(rv_m2, "pixel")
    lens = found.commands.facts["camera"]["0"]
    read = np.stack([found.commands.readings[name] for name in "uv"], axis=1)
    for own, point, pixel in zip(found.commands.labels["camera"], places(found.commands), read, strict=True):
        view = found.artefacts[f"camera {own}"]
        x, y, z = view.pose[:3, :3].T @ (point - view.pose[:3, 3])
        assert z > 0.5  # in front of it
        assert lens["fx"] * x / z + lens["cx"] == pytest.approx(pixel[0], abs=2.0)
        assert lens["fy"] * y / z + lens["cy"] == pytest.approx(pixel[1], abs=2.0)
    assert "camera 0: at (" in text(found)


def test_a_wire_is_as_long_as_from_the_anchor_that_the_plan_names(rv_m2):
    found = planned(rv_m2, "distance")
    at = places(found.commands)
    for own, point, read in zip(found.commands.labels["anchor"], at, found.commands.readings["distance"], strict=True):
        anchor = found.artefacts[f"anchor {own}"]
        assert np.linalg.norm(point - anchor.place) + anchor.zero == pytest.approx(read, abs=6.0 * NOISE)


def test_the_side_that_a_hand_brings_joints_from_is_not_known(rv_m2):
    found = plan(rv_m2, 24, ["backlash"], noise=NOISE, measures="socket").effect("backlash")
    assert found.lacks[0] == "approach.joint_1"
    assert not found.told


def test_sockets_never_tell_the_base_nor_the_zero_of_the_first_joint(led, rv_m2):
    zeros = led.effect("joint_offset").parameters
    assert [parameter.told for parameter in zeros[:4]] == [False, False, True, True]
    assert zeros[0].sigma == pytest.approx(zeros[0].size, rel=0.01)
    assert FRAMES in led.effect("joint_offset").confounded
    from_above = plan(rv_m2, ROWS, ASKED, noise=NOISE, target=TARGET, base_known=True)
    assert from_above.effect("joint_offset").parameters[0].told


def blur(effects):
    """Sum of ln(expected deviation / size) over all parameters: information, turned round."""
    return sum(np.log(p.beside / p.size) for effect in effects for p in effect.parameters)


def test_stands_are_placed_better_than_by_chance(led, rv_m2):
    found = []
    for seed in range(100, 108):
        chance = tr.simulate(
            rv_m2, commands=led.commands.q, measures="socket", noise=NOISE, tool=TARGET, tool_known=False, seed=seed
        )
        found.append(blur(foreseen(chance, ASKED)))
    assert blur(led.effects) < np.quantile(found, 0.25)


def test_the_text_and_the_files_say_where_the_stands_stand(led, tmp_path):
    told = text(led).splitlines()
    assert told[0] == f"{ROWS} rows. What is to be set up, in the robot's root frame:"
    first = 1e3 * led.artefacts["stand place 0"].points[0]
    assert told[1].startswith(f"stand place 0: socket 0 at ({', '.join(f'{x:.0f}' for x in first)}) mm, socket 1 at")
    toml = write_plan(led, tmp_path / "hall").read_text(encoding="utf-8")
    assert told[1] in toml
    assert "lead the robot" in toml
    assert set(led.to_dict()["artefacts"]) == set(led.artefacts)


def test_what_is_filled_in_becomes_a_campaign_that_names_the_zero(led, tmp_path):
    """The encoder of the third joint reads 3 mrad too little."""
    folder = write_plan(led, tmp_path / "hall").parent
    table = pd.read_csv(folder / "measurements.csv")
    names = list(led.commands.robot.joint_names)
    assert table[names].isna().all(axis=None)
    assert not pd.read_csv(folder / "plan.csv")[names].isna().any(axis=None)
    table[names] = led.commands.q
    table[names[2]] -= 3e-3
    table.drop(columns="temperature").to_csv(folder / "measurements.csv", index=False)
    campaign = tr.read_campaign(folder)
    assert campaign.kinds == ("socket",)
    found = tr.diagnose(campaign, only=ASKED)
    assert found.verdict == ("joint_offset",)
    (zeros,) = (effect for effect in found.effects if effect.name == "joint_offset")
    (value,) = (estimate for estimate in zeros.parameters if estimate.name.endswith(names[2]))
    expected = led.effect("joint_offset").parameters[2]
    assert value.value == pytest.approx(3e-3, abs=4.0 * expected.sigma)
    assert 0.5 < value.std / expected.sigma < 2.0


def test_only_what_is_brought_there_is_planned_so(rv_m2):
    with pytest.raises(tr.CampaignError, match="measures") as refused:
        planned(rv_m2, "pose")
    assert '"socket" or "plane" or "distance" or "pixel"' in str(refused.value)
