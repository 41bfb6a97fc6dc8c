"""Diagnoses made by hand, one of each kind that a report must be able to tell."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import (
    Dependence,
    Estimate,
    Finding,
    Gap,
    HeldOut,
    Location,
    Rows,
    Unexplained,
    Where,
)
from thermal_robot.effects.law_words import Size
from thermal_robot.iso9283 import (
    Accuracy,
    AlongPath,
    Drift,
    PathCriteria,
    Performance,
    PoseCriteria,
    Repeatability,
    Variation,
)

JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
LINKS = (
    "base_link",
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
)


def rows(samples=120, before=4e-4, after=2.5e-5, *, aside=(), pose=False, joints=JOINTS, seed=3):
    """Measurements in the file's rows 2, 3, …, whose gap turns with the arm and grows with temperature."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (samples, len(joints)))
    time = np.linspace(0.0, 7200.0, samples)
    temperature = 22.0 + 14.0 * (1.0 - np.exp(-time / 2500.0))
    reach = 0.5 + 0.4 * np.cos(q[:, 2])
    position = np.column_stack([reach * np.cos(q[:, 0]), reach * np.sin(q[:, 0]), 0.5 + 0.3 * np.sin(q[:, 1])])
    noise = after / np.sqrt(3.0) * rng.standard_normal((samples, 3))
    pattern = position / np.linalg.norm(position, axis=1, keepdims=True) * (temperature - 18.0)[:, None]
    gap = pattern * before / np.sqrt((pattern**2).sum(axis=1).mean()) + noise
    remainder = noise
    numbers = np.arange(2, samples + 2)
    outliers = np.isin(numbers, aside)
    remainder[outliers] += 2e-3
    gap[outliers] += 2e-3
    if pose:
        turned = 4e-5 / np.sqrt(3.0) * rng.standard_normal((samples, 3))
        gap = np.hstack([gap, turned + 6e-4 * np.sin(q[:, :3])])
        remainder = np.hstack([remainder, turned])
    hidden = np.where(outliers, np.nan, 1.0)
    return Rows(
        rows=numbers,
        gap=gap,
        remainder=remainder,
        outliers=outliers,
        position=position,
        q=q,
        covariates={"time": time, "temperature": temperature},
        held_out_before=np.linalg.norm(gap[:, :3], axis=1) * hidden,
        held_out_after=1.06 * np.linalg.norm(remainder[:, :3], axis=1) * hidden,
        units={"time": "s", "temperature": "°C", **dict.fromkeys(joints, "rad")},
    )


NOT_FOUND = (
    Finding("joint_offset", "not_found", 0.02, 0.0012, (-0.004, 0.006)),
    Finding("drift", "not_found", 0.0004, -0.0003, (-0.002, 0.001)),
    Finding("geometric", "not_found", 1e-9, -0.031, (-0.06, 0.002)),
)
NOT_TESTABLE = (
    Finding("backlash", "not_testable", needs=tuple(f"approach.{j}" for j in JOINTS)),
    Finding("joint_compliance", "not_testable", needs=("torque.<joint>", "payload", "masses in the URDF")),
)
THERMAL = Finding(
    "thermal_elongation",
    "found",
    0.9996,
    0.962,
    (0.941, 0.974),
    locations=(
        Location("link", "upper_arm_link", 0.61),
        Location("link", "forearm_link", 0.33),
        Location("link", "wrist_1_link", 0.02),
    ),
    parameters=(
        Estimate("strain per kelvin of upper_arm_link", 1.234e-5, 4.1e-7, "1/K", True),
        Estimate("strain per kelvin of forearm_link", 2.31e-5, 8.9e-7, "1/K", True),
        Estimate("strain per kelvin of wrist_2_link", None, None, "1/K", False),
    ),
)


def found():
    """One effect, outliers, nothing left."""
    return Diagnosis(
        campaign="hall_3_morning",
        robot="ur10",
        tool_frame="tool0",
        samples=120,
        measures="position",
        joint_names=JOINTS,
        outliers=(17, 80),
        gap=Gap(
            4.12e-4,
            2.83e-5,
            2.6e-5,
            "stated",
            HeldOut("blocked", 5, 4.15e-4, 3.05e-5, 0.9946, (0.9901, 0.9967), 4.52e-4, 1.82e-4),
        ),
        effects=(THERMAL, *NOT_FOUND, *NOT_TESTABLE),
        where=Where(
            {"x": 0.35, "y": 0.2, "z": 0.45},
            dict.fromkeys(JOINTS, 0.0),
            dict(zip(LINKS, (0.0, 0.004, 0.61, 0.33, 0.02, 0.0, 0.0), strict=True)),
            {"temperature": 0.81, "time": 0.74},
        ),
        unexplained=Unexplained(False, 0.0, 0.43),
        verdict=("thermal_elongation",),
        probability=0.978,
        summary="Thermal elongation of upper_arm_link and forearm_link explains the gap; it shrinks by "
        "99.5 % on rows that were not used for the fit.",
        advice="To tell thermal elongation from drift, measure again while the robot cools down.",
        separates=(("thermal_elongation", "drift"),),
        model=object(),
        rows=rows(aside=(17, 80)),
        warnings=("The temperature was read once for the whole robot; a link of its own would say more.",),
    )


def nothing():
    """No gap beyond the noise."""
    base = found()
    return replace(
        base,
        campaign="",
        outliers=(),
        gap=Gap(
            2.71e-5,
            2.71e-5,
            2.6e-5,
            "repeats",
            HeldOut("random", 5, 2.72e-5, 2.72e-5, 0.0, (0.0, 0.0)),
        ),
        effects=(*NOT_FOUND, *NOT_TESTABLE),
        where=Where({"x": 0.3, "y": 0.3, "z": 0.4}, {}, {}, {}),
        verdict=(),
        probability=0.93,
        summary="There is no gap beyond the noise.",
        advice="",
        separates=(),
        rows=rows(before=1e-9),
        warnings=(),
    )


def unexplained():
    """An effect that nobody wrote down, in a joint, following time."""
    base = found()
    drawn = rows(aside=(17, 80))
    step = np.where(drawn.covariates["time"] > 4000.0, 9e-5, -4e-5)
    shifted = drawn.remainder + step[:, None] * np.array([0.2, -1.0, 0.6])
    hidden = 1.05 * np.linalg.norm(shifted, axis=1) * np.where(drawn.outliers, np.nan, 1.0)
    return replace(
        base,
        gap=replace(
            base.gap,
            rms_after=1.12e-4,
            held_out=replace(base.gap.held_out, rms_after=1.2e-4, shrinkage=0.91, shrinkage_ci95=(0.87, 0.94)),
        ),
        rows=replace(drawn, remainder=shifted, held_out_after=hidden),
        summary="Thermal elongation explains most of the gap; a remainder that follows time stays unexplained.",
        unexplained=Unexplained(
            True,
            9.4e-5,
            2.3e-14,
            ("The remainder is 4.1 times the noise floor.", "It changes with time more than chance allows."),
            (Location("joint", "elbow_joint", 0.72), Location("base", "base", 0.2)),
            (Dependence("time", 3.2e-9), Dependence("elbow_joint", 0.004)),
        ),
    )


def confounded():
    """Two effects that the data cannot tell apart, orientation measured, a long list of parameters."""
    base = found()
    offsets = tuple(
        Estimate(f"zero offset, {joint}", -1.2e-3 + 4e-4 * j, 2.2e-5, "rad", True) for j, joint in enumerate(JOINTS)
    )
    geometric = tuple(
        Estimate(
            f"{'translation' if k < 3 else 'rotation'} {'xyz'[k % 3]} of {link}",
            None if k == 2 else 1e-5 * (k + 1) * (j + 1),
            None if k == 2 else 1e-5,
            "m" if k < 3 else "rad",
            k != 2,
        )
        for j, link in enumerate(LINKS)
        for k in range(6)
    )
    return replace(
        base,
        measures="pose",
        summary="Geometry, and joint offsets or the base frame, explain the gap.",
        gap=replace(
            base.gap,
            rms_before=2.41e-3,
            held_out=replace(base.gap.held_out, rms_before=2.43e-3),
            orientation_before=1.04e-3,
            orientation_after=4.2e-5,
        ),
        effects=(
            Finding(
                "geometric",
                "found",
                0.999999,
                0.71,
                (0.66, 0.74),
                locations=tuple(Location("link", link, 0.2 - 0.02 * j) for j, link in enumerate(LINKS)),
                parameters=geometric,
            ),
            Finding(
                "joint_offset",
                "confounded",
                0.97,
                0.24,
                (0.2, 0.27),
                confounded_with=("base_frame",),
                locations=(Location("joint", "shoulder_pan_joint", 0.24),),
                parameters=offsets,
            ),
            Finding("base_frame", "confounded", 0.97, 0.0, (0.0, 0.0), confounded_with=("joint_offset",)),
            *NOT_FOUND[1:2],
            *NOT_TESTABLE,
        ),
        where=replace(base.where, joints=dict(zip(JOINTS, (0.24, 0.1, 0.05, 0.01, 0.0, 0.0), strict=True))),
        verdict=("geometric", "joint_offset"),
        separates=(("joint_offset", "base_frame"),),
        rows=rows(aside=(17, 80), before=2.4e-3, pose=True),
    )


def with_law():
    """A law found in the data, beside an effect of the library; what is left of it counts as unexplained."""
    base = unexplained()
    law = Finding(
        "discovered.1",
        "found",
        0.997,
        0.08,
        (0.05, 0.1),
        locations=(Location("joint", "elbow_joint", 0.08),),
        parameters=(Estimate("step at 4000 s", 1.3e-4, 6e-6, "rad", True),),
        quantity="time",
        shape="step",
        describes="an error at elbow_joint that follows time (step)",
        size=(Size("step", 1.7e-4, 6e-6, "rad"),),
        usually="warming, or something that slips",
        title="a step at elbow_joint over time",
    )
    first, *rest = base.effects
    return replace(base, effects=(first, law, *rest), verdict=("thermal_elongation", "discovered.1"))


def contained():
    """Geometry, with the joints' zeros inside it."""
    base = found()
    zeros = tuple(Estimate(f"zero offset, {joint}", -7.1e-3, 2e-5, "rad", True) for joint in JOINTS[1:5])
    axes = tuple(Estimate(f"distance a of {joint}", 1e-4, 1e-5, "m", True) for joint in JOINTS[1:])
    shifts = tuple(f"shift d of {joint}" for joint in (*JOINTS[:1], *JOINTS[2:4]))
    geometric = Finding("geometric", "found", 0.9999, 0.96, (0.95, 0.97), parameters=axes, unseen=shifts)
    inside = Finding(
        "joint_offset",
        "contained",
        0.9999,
        0.0,
        (0.0, 0.0),
        confounded_with=("geometric",),
        parameters=zeros,
        unseen=(f"zero offset, {JOINTS[0]}", f"zero offset, {JOINTS[5]}"),
    )
    return replace(
        base,
        summary="Geometry explains the gap.",
        effects=(geometric, inside, *NOT_FOUND[1:2], *NOT_TESTABLE),
        verdict=("geometric",),
        separates=(),
    )


def repeated():
    """Two poses and a path that were repeated, with everything that can be told of them."""
    base, three = confounded(), (1e-4, -2e-4, 3e-4)
    first = PoseCriteria(
        "P1",
        30,
        3,
        Repeatability(8e-5, (7e-5, 1e-4), three),
        Accuracy(7.01e-4, (7.01e-4, 0.0, 0.0), three),
        Accuracy(4e-5, (0.0, 0.0, 4e-5), three),
        Variation(9e-5, (1e-4, 2e-4, 3e-4)),
        (10, 10, 10),
        Drift(3e-5, 1e-5, 5e-5, (1e-4, 2e-4, 3e-4), (1e-5, 2e-5, 3e-5)),
        (10, 20),
    )
    second = PoseCriteria(
        "P2", 25, 1, Repeatability(1.1e-4), Accuracy(3e-4, (0.0, 3e-4, 0.0)), Accuracy(6.2e-5, (0.0, 6.2e-5, 0.0))
    )
    seam = PathCriteria("seam", 20, 10, AlongPath(2e-4, three), AlongPath(1.5e-3, three), AlongPath(2.5e-4, three))
    poses, notes = (first, second), ("Fewer cycles than the standard's 30: 1 of 2 poses.",)
    criteria = Performance(base.campaign, base.robot, base.tool_frame, poses, (seam,), ("base", "tool"), 4e-5, notes)
    return replace(base, performance=criteria)


CASES = {
    "found": found,
    "nothing": nothing,
    "unexplained": unexplained,
    "confounded": confounded,
    "contained": contained,
    "repeated": repeated,
}


@pytest.fixture(params=list(CASES))
def diagnosis(request):
    """Each kind in turn."""
    return CASES[request.param]()


@pytest.fixture
def case():
    """Make the diagnosis of a kind."""
    return lambda kind: CASES[kind]()


@pytest.fixture
def law_case():
    """Make the diagnosis that holds a law."""
    return with_law


@pytest.fixture(scope="session")
def drifted(rv_m2):
    """A real diagnosis: the base has drifted."""
    return diagnose(simulate(rv_m2, ["drift"], seed=3)[0])


@pytest.fixture
def make_rows():
    """Make measurements."""
    return rows


@pytest.fixture(scope="session")
def written():
    """Write the page or fragment of a kind, once for all tests."""
    return lru_cache(lambda write, kind: write(CASES[kind]()))
