"""Diagnoses made by hand, one of each kind that a report must be able to tell."""

from dataclasses import is_dataclass, replace

import numpy as np

from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import (
    Dependence,
    Estimate,
    Finding,
    FoldScheme,
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

JOINTS = tuple(f"{n}_joint" for n in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"))
LINKS = tuple(f"{n}_link" for n in ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"))


def changed(value, **fields):
    """A copy with other fields; a dict for a field that is a dataclass changes fields of it."""
    deep = {name: new for name, new in fields.items() if isinstance(new, dict) and is_dataclass(getattr(value, name))}
    return replace(value, **fields | {name: changed(getattr(value, name), **new) for name, new in deep.items()})


def case(kind, **fields):
    """The diagnosis of a kind, with other fields."""
    return changed(CASES[kind](), **fields)


def with_first(kind, **fields):
    """The diagnosis of a kind whose first effect is another, and the only one."""
    return case(kind, effects=(replace(CASES[kind]().effects[0], **fields),))


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
    numbers = np.arange(2, samples + 2)
    outliers = np.isin(numbers, aside)
    remainder = noise + 2e-3 * outliers[:, None]
    gap[outliers] += 2e-3
    if pose:
        turned = 4e-5 / np.sqrt(3.0) * rng.standard_normal((samples, 3))
        gap = np.hstack([gap, turned + 6e-4 * np.sin(q[:, :3])])
        remainder = np.hstack([remainder, turned])
    hidden = np.where(outliers, np.nan, 1.0)
    held = [factor * np.linalg.norm(of[:, :3], axis=1) * hidden for factor, of in ((1.0, gap), (1.06, remainder))]
    known, names = {"time": time, "temperature": temperature}, {"time": "s", "temperature": "°C"}
    units = names | dict.fromkeys(joints, "rad")
    return Rows(numbers, gap, remainder, outliers, position, q, known, *held, units)


NOT_FOUND = (
    Finding("joint_offset", "not_found", 0.02, 0.0012, (-0.004, 0.006)),
    Finding("drift", "not_found", 0.0004, -0.0003, (-0.002, 0.001)),
    Finding("geometric", "not_found", 1e-9, -0.031, (-0.06, 0.002)),
)
NOT_TESTABLE = (
    Finding("backlash", "not_testable", needs=tuple(f"approach.{j}" for j in JOINTS)),
    Finding("joint_compliance", "not_testable", needs=("torque.<joint>", "payload", "masses in the URDF")),
)
SCATTER = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
HARD = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 9.15e-5, 0.95, 1e-6)


def _found():
    """One effect, outliers, nothing left."""
    shares = (("upper_arm_link", 0.61), ("forearm_link", 0.33), ("wrist_1_link", 0.02))
    thermal = Finding(
        "thermal_elongation", "found", 0.9996, 0.962, (0.941, 0.974),
        locations=tuple(Location("link", link, share) for link, share in shares),
        parameters=(
            Estimate("strain per kelvin of upper_arm_link", 1.234e-5, 4.1e-7, "1/K", True),
            Estimate("strain per kelvin of forearm_link", 2.31e-5, 8.9e-7, "1/K", True),
            Estimate("strain per kelvin of wrist_2_link", None, None, "1/K", False),
        ),
    )  # fmt: skip
    held = HeldOut("blocked", 5, 4.15e-4, 3.05e-5, 0.9946, (0.9901, 0.9967), 4.52e-4, 1.82e-4)
    links = dict(zip(LINKS, (0.0, 0.004, 0.61, 0.33, 0.02, 0.0, 0.0), strict=True))
    return Diagnosis(
        campaign="hall_3_morning", robot="ur10", tool_frame="tool0", samples=120, measures="position",
        joint_names=JOINTS, outliers=(17, 80), gap=Gap(4.12e-4, 2.83e-5, 2.6e-5, "stated", held),
        effects=(thermal, *NOT_FOUND, *NOT_TESTABLE),
        where=Where(
            {"x": 0.35, "y": 0.2, "z": 0.45}, dict.fromkeys(JOINTS, 0.0), links, {"temperature": 0.81, "time": 0.74}
        ),
        unexplained=Unexplained(False, 0.0, 0.43), verdict=("thermal_elongation",), probability=0.978,
        summary="Thermal elongation of upper_arm_link and forearm_link explains the gap; it shrinks by "
        "99.5 % on rows that were not used for the fit.",
        advice="To tell thermal elongation from drift, measure again while the robot cools down.",
        separates=(("thermal_elongation", "drift"),), model=object(), rows=rows(aside=(17, 80)),
        warnings=("The temperature was read once for the whole robot; a link of its own would say more.",),
    )  # fmt: skip


def _nothing():
    """No gap beyond the noise."""
    held = HeldOut("random", 5, 2.72e-5, 2.72e-5, 0.0, (0.0, 0.0))
    return case(
        "found", campaign="", outliers=(), gap=Gap(2.71e-5, 2.71e-5, 2.6e-5, "repeats", held),
        effects=(*NOT_FOUND, *NOT_TESTABLE), where=Where({"x": 0.3, "y": 0.3, "z": 0.4}, {}, {}, {}), verdict=(),
        probability=0.93, summary="There is no gap beyond the noise.", advice="", separates=(),
        rows=rows(before=1e-9), warnings=(),
    )  # fmt: skip


def _unexplained():
    """An effect that nobody wrote down, in a joint, following time."""
    drawn = rows(aside=(17, 80))
    step = np.where(drawn.covariates["time"] > 4000.0, 9e-5, -4e-5)
    shifted = drawn.remainder + step[:, None] * np.array([0.2, -1.0, 0.6])
    hidden = 1.05 * np.linalg.norm(shifted, axis=1) * np.where(drawn.outliers, np.nan, 1.0)
    held = {"rms_after": 1.2e-4, "shrinkage": 0.91, "shrinkage_ci95": (0.87, 0.94)}
    reasons = ("The remainder is 4.1 times the noise floor.", "It changes with time more than chance allows.")
    places = (Location("joint", "elbow_joint", 0.72), Location("base", "base", 0.2))
    follows = (Dependence("time", 3.2e-9), Dependence("elbow_joint", 0.004))
    return case(
        "found", gap={"rms_after": 1.12e-4, "held_out": held},
        rows=replace(drawn, remainder=shifted, held_out_after=hidden),
        summary="Thermal elongation explains most of the gap; a remainder that follows time stays unexplained.",
        unexplained=Unexplained(True, 9.4e-5, 2.3e-14, reasons, places, follows),
    )  # fmt: skip


def _confounded():
    """Two effects that the data cannot tell apart, orientation measured, a long list of parameters."""
    offsets = [Estimate(f"zero offset, {j}", -1.2e-3 + 4e-4 * k, 2.2e-5, "rad", True) for k, j in enumerate(JOINTS)]
    geometric = []
    for j, link in enumerate(LINKS):
        for k in range(6):
            name = f"{'translation' if k < 3 else 'rotation'} {'xyz'[k % 3]} of {link}"
            size = (None, None) if k == 2 else (1e-5 * (k + 1) * (j + 1), 1e-5)
            geometric.append(Estimate(name, *size, "m" if k < 3 else "rad", k != 2))
    places = tuple(Location("link", link, 0.2 - 0.02 * j) for j, link in enumerate(LINKS))
    pan = (Location("joint", "shoulder_pan_joint", 0.24),)
    effects = (
        Finding("geometric", "found", 0.999999, 0.71, (0.66, 0.74), locations=places, parameters=tuple(geometric)),
        Finding(
            "joint_offset", "confounded", 0.97, 0.24, (0.2, 0.27), confounded_with=("base_frame",), locations=pan,
            parameters=tuple(offsets),
        ),
        Finding("base_frame", "confounded", 0.97, 0.0, (0.0, 0.0), confounded_with=("joint_offset",)),
    )  # fmt: skip
    return case(
        "found", measures="pose", summary="Geometry, and joint offsets or the base frame, explain the gap.",
        gap={
            "rms_before": 2.41e-3, "held_out": {"rms_before": 2.43e-3}, "orientation_before": 1.04e-3,
            "orientation_after": 4.2e-5,
        },
        effects=(*effects, *NOT_FOUND[1:2], *NOT_TESTABLE),
        where={"joints": dict(zip(JOINTS, (0.24, 0.1, 0.05, 0.01, 0.0, 0.0), strict=True))},
        verdict=("geometric", "joint_offset"), separates=(("joint_offset", "base_frame"),),
        rows=rows(aside=(17, 80), before=2.4e-3, pose=True),
    )  # fmt: skip


def _law():
    """A law found in the data, beside an effect of the library; what is left of it counts as unexplained."""
    law = Finding(
        "discovered.1", "found", 0.997, 0.08, (0.05, 0.1), locations=(Location("joint", "elbow_joint", 0.08),),
        parameters=(Estimate("step at 4000 s", 1.3e-4, 6e-6, "rad", True),), quantity="time", shape="step",
        describes="an error at elbow_joint that follows time (step)", size=(Size("step", 1.7e-4, 6e-6, "rad"),),
        usually="warming, or something that slips", title="a step at elbow_joint over time",
    )  # fmt: skip
    first, *rest = case("unexplained").effects
    return case("unexplained", effects=(first, law, *rest), verdict=("thermal_elongation", "discovered.1"))


def _contained():
    """Geometry, with the joints' zeros inside it."""
    zeros = tuple(Estimate(f"zero offset, {joint}", -7.1e-3, 2e-5, "rad", True) for joint in JOINTS[1:5])
    axes = tuple(Estimate(f"distance a of {joint}", 1e-4, 1e-5, "m", True) for joint in JOINTS[1:])
    shifts = tuple(f"shift d of {joint}" for joint in (*JOINTS[:1], *JOINTS[2:4]))
    unseen = (f"zero offset, {JOINTS[0]}", f"zero offset, {JOINTS[5]}")
    effects = (
        Finding("geometric", "found", 0.9999, 0.96, (0.95, 0.97), parameters=axes, unseen=shifts),
        Finding(
            "joint_offset", "contained", 0.9999, 0.0, (0.0, 0.0), confounded_with=("geometric",), parameters=zeros,
            unseen=unseen,
        ),
    )  # fmt: skip
    shown = {"effects": (*effects, *NOT_FOUND[1:2], *NOT_TESTABLE), "verdict": ("geometric",), "separates": ()}
    return case("found", summary="Geometry explains the gap.", **shown)


def _repeated():
    """Two poses and a path that were repeated, with everything that can be told of them."""
    base, three = case("confounded"), (1e-4, -2e-4, 3e-4)
    first = PoseCriteria(
        "P1", 30, 3, Repeatability(8e-5, (7e-5, 1e-4), three), Accuracy(7.01e-4, (7.01e-4, 0.0, 0.0), three),
        Accuracy(4e-5, (0.0, 0.0, 4e-5), three), Variation(9e-5, (1e-4, 2e-4, 3e-4)), (10, 10, 10),
        Drift(3e-5, 1e-5, 5e-5, (1e-4, 2e-4, 3e-4), (1e-5, 2e-5, 3e-5)), (10, 20),
    )  # fmt: skip
    accuracies = Accuracy(3e-4, (0.0, 3e-4, 0.0)), Accuracy(6.2e-5, (0.0, 6.2e-5, 0.0))
    poses = first, PoseCriteria("P2", 25, 1, Repeatability(1.1e-4), *accuracies)
    seam = PathCriteria("seam", 20, 10, AlongPath(2e-4, three), AlongPath(1.5e-3, three), AlongPath(2.5e-4, three))
    notes, names = ("Fewer cycles than the standard's 30: 1 of 2 poses.",), (base.campaign, base.robot, base.tool_frame)
    return replace(base, performance=Performance(*names, poses, (seam,), ("base", "tool"), 4e-5, notes))


CASES = {
    "found": _found, "nothing": _nothing, "unexplained": _unexplained, "confounded": _confounded,
    "contained": _contained, "repeated": _repeated, "law": _law,
}  # fmt: skip
