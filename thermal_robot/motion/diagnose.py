"""One verb for motions: a log goes in, a diagnosis comes out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import did_you_mean
from thermal_robot.diagnosis.values import Dependence, Estimate, Finding, HeldOut, Location, Status, Unexplained
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.inference.algebra import total_probability
from thermal_robot.motion import settings
from thermal_robot.motion.effects import ABRUPT, SHARED_TITLES, SIMULATOR, TITLES, TORQUE_TITLES
from thermal_robot.motion.faults import find_faults
from thermal_robot.motion.fit import Point, fit, mean_squares
from thermal_robot.motion.following import parts
from thermal_robot.motion.log import MotionLog
from thermal_robot.motion.model import ServoModel
from thermal_robot.motion.refuse import explains_torques
from thermal_robot.motion.result import JointGap, MotionDiagnosis, rms
from thermal_robot.motion.select import Choice, searched, settled
from thermal_robot.motion.torque import TorqueModel

ALL = (*TITLES, *SHARED_TITLES, *TORQUE_TITLES)
_NEEDS = {"kp": "servo.kp", "droop": "a servo whose kp is not stated"}
_NEEDS |= dict.fromkeys(("payload", "contact"), "masses in the URDF") | dict.fromkeys((*TORQUE_TITLES, "masses"), "tau")


def diagnose_motion(
    log: MotionLog,
    *,
    only: Iterable[str] = (),
    without: Iterable[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> MotionDiagnosis:
    """System identification by model selection: which effects make the joints leave their command.

    Parameters
    ----------
    log
        Commands and encoders; see :func:`thermal_robot.read_motion`.
    only, without
        Names of effects to consider (all where empty), or to leave out.
    progress
        Called with a few words at each stage.

    Raises
    ------
    EffectError
        If an effect's name is not known.
    CampaignError
        If no joint of the log can be used.
    """
    only, without = tuple(only), tuple(without)
    for name in (*only, *without):
        if name not in ALL:
            raise EffectError(f"no effect of motions is called {name!r}{did_you_mean(name, ALL)}")
    kept = [name for name in ALL if name not in without and (not only or name in only)]
    progress("faults of the log")
    sound = find_faults(log)
    if not sound.joints:
        told = "; ".join(fault.told for fault in sound.faults)
        raise CampaignError(log.name, f"no joint of the log can be used: {told}", expected="a log without such faults")
    log = sound.log.with_joints(sound.joints)
    kind = TorqueModel if explains_torques(log) else ServoModel
    model = kind(log)
    allowed = model.of_effects((*kept, *SIMULATOR))
    found, refused, motions = searched(model, allowed, progress), dict[str, float](), log.motions
    # one kind at a time: another may only look bad for what a fit to the worst one has spoilt
    while worst := _gate(found.point, len(log.motions) // 2):
        progress("without the motions that nothing explains")
        refused |= worst
        motions = tuple(m for m in motions if (m.kind or m.name) not in refused)
        del model, found  # of a long log each is large; what was fitted to such motions is no place to start from
        model = kind(replace(log, motions=motions))
        found = searched(model, allowed, progress)
    choice = settled(found, allowed, progress)
    left_out = tuple(name for name in ALL if name not in kept)
    faults = tuple(fault.told for fault in sound.faults)
    return replace(_answer(choice, progress), refused=refused, left_out=left_out, faults=faults)


def _gate(point: Point, least: int) -> dict[str, float]:
    """Return the kind of motion whose rms residual over noise exceeds GATE times the kinds' median, with that ratio.

    The worst one, if any; figures are rms of all joints, each over its noise: of a joint that most motions hardly move
    those that do leave more. More than ``least`` motions must remain.
    """
    if parts(point.model.log) > 1:  # what one motion leaves has no others to be compared with
        return {}
    kinds = np.array([m.kind or m.name for m in point.model.log.motions])
    each = np.zeros((len(kinds), len(point.rows)))
    for j, (one, noise) in enumerate(zip(point.rows, point.noise, strict=True)):
        each[:, j] = mean_squares(one.residual / noise, one.motion, len(kinds))
    square = {kind: float(each[kinds == kind].mean()) for kind in dict.fromkeys(kinds.tolist())}
    usual, worst = float(np.median(list(square.values()))), max(square, key=square.__getitem__)
    far, remain = square[worst] > settings.GATE**2 * usual, int((kinds != worst).sum())
    return {worst: float(np.sqrt(square[worst] / usual))} if far and remain > least else {}


def _folds(choice: Choice, progress: Callable[[str], None]) -> list[Array]:
    """Cross-validation by motion: residual of each joint where its motion was held out, simulated from the command.

    An end stop, contact or limit that no other motion reaches stays as it was told.
    """
    model, found = choice.point.model, [one.residual.copy() for one in choice.point.rows]
    abrupt = model.of_effects(ABRUPT)
    for fold in range(settings.FOLDS if choice.active.any() else 0):
        progress(f"motions held out, part {fold + 1} of {settings.FOLDS}")
        held = np.arange(model.clusters) % settings.FOLDS == fold
        told = np.zeros(len(abrupt))
        for one in choice.point.rows:
            told[one.columns] += one.bread[~held].sum(axis=0) * model.sizes[one.columns] ** 2
        known = abrupt & (told < settings.SEEN)
        values = fit(model, choice.point.values, choice.active, ~held, known=known)
        for joint, left in enumerate(model.all_residuals(values)):
            out = held[choice.point.rows[joint].motion]
            found[joint][out] = left[out]
    return found


def _answer(choice: Choice, progress: Callable[[str], None], said: Unexplained | None = None) -> MotionDiagnosis:
    """Return the diagnosis of a choice; ``said`` is what stays of the gap, where it is of another choice than this."""
    point, model, log = choice.point, choice.point.model, choice.point.model.log
    before, held = model.all_residuals(np.zeros(len(model.parameters))), _folds(choice, progress)
    joints = {
        name: JointGap(rms(before[j]), rms(point.rows[j].residual), rms(held[j]), model.noise(j))
        for j, name in enumerate(log.joints)
    }
    weights = 1.0 / np.array([max(len(one), 1) for one in before])
    square, count = np.zeros((2, model.clusters)), model.clusters  # sums by motion, readings of each joint weighing one
    for row, left in zip(square, (before, held), strict=True):
        for j in model.joints:
            row += weights[j] * np.bincount(model.motion_of(j), left[j] ** 2, count)
    drawn = np.random.default_rng(settings.BOOTSTRAP_SEED).integers(0, count, (settings.BOOTSTRAPS, count))
    sums = np.stack([square.sum(axis=1), *square[:, drawn].sum(axis=2).T])  # of all motions, then of those drawn
    shrinkage, *others = 1.0 - sums[:, 1] / np.maximum(sums[:, 0], 1e-300)
    low, high = np.quantile(others, [0.025, 0.975]).tolist()
    total = np.sqrt(sums[0] / len(before)).tolist()
    held_out = HeldOut("motion", settings.FOLDS, total[0], total[1], float(shrinkage), (low, high))
    unexplained = replace(said, rms=rms(list(map(rms, before)))) if said else _unexplained(choice, 1.0 - shrinkage)
    if unexplained.flagged and shrinkage < settings.MOST and choice.own.effects & set(ALL):
        # an answer is what is told: of effects that explain less than what stays, nothing
        return _answer(choice.nothing, progress, unexplained)
    findings, shares = _findings(choice, before, weights)
    if said:
        findings = tuple(replace(one, probability=None) for one in findings)
    verdict = tuple(one.name for one in findings if one.status in ("found", "confounded"))
    alike = [w for one, w in choice.weights if not (one.effects ^ choice.own.effects) & set(ALL)]
    probability = 0.0 if said else total_probability(alike)
    values = {model.keys[p]: float(point.values[p]) for p in np.flatnonzero(choice.active)}
    curves = model.curves(point.values)
    return MotionDiagnosis(
        log, joints, held_out, findings, verdict, probability, unexplained, values, curves,
        warnings=(*log.notes, *_simulator(choice)), shares=shares, unit=model.unit, moves=model.moves(point.values),
    )  # fmt: skip


def _findings(choice: Choice, before: list[Array], weights: Array) -> tuple[tuple[Finding, ...], dict[str, float]]:
    """Return a finding for every effect, largest held-out share first, and the share of the squared gap by joint."""
    point, model, deviations = choice.point, choice.point.model, choice.own.deviations
    whole = sum(float(w * (one**2).sum()) for one, w in zip(before, weights, strict=True))
    scale = weights / max(whole, 1e-300)
    share = {b: (choice.fewer(b).left_out - choice.own.left_out) * scale for b in choice.own.own.tolist()}
    found = [_finding(choice, name, share, deviations) for name in ALL]
    found.sort(key=lambda one: (-(one.shrinkage or 0.0), one.status not in ("found", "confounded")))
    joints = {
        name: float(weights[j] * ((before[j] ** 2).sum() - (point.rows[j].residual ** 2).sum()) / max(whole, 1e-300))
        for j, name in enumerate(model.log.joints)
    }
    return tuple(found), joints


def _finding(choice: Choice, name: str, share: Mapping[int, Array], deviations: Array) -> Finding:
    """Return the finding of one effect; ``share`` has the rise of held-out loss (J,) without each parameter."""
    model = choice.point.model
    own = [p for p, one in enumerate(model.parameters) if one.effect == name]
    title = (TITLES | SHARED_TITLES | TORQUE_TITLES)[name]
    if not own:
        return Finding(name, "not_testable", title=title, needs=(_NEEDS.get(name, "cmd"),))
    active = [p for p in own if choice.active[p]]
    probability = max(choice.probability(p) for p in own)
    if not active:
        return Finding(name, "not_found", probability, 0.0, title=title)
    rivals = {model.parameters[k].effect for p in active for k in choice.alternatives(p)} & set(ALL) - {name}
    places, estimates = dict[str, float](), []
    for p, one, joint in ((p, model.parameters[p], model.joint_of(model.parameters[p])) for p in active):
        called = f"{one.label}, {joint}" if joint else one.label
        value = float(choice.point.values[p]) + (model.lowest if one.number == "contact" else 0.0)
        estimates.append(Estimate(called, value, float(deviations[p]), one.unit, True))
        if joint:
            places[joint] = places.get(joint, 0.0) + float(share[p].sum())
    status: Status = "confounded" if rivals else "found"
    total = float(sum(share[p].sum() for p in active))
    return Finding(
        name, status, probability, total, parameters=tuple(estimates), title=title,
        confounded_with=tuple(sorted(rivals)),
        locations=tuple(Location("joint", *one) for one in sorted(places.items(), key=lambda one: -one[1])),
    )  # fmt: skip


def _simulator(choice: Choice) -> list[str]:
    """Return sentences about the simulator that the log seems to come from, if any: its integrator, its friction."""
    told = {choice.point.model.parameters[p].effect: p for p in choice.own.own}
    value, error, found = choice.point.values, choice.own.deviations, []
    if (p := told.get("step")) is not None:
        step = f"{1e3 * value[p]:.2g} ± {1e3 * error[p]:.1g} ms"
        found.append(f"the log looks simulated by semi-implicit Euler in steps of {step}")
    if (p := told.get("creep")) is not None:
        share = f"{100.0 * value[p]:.2g} ± {100.0 * error[p]:.1g} %"
        found.append(f"joints that friction holds creep, as in a simulator whose friction is soft by {share}")
    return found


def _unexplained(choice: Choice, left: float) -> Unexplained:
    """Return what residuals leave above the noise: how much, and curves over position, velocity, load and time.

    Curves are cross-validated by motion; ``left`` is the share of the gap's mean square in motions held out.
    """
    model, rows = choice.point.model, choice.point.rows
    above = {j: rms(rows[j].residual) / max(model.noise(j), 1e-300) for j in model.joints}
    above = {j: times for j, times in above.items() if times >= settings.NOISY}
    if not above:
        return Unexplained(False, 0.0, 1.0)
    curves = [
        (_curve_gain(rows[j].residual, values, rows[j].motion), name, j)
        for j in above
        for name, values in model.quantities(j).items()
    ]
    curves = sorted((one for one in curves if one[0] > settings.STRUCTURE), reverse=True)
    worst = max(above, key=above.__getitem__)
    said = [f"{float(f'{above[worst]:.2g}'):g} times the noise of its readings stays in {model.log.joints[worst]}"]
    if left > 1.0 - settings.MOST:
        stays = f"{100.0 * left:.0f} %" if left < 1.0 else "all"
        said.insert(0, f"{stays} of the gap stays in motions held out, whatever is fitted")
    if curves:
        gain, name, joint = curves[0]
        said.append(f"{100.0 * gain:.0f} % of what remains in {model.log.joints[joint]} follows {name}")
    largest = {j: gain for gain, _, j in reversed(curves)} or {worst: 0.0}
    first = sorted(largest.items(), key=lambda one: -one[1])[:3]
    places = tuple(Location("joint", model.log.joints[j], gain) for j, gain in first)
    follows = tuple(Dependence(name, 0.0) for name in dict.fromkeys(name for _, name, _ in curves))
    return Unexplained(True, rms([rms(one.residual) for one in rows]), 0.0, tuple(said), places, follows)


def _curve_gain(left: Array, values: Array, motion: NDArray[np.int64]) -> float:
    """Share of a residual's squares that its means in ten quantile bins of a quantity explain, leaving motions out."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, settings.LEVELS + 1)[1:-1]))
    level = np.digitize(values, edges)
    count = 1 + int(motion.max(initial=0))
    sums, counts = (np.zeros((count, len(edges) + 1)) for _ in range(2))
    np.add.at(sums, (motion, level), left)
    np.add.at(counts, (motion, level), 1.0)
    rest = (sums.sum(axis=0) - sums) / np.maximum(counts.sum(axis=0) - counts, 1.0)
    return 1.0 - float(np.sum((left - rest[motion, level]) ** 2) / max(np.sum(left**2), 1e-300))
