"""Semi-synthetic cases: real campaigns with a fault added or a column withheld.

Every campaign of the folder is asked about untouched first (the **control**), then with one condition changed. A real
arm has a wrong geometry and a remainder that nothing explains before anything is put in; what is right is therefore
measured against the control on the same rows, and said here for each question. ``said`` is the diagnosis, ``fresh``
what its model reaches on rows of the same campaign that it did not see, whose measured positions hold the noise.

========================= ==================================================================================
nothing                   ``geometric`` is in the verdict, and on fresh rows no more than 1.1 times the remainder is
                          left that the campaign's own README reports for a full geometry
offset, scale             ``geometric``, which contains both exactly, or the cause itself is in the verdict, and what is
                          left on fresh rows is less than 1.1 times that of the control
backlash                  ``backlash`` is found, its first place is the joint, its lost motion there within 30 %
slip                      flagged as unexplained, with the joint as the first place and time or order as the first
                          quantity; or one discovered law has both
temperature               ``thermal_elongation`` is in the verdict and found
hidden                    flagged as unexplained, ``thermal_elongation`` is not testable and asks for ``temperature``,
                          and the first quantity (or a discovered law's) is time or order, which the temperature
                          follows. The first two alone the control would pass as well
later                     the first 70 % by time are diagnosed: on the rest the model leaves between 0.5 and 1.25 times
                          the held-out rms that the diagnosis claims
========================= ==================================================================================

Commands are changed, never the robot: where the robot stood when it was measured, it still stands, and the table says
something else. Only a scale and the growth of links change what was measured, orientations nothing. A slip, an offset
or lost motion sits in one of the joints 2 .. n−2: the frames would take in that of the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, read_campaign, write_campaign, write_table
from thermal_robot.inference.algebra import equations_of, orthonormal, rms, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.grouping import in_order
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import Displacement, tool_poses
from thermal_robot.observations import Observations, observe
from thermal_robot.percents import percent

_STILL = 1e-4  # rad: a joint that is told to move less does not arrive from any side


def with_joint_error(campaign: Campaign, joint: int, error: Array | float) -> Campaign:
    """Campaign with a joint error put in by changing the commands: actual position = command in the table + error.

    A scalar or (N,), rad: a constant is a zero offset, a step a slip, −½ b·approach lost motion.
    """
    q = campaign.q.copy()
    q[:, joint] -= error
    return replace(campaign, q=q)


def with_approaches(campaign: Campaign) -> Campaign:
    """Campaign with directions of approach, derived from the order of measurement.

    The sign of the change of the command since the row before; 0 in the first row and where the joint stayed. Where
    only some rows of a campaign are taken this is a side as good as any: what is put in follows it.
    """
    change = np.diff(campaign.q, axis=0, prepend=campaign.q[:1])
    side = np.sign(change) * (np.abs(change) > _STILL)
    columns = {f"approach.{joint}": side[:, j] for j, joint in enumerate(campaign.robot.joint_names)}
    return replace(campaign, covariates={**campaign.covariates, **columns})


def with_growth(campaign: Campaign, strains: Array, warmer: Array) -> Campaign:
    """Campaign with positions shifted as by thermal elongation of the links, and without temperature columns.

    ``strains`` (S,), 1/K, of the nominal segments; ``warmer`` (N,), K above the temperature of the URDF's lengths.
    """
    robot, frames = campaign.robot, seen_in_position(campaign).frames
    along = np.array([np.append(s.direction * s.length, np.zeros(3)) for s in robot.segments])
    grown = Displacement(segment=warmer[:, None, None] * strains[:, None] * along)
    # the growth of a segment turns nothing: the tool frame's origin and the target move alike
    moved = tool_poses(robot, campaign.q, grown)[:, :3, 3] - tool_poses(robot, campaign.q)[:, :3, 3]
    turned = moved @ frames.base[:3, :3].T
    known = {name: v for name, v in campaign.covariates.items() if name.split(".")[0] != "temperature"}
    return replace(campaign, position=measured(campaign) + turned, covariates=known)


def warm_up(rng: np.random.Generator, samples: int) -> Array:
    """Draw a temperature rise (N,), K: first-order warm-up, a break, and warm-up again, to a maximum of 10 to 20 K."""
    passed = np.linspace(0.0, 1.0, samples)
    start, end = rng.uniform(0.35, 0.45), rng.uniform(0.55, 0.65)
    slow = rng.uniform(0.1, 0.25)
    step = 1.0 / (samples - 1)
    warm = np.zeros(samples)
    for k in range(1, samples):
        goal = 0.0 if start < passed[k] < end else 1.0
        warm[k] = warm[k - 1] + (goal - warm[k - 1]) * (1.0 - np.exp(-step / slow))
    return np.asarray(rng.uniform(10.0, 20.0) * warm / warm.max())


def seen_in_position(campaign: Campaign) -> Observations:
    """Observations of the positions alone, base and target registered to the nominal robot by least squares."""
    alone = replace(campaign, orientation=None)
    return observe(alone, register(alone, np.ones(campaign.samples, dtype=bool)))


def leaves(seen: Observations, shift: Array) -> float:
    """Rms distance, m, of (N, 3) shifts in the root frame, after least-squares alignment of the unknown frames."""
    frames = orthonormal(equations_of(frame_columns(seen)[0]))
    return rms(without(shift.ravel(), frames).reshape(shift.shape))


def measured(campaign: Campaign) -> Array:
    """Measured positions (N, 3), m, of a campaign that has them."""
    return np.asarray(campaign.position)


Record = dict[str, Any]

WORSE = 1.1  # an absorbed cause may leave so many times what the control leaves
SIZE = 0.3  # relative error of a lost motion
CLAIM = (0.5, 1.25)  # rms reached over rms claimed


def judged(fault: str, record: Record, control: Record | None, remainder: float) -> tuple[bool, str]:
    """Whether the diagnosis is right by the rule of its fault (module's table), and the answer in short words.

    The remainder is what a full geometry leaves of the campaign, rms distance, m. No diagnosis is wrong.
    """
    said = record.get("said")
    if said is None:
        return False, str(record.get("error") or "no diagnosis")
    after, before = (((of or {}).get("fresh") or {}).get("rms_after") for of in (record, control))
    if fault == "backlash":
        right, more = _backlash(said, record["truth"])
    elif fault == "slip":
        right, more = _unexplained(said, record["truth"], "joint")
    elif fault == "hidden":
        right, more = _unexplained(said, record["truth"], "")
        asks = _finding(said, "thermal_elongation")
        right = right and asks.get("status") == "not_testable" and "temperature" in asks.get("needs", ())
        more += f"; thermal_elongation {asks.get('status', 'is no candidate')}"
    elif fault == "temperature":
        right, more = _names(said, "thermal_elongation"), ""
    elif after is None:
        right, more = False, "nothing predicted"
    elif fault == "later":
        claimed = said["gap"]["held_out"]["rms_after"]
        right = CLAIM[0] <= after / claimed <= CLAIM[1]
        more = f"claims {1e3 * claimed:.3f} mm, reaches {1e3 * after:.3f} mm"
    elif fault == "nothing":
        right = _names(said, "geometric") and after <= WORSE * remainder
        more = f"leaves {1e3 * after:.3f} mm, README {1e3 * remainder:.3f} mm"
    else:
        cause = {"offset": "joint_offset", "scale": "instrument_scale"}[fault]
        covered = _names(said, "geometric") or _names(said, cause)
        right = covered and before is not None and after < WORSE * before
        than = "no control" if before is None else f"control {1e3 * before:.3f} mm"
        more = f"leaves {1e3 * after:.3f} mm, {than}"
    named = " ".join(said["verdict"]["effects"]) or "no effect"
    return bool(right), f"{named}; {more}" if more else named


def _finding(said: Record, effect: str) -> Record:
    return next((e for e in said["effects"] if e["name"] == effect), {})


def _names(said: Record, effect: str) -> bool:
    return effect in said["verdict"]["effects"] and _finding(said, effect).get("status") == "found"


def _backlash(said: Record, truth: Record) -> tuple[bool, str]:
    part = truth["parts"]["backlash"]
    joint, size = part["places"][0]["name"], part["size"]
    found = _finding(said, "backlash")
    first = found["locations"][0]["name"] if found.get("locations") else "nowhere"
    values = [p["value"] for p in found.get("parameters", ()) if p["name"] == f"lost motion, {joint}"]
    value = values[0] if values and values[0] is not None else 0.0
    right = _names(said, "backlash") and first == joint and abs(value - size) <= SIZE * size
    return right, f"backlash first at {first}, {1e3 * value:.2g} mrad at {joint}"


def _unexplained(said: Record, truth: Record, kind: str) -> tuple[bool, str]:
    """Whether a residual is flagged, and it or one law has a true first quantity and, if a kind is given, place.

    Also returns place and quantity in words.
    """
    left = said["unexplained"]
    places = {(p["kind"], p["name"]) for p in truth["places"]}
    first = left["locations"][:1], [d["covariate"] for d in left["depends_on"][:1]]
    laws = [(e["locations"][:1], [e.get("quantity")]) for e in said["effects"] if e["name"].startswith("discovered.")]

    def holds(where: list[Record], quantity: list[Any]) -> bool:
        there = not kind or any((p["kind"], p["name"]) in places for p in where)
        return there and any(q in truth["quantities"] for q in quantity)

    flagged = bool(said["verdict"]["unexplained"])
    hit = [law for law in (*laws, first) if holds(*law)]
    where, quantity = hit[0] if hit else first
    shown = f"{where[0]['name'] if where else 'nowhere'}, {quantity[0] if quantity else 'nothing'}"
    return flagged and bool(hit), f"{'unexplained' if flagged else 'not flagged'}: {shown}"


Fault = Literal["nothing", "offset", "scale", "backlash", "slip", "temperature", "hidden", "later"]
Answers = dict[str, Any]

REMAINDERS = {"ur5_jacobi": 0.113e-3, "wam_jacobi": 2.567e-3, "ipa_ur10_a": 0.436e-3, "ipa_ur10_b": 0.421e-3}
"""Campaigns, with the rms distance (m) that a full geometry leaves on random held-out rows, as their READMEs say."""

_STIFF = tuple(name for name in REMAINDERS if name != "wam_jacobi")
"""The WAM's cables leave ten times what its links could grow."""
_ROWS = (600, 1200)
_SPELLS = 20  # of equal length: a fifth of them is kept from the diagnosis
_EARLY = 0.7


@dataclass(frozen=True)
class RealCase:
    """Real campaign with an added fault; its ``id`` names its folder and gives nothing away.

    Attributes
    ----------
    seed, draw
        Of the trial: the rows of a campaign are the same in all its cases. Number of the draw of joint and size.
    data, campaign, fault
        The folder of measured campaigns, which of them, and what is done to it.
    control
        ``id`` of the case with the same campaign untouched; ``None`` for that case itself.
    """

    id: str
    seed: int
    draw: int
    data: Path
    campaign: str
    fault: Fault
    control: str | None
    kind: Literal["real"] = "real"

    def make(self, folder: Path) -> Answers:
        """Write the campaign for the diagnosis, and return the truth.

        ``truth`` has a ``size`` (SI) in its parts; ``noise`` is what a full geometry leaves, per axis. Both (N, 3) m in
        the measurement frame or ``None``: ``fresh_position``, measured, and ``fresh_before``, predicted by the nominal
        robot in the frames that fit the diagnosed rows best.
        """
        # in the order of measurement, from here on
        whole = _drawn_rows(read_campaign(self.data / self.campaign), self.seed, self.campaign)
        rng = np.random.default_rng([self.seed, self.draw, 2])
        changed, truth, asked = _FAULTS[self.fault][2](whole, rng, REMAINDERS[self.campaign])
        fresh_rows = _kept(whole.samples, self.seed, self.campaign)
        if self.fault == "later":
            fresh_rows = np.arange(whole.samples) >= _EARLY * whole.samples
        if self.fault in ("slip", "hidden"):
            fresh_rows[:] = False  # what nobody can know need not be predicted
        given, fresh = changed.take(~fresh_rows), changed.take(fresh_rows)
        write_campaign(given, folder)
        answers: Answers = {
            "robot": self.campaign,
            "samples": given.samples,
            "measures": given.measures,
            "noise": REMAINDERS[self.campaign] / np.sqrt(3.0),
            "without": [],
            "hidden": truth["needs"],
            "truth": truth,
            "asked": f"{self.campaign}: {asked}",
            "fresh_position": None,
            "fresh_before": None,
        }
        if fresh.samples:
            write_table(replace(fresh, position=None, orientation=None), folder / "fresh.csv")
            alone = observe(fresh, seen_in_position(given).frames).predicted_position
            answers |= {"fresh_position": measured(fresh).tolist(), "fresh_before": alone.tolist()}
        return answers

    def judge(self, record: dict[str, Any], control: dict[str, Any] | None) -> dict[str, Any]:
        """Copy of a record with ``right`` and ``answer`` (:func:`judged`); ``control`` is the untouched campaign's."""
        right, answer = judged(self.fault, record, control, REMAINDERS[self.campaign])
        return {**record, "right": right, "answer": answer}


def real_cases(data: Path, seed: int, count: int | None = None) -> tuple[RealCase, ...]:
    """Draw the real cases of a trial in random order, each after its control; missing campaigns are left out.

    At most ``count``, controls included; about sixteen where absent.
    """
    present = [name for name in REMAINDERS if (data / name / "campaign.toml").is_file()]
    rng = np.random.default_rng([seed, 0])
    planned: list[tuple[Fault, str]] = []
    for fault, (times, campaigns, _) in _FAULTS.items():
        fit = [name for name in campaigns if name in present]
        planned += [(fault, str(name)) for name in rng.permutation(fit)[:times]]
    cases: list[RealCase] = []
    controls: dict[str, str] = {}
    for k in rng.permutation(len(planned)).tolist():
        fault, campaign = planned[k]
        wanted: list[tuple[Fault, str]] = [(fault, campaign)]
        if campaign not in controls:
            wanted.insert(0, ("nothing", campaign))
        if count is not None and len(cases) + len(wanted) > count:
            continue
        for what, which in wanted:
            number = len(cases) + 1
            name = f"r{number:03d}"
            cases.append(RealCase(name, seed, number, data, which, what, controls.get(which)))
            controls.setdefault(which, name)
    return tuple(cases)


def _drawn_rows(campaign: Campaign, seed: int, name: str) -> Campaign:
    """Take 600 to 1200 rows in order of measurement, every k-th from a random one on; all of a smaller campaign."""
    rows = in_order(campaign)
    rng = np.random.default_rng([seed, list(REMAINDERS).index(name), 1])
    size = int(rng.integers(*_ROWS))
    if campaign.samples > size:
        stride = int(rng.integers(1, campaign.samples // size + 1))
        start = int(rng.integers(0, campaign.samples - (size - 1) * stride))
        rows = rows[start :: max(stride, 1)][:size]
    return campaign.take(rows)


def _kept(samples: int, seed: int, name: str) -> NDArray[np.bool_]:
    """Draw the mask (N,) of rows held out from the diagnosis: four of twenty equal runs of consecutive rows."""
    rng = np.random.default_rng([seed, list(REMAINDERS).index(name), 3])
    spell = np.arange(samples) * _SPELLS // samples
    return np.isin(spell, rng.choice(_SPELLS, _SPELLS // 5, replace=False))


Made = tuple[Campaign, Answers, str]


def _truth(effect: str | None = None, ratio: float = 0.0, size: float = 0.0, joint: str = "") -> Answers:
    """Right answers to a case: the arm's geometric errors, and the added effect with ratio, size (SI) and joint."""
    places = [{"kind": "joint", "name": joint}] if joint else []
    parts = {effect: {"ratio": ratio, "main": True, "places": places, "size": size}} if effect else {}
    effects = ["geometric", *parts]
    nothing: Answers = {key: [] for key in ("places", "quantities", "needs", "outliers")}
    return {"effects": effects, "unlisted": None, "parts": parts, **nothing}


def _nothing(campaign: Campaign, rng: np.random.Generator, remainder: float, asked: str = "untouched") -> Made:
    return campaign, _truth(), asked


def _joint_fault(
    campaign: Campaign, rng: np.random.Generator, remainder: float, fault: Fault, leaving: tuple[float, float]
) -> Made:
    """Add an offset, backlash or a slip to an inner joint; its rms over the remainder is drawn between ``leaving``.

    Returns the campaign, the right answers, and the fault in words.
    """
    joint = int(rng.integers(1, campaign.robot.n - 2))
    name = campaign.robot.joint_names[joint]
    shape = np.ones(campaign.samples)
    share = float(rng.uniform(0.35, 0.65))
    if fault == "backlash":
        campaign = with_approaches(campaign)
        shape = -0.5 * campaign.covariates[f"approach.{name}"]
    elif fault == "slip":
        shape = (np.arange(campaign.samples) >= share * campaign.samples).astype(float)
    seen = seen_in_position(campaign)
    ratio = float(rng.uniform(*leaving))
    size = ratio * remainder / leaves(seen, seen.joint_sensitivity[:, :3, joint] * shape[:, None])
    if fault != "backlash":
        size *= rng.choice([-1.0, 1.0])
    changed = with_joint_error(campaign, joint, size * shape)
    if fault == "slip":
        truth = _truth("slip", ratio, size, name)
        truth |= {"effects": ["geometric"], "unlisted": "slip", "quantities": ["time", "order"]}
        truth["places"] = truth["parts"]["slip"]["places"]
        return changed, truth, f"{name} slips by {1e3 * size:.2g} mrad after {percent(share, 0)} of the rows"
    if fault == "backlash":
        return changed, _truth("backlash", ratio, size, name), f"{1e3 * size:.2g} mrad of lost motion in {name}"
    return changed, _truth("joint_offset", ratio, size, name), f"zero of {name} off by {1e3 * size:.2g} mrad"


def _scale(campaign: Campaign, rng: np.random.Generator, remainder: float, leaving: tuple[float, float]) -> Made:
    seen, ratio = seen_in_position(campaign), float(rng.uniform(*leaving))
    shift = measured(campaign) @ seen.frames.base[:3, :3]
    size = float(rng.choice([-1.0, 1.0])) * ratio * remainder / leaves(seen, shift)
    asked = f"instrument off by {1e6 * size:.0f} µm/m"
    changed = replace(campaign, position=measured(campaign) * (1.0 + size))
    return changed, _truth("instrument_scale", ratio, size), asked


def _growth(campaign: Campaign, rng: np.random.Generator, remainder: float, told: bool) -> Made:
    seen = seen_in_position(campaign)
    warmer = warm_up(rng, campaign.samples)
    strains = rng.uniform(1.2e-5, 2.3e-5, len(campaign.robot.segments))
    changed = with_growth(campaign, strains, warmer)
    shift = (measured(changed) - measured(campaign)) @ seen.frames.base[:3, :3]
    ratio, highest = leaves(seen, shift) / remainder, float(warmer.max())
    if told:
        recorded = {"temperature": campaign.reference_temperature + warmer}
        changed = replace(changed, covariates={**changed.covariates, **recorded})
    truth = _truth("thermal_elongation", ratio, highest)
    if not told:
        # how the temperature goes with time is all that the table can show of it
        truth |= {"quantities": ["time", "order"], "needs": ["temperature"]}
    return changed, truth, f"links grow by up to {highest:.0f} K, {'recorded' if told else 'temperature not recorded'}"


_FAULTS: dict[Fault, tuple[int, tuple[str, ...], Callable[[Campaign, np.random.Generator, float], Made]]] = {
    "nothing": (0, (), _nothing),
    "offset": (2, tuple(REMAINDERS), partial(_joint_fault, fault="offset", leaving=(3.0, 6.0))),
    "scale": (1, tuple(REMAINDERS), partial(_scale, leaving=(3.0, 6.0))),
    "backlash": (2, tuple(REMAINDERS), partial(_joint_fault, fault="backlash", leaving=(1.0, 3.0))),
    "slip": (2, tuple(REMAINDERS), partial(_joint_fault, fault="slip", leaving=(1.5, 4.0))),
    "temperature": (2, _STIFF, partial(_growth, told=True)),
    "hidden": (2, _STIFF, partial(_growth, told=False)),
    "later": (2, _STIFF, partial(_nothing, asked="first 70 % by time, rest predicted")),
}
"""Of each fault: how often and of which campaigns it is asked, and how it is put in; what it leaves after the best
frames is drawn between two multiples of the campaign's remainder."""
