"""Checks of the data before the diagnosis: rows to leave out, quantities of the wrong sign, and warnings at its end.

Rows were not executed as written where the pose of another command was measured: a robot that waits at a limit, a
program that is a line behind, an instrument that repeats its last reading. They carry no information on the robot. If
very many rows are shifted, the table was paired wrongly, which is a data fault.

An elastic joint yields to its load, lost motion stops short, a warm link grows: such parameters have one sign. They are
fitted once as if they could have either, beside all known effects. A quantity is read with the other sign where it
makes all of them that are beyond three sigma negative, and the best explanation with that quantity turned round leaves
clearly less than the best without. Where those that can tell disagree, nothing is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.campaign import GRAVITY, turned_round
from thermal_robot.campaign.plausible import copies, marks
from thermal_robot.campaign.table import listed_rows
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.data_faults import settings as faults
from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.find import spread
from thermal_robot.diagnosis.values import Refused, Sensitivity
from thermal_robot.effects import Effect, Parameter, choose, gate
from thermal_robot.errors import CampaignError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.exact import downweighted
from thermal_robot.inference.explain import Explanation, exclusive_settings, explain, log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import in_order
from thermal_robot.inference.problem import Linear, contained, gram
from thermal_robot.inference.registration import BaseAndTarget, register
from thermal_robot.inference.search import Search
from thermal_robot.inference.weights import Noise
from thermal_robot.kinematics import gravity_torques
from thermal_robot.observations import observe
from thermal_robot.percents import percent

Rows = NDArray[np.int64]
Flags = NDArray[np.bool_]
SAID = {
    "torque": "torque.* counts the load, not the motor: it is read with the other sign",
    "approach": "approach.* tells whence each joint came, not which way it went: it is read with the other sign",
    "temperature": "temperature falls where links grow: its differences from reference_temperature are read with the "
    "other sign",
    GRAVITY: "gravity points the other way than stated, as of an arm that hangs: it is read with the other sign; write "
    "it under [robot]",
}
"""Opening words of the note on a reversed quantity, by quantity."""
STRAIGHT = (
    "directions of approach that follow from the order of the rows have the wrong sign: where the robot does not go "
    'straight from the pose before to the next, write moves = "unknown" under [robot]'
)


def not_executed(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out rows whose measured pose is that of another row's command, with a sentence for each run of them."""
    if campaign.samples <= faults.DRAWN or campaign.position is None:
        return campaign, ()
    order = in_order(campaign)
    readings = Readings.of(campaign).take(order)
    frames = readings.take(spread(np.arange(len(order)))).align(coarse=True)
    near = max(float(np.median(readings.distance(frames))), faults.LEAST * readings.tolerance)
    far = readings.distance(frames) > faults.STRAY * near
    if not far.any():
        return campaign, ()
    out, notes = np.zeros(len(order), dtype=bool), []
    found = [*_frozen_runs(readings, far, near), *_lagging_runs(readings, far, near, frames)]
    for rows, words in sorted(found, key=lambda run: -len(run[0])):
        if not out[rows].any():
            out[rows] = True
            numbers = campaign.rows[order[rows]]
            named = f"row {numbers[0]} was" if len(rows) == 1 else f"rows {numbers[0]} to {numbers[-1]} were"
            before = int(campaign.rows[order[max(rows[0] - 1, 0)]])
            notes.append(f"{named} not executed as written: {words.format(before)}; left out of the fit")
    return campaign.take(np.sort(order[~out])) if notes else campaign, tuple(notes)


def _frozen_runs(readings: Readings, far: Flags, near: float) -> Iterator[tuple[Rows, str]]:
    """Yield runs in which the measured position stays the same while the commands change."""
    k, rows = 0, len(far)
    while k < rows - 1:
        away = np.linalg.norm(readings.position[k + 1 :] - readings.position[k], axis=1)
        stays = int(np.argmax(np.append(away > faults.SAME_PLACE * near, True)))
        run = np.arange(k if far[k] else k + 1, k + 1 + stays)
        if stays and far[run].all() and (not far[k] or len(run) >= settings.RUN):
            words = "one place was measured in all" if far[k] else "the robot stood still in the pose of row {}"
            yield run, words
        k += stays + 1


def _lagging_runs(readings: Readings, far: Flags, near: float, frames: BaseAndTarget) -> Iterator[tuple[Rows, str]]:
    """Yield short runs in which the measured pose belongs to the command of a row up to some rows away."""
    for by in (sign * k for k in range(1, faults.MOST_SHIFT + 1) for sign in (-1, 1)):
        own = np.clip(np.arange(len(far)) + by, 0, len(far) - 1)
        shifted = replace(readings, q=readings.q[own])
        fits = far & (shifted.distance(frames) <= faults.STRAY * near)
        ends = np.flatnonzero(np.diff(fits, prepend=False, append=False)).reshape(-1, 2)
        for first, last in ends:
            if settings.RUN <= last - first <= max(faults.MOST_BEHIND * len(far), settings.RUN):
                other = f"{abs(by)} row{'' if abs(by) == 1 else 's'} {'before' if by < 0 else 'later'}"
                yield np.arange(first, last), f"measured was the pose that is commanded {other}"


def usable(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out copied rows, marks of missing values, and orientations that the simulator lacks, with notes.

    :class:`CampaignError` where nothing was measured.
    """
    if not campaign.measured or not campaign.samples:
        raise CampaignError(campaign.name, "nothing was measured", expected="a campaign with measured positions")
    notes = []
    simulated = campaign.simulated_position is not None and campaign.simulated_orientation is None
    if campaign.orientation is not None and simulated:
        notes.append("orientation was measured, but sim.* predicts positions only: orientation is left out")
        campaign = replace(campaign, orientation=None, noise_orientation=None)
    notes += contradicted(campaign)
    again, (lost, _) = copies(campaign), marks(campaign)
    if again.any():
        rows, one = listed_rows(campaign.rows[again]), again.sum() == 1
        verb, these = ("repeats", "this copy is") if one else ("repeat", "these copies are")
        notes.append(f"{rows} {verb} another one to the last digit: {these} left out")
    if lost.any():
        rows = listed_rows(campaign.rows[lost])
        what = "a mark of a missing value, or a robot that stood still"
        notes.append(f"{rows} measured one place or figure to the last digit, {what}: they are left out")
    out = again | lost
    return campaign.take(~out) if out.any() else campaign, tuple(notes)


def counted(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out rows and columns that no diagnosis uses (:func:`usable`, :func:`not_executed`), with notes.

    Examples
    --------
    >>> import numpy as np
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> twice = campaign.take(np.r_[:campaign.samples, 5])
    >>> kept, notes = counted(twice)
    >>> kept.samples, notes
    (120, ('1 row (7) repeats another one to the last digit: this copy is left out',))
    """
    campaign, notes = usable(campaign)
    campaign, left = not_executed(campaign)
    return campaign, (*notes, *left)


def contradicted(campaign: Campaign) -> list[str]:
    """Warnings where encoder readings differ from the commands by more than ``CONTRADICTED``: a fault of the log."""
    found = []
    for j, name in enumerate(campaign.robot.joint_names):
        read = campaign.covariates.get(f"encoder.{name}")
        if read is None:
            continue
        away = read - campaign.q[:, j]
        middle = float(np.median(away))
        wrong = np.flatnonzero(np.abs(away - middle) > settings.CONTRADICTED)
        if len(wrong):
            first = int(campaign.rows[wrong[0]])
            found.append(
                f"encoder.{name} contradicts the commands in {len(wrong)} of {campaign.samples} rows, first in "
                f"row {first}, by up to {np.abs(away - middle).max():.2g}: that is a fault of the log, not of the robot"
            )
        elif abs(middle) > settings.CONTRADICTED:
            found.append(f"encoder.{name} is {middle:.3g} from the commands throughout: another zero, or another unit")
    return found


def with_corrected_signs(campaign: Campaign, own: Sequence[Effect] = ()) -> Campaign:
    """Reverse quantities that were recorded with the opposite sign, with a note; ``own`` are the user's effects."""
    tried: set[str] = set()
    while (quantity := _against(campaign, own, tried)) is not None:
        tried.add(quantity)
        derived = any(name.split(".")[0] == quantity for name in campaign.derived)
        said = STRAIGHT if derived else SAID[quantity]
        campaign = campaign if derived else turned_round(campaign, quantity)
        campaign = replace(campaign, warnings=(said, *campaign.warnings))
    return replace(campaign, warnings=(*campaign.warnings, *_against_gravity(campaign)))


def _against_gravity(campaign: Campaign) -> Iterator[str]:
    """Yield a note if reported torques correlate negatively with the holding torques of the URDF's masses."""
    robot = campaign.robot
    columns = {j: f"torque.{name}" for j, name in enumerate(robot.joint_names)}
    joints = [j for j, column in columns.items() if column in campaign.covariates]
    if not joints or not robot.has_masses:
        return
    payload = campaign.covariates.get("payload")
    holding = gravity_torques(robot, campaign.q, payload=payload, payload_com=campaign.payload_com)[:, joints]
    read = np.column_stack([campaign.covariates[columns[j]] for j in joints])
    one, other = (values - values.mean(axis=0) for values in (holding, read))
    alike = float((one * other).sum() / max(np.linalg.norm(one) * np.linalg.norm(other), settings.TINY))
    if alike < settings.AGAINST_GRAVITY:
        yield (
            f"torque.* goes against the torques that hold the URDF's masses (correlation {alike:.2f}): the sign of "
            "torque.* is reversed, or gravity points up"
        )


def _against(campaign: Campaign, own: Sequence[Effect], tried: set[str]) -> str | None:
    """Quantity, not yet ``tried``, whose reversal raises the evidence most; ``None`` where none raises it clearly."""
    linear, sides = _linear(campaign, own)
    if not any((names != "").any() for names in sides):
        return None
    blocks = linear.blocks
    either = tuple(replace(b, bare=tuple(replace(p, positive=False) for p in b.bare)) for b in blocks)
    families = [b.effect.name for b in blocks]
    free = explain(replace(linear, blocks=either), Noise.of(campaign), families=families)
    against = [q for q, z in _sign_scores(free, sides).items() if q not in tried and _agree(z)]
    if not against:
        return None
    read, clear = _keeping_signs(linear, free), {}
    weight = bool([*_against_gravity(campaign)])  # that the URDF's masses say so, too, is a witness
    for quantity in against:
        turned = (
            replace(b, source=b.columns * np.where(names == quantity, -1.0, 1.0))
            for b, names in zip(blocks, sides, strict=True)
        )
        best = _keeping_signs(replace(linear, blocks=tuple(turned)), free)
        less = best.noise < diagnosis_settings.LEAVES_LESS * read.noise or (quantity == "torque" and weight)
        if less and best.log_evidence - read.log_evidence > diagnosis_settings.INSISTS:
            clear[quantity] = best.log_evidence
    return max(clear, key=lambda q: clear[q], default=None)


def _linear(campaign: Campaign, own: Sequence[Effect]) -> tuple[Linear, list[NDArray[np.str_]]]:
    """Linear problem of all known effects at the nominal robot, and the quantity that gives each parameter its sign.

    The latter is the first quantity that is there, empty where a parameter may have either sign.
    """
    seen = observe(campaign, register(campaign))
    able = [effect for effect in choose((), (), own) if not gate.missing(effect, seen)]
    blocks = [block(seen, gate.variants(effect, seen)[0]) for effect in able]
    blocks = [item.held for item in blocks if len(item.sizes)]

    def quantity(effect: Effect, parameter: Parameter) -> str:
        there = {*campaign.covariates, GRAVITY}
        known = (q for q in effect.sided_by if q in there or f"{q}.{parameter.place}" in there)
        return next(known, "") if parameter.positive else ""

    sides = [np.array([quantity(item.effect, p) for p in item.bare]) for item in blocks]
    return Linear(seen.gap, frame_columns(seen)[0], tuple(blocks)), sides


def _sign_scores(free: Explanation, sides: Sequence[NDArray[np.str_]]) -> dict[str, Array]:
    """Z scores (value over standard deviation), by quantity, of the parameters whose sign that quantity decides."""
    votes: dict[str, list[float]] = {}
    for b, (values, covariance) in free.values.items():
        deviation = np.sqrt(np.maximum(np.diag(covariance), settings.TINY))
        for quantity, z in zip(sides[b].tolist(), (values / deviation).tolist(), strict=True):
            if quantity:
                votes.setdefault(quantity, []).append(z)
    return {quantity: np.array(own) for quantity, own in votes.items()}


def _agree(z: Array) -> bool:
    """Sign test: whether all significant z scores, or if none is significant their sum, are negative."""
    least = diagnosis_settings.WRONG_SIDE
    sure = z[np.abs(z) > least]
    return bool((sure < 0.0).all() if len(sure) else z.sum() < -least * np.sqrt(len(z)))


def _keeping_signs(linear: Linear, free: Explanation) -> Combination:
    """Likeliest combination of effects whose parameters keep their signs, by hill climbing; outliers down-weighted."""
    problem = gram(linear, replace(downweighted(free), smooth=None))
    effects = [item.effect for item in linear.blocks]
    apart = contained(problem) | exclusive_settings([effect.name for effect in effects])
    search = Search(problem, log_priors(effects), apart)
    return search.climb(free.best.blocks if search.allowed(free.best.blocks) else ())


def cautions(
    fitted: Fit,
    refused: Mapping[str, Refused] = MappingProxyType({}),
    sensitivity: Sensitivity | None = None,
) -> tuple[str, ...]:
    """Warnings, one sentence each, from the final fit, the refused effects and the sensitivity to priors."""
    notes = []
    campaign, e = fitted.campaign, fitted.explanation
    remains = float(e.whitening.noise[0] * e.best.noise)
    if campaign.noise_position is not None and remains < settings.STATED_TOO_LARGE * campaign.noise_position:
        times = campaign.noise_position / remains
        notes.append(f"the stated noise of position is {times:.1f} times what remains: it is stated too large")
    read = {column for effect, _ in fitted.effects for column in gate.reads(effect, fitted.nominal)}
    if read & set(campaign.derived):
        notes.append(
            "directions of approach were not recorded: they follow from the order of the rows, as of a robot that goes "
            'straight from pose to pose; if it does not, write moves = "unknown" under [robot]'
        )
    for name, why in refused.items():
        if why.share is not None:
            share = f" (share {percent(why.share)})" if why.share < 0.0 else ""
            notes.append(f"rows held out are predicted no better with {name}{share}: not reported as found")
    if sensitivity is not None:
        for probability, sizes in ((sensitivity.smaller, "a third of"), (sensitivity.larger, "three times")):
            if probability < settings.FRAGILE:
                said = f"with {sizes} the expected sizes of all effects this verdict would be improbable"
                notes.append(f"{said} ({probability:.0e})")
    return tuple(notes)
