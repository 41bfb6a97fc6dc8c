"""The random effects: encoders that count in steps, and joints that no longer come back to the same place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from thermal_robot.diagnosis.parts import Estimate, Finding, Location, Status
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.explain import distance_limit
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.scatter import JointScatter, Scatter, enough_rows, joint_errors, variance_components

Array = NDArray[np.float64]

STEPS, WEAR = "encoder_resolution", "excess_repeatability"
_SAME = 1e-6  # rad or m: commands nearer than this repeat each other
_LEVEL = 1e-3
_MATERIAL_SCALE = 1.15  # a stated noise is no better known
_MATERIAL_SHARE = 0.15  # of a scatter that a smooth law must explain to make it none
_MOST_CELLS = 2_000_000
_REFUTED = 0.01  # p-value above which errors that could show their steps have none
_STEPPED = 0.4  # of the height that steps of the whole scatter would have, below which it is not made of steps
_SURE = 0.5
_ROUNDS = 3
_BAND = 1.35  # the step is looked for within this factor of what the scatter's size says


@dataclass(frozen=True, eq=False)
class RandomGap:
    """What is random in the gap beyond the instrument.

    Attributes
    ----------
    findings
        ``encoder_resolution`` and ``excess_repeatability``. Neither shrinks the gap: a mean cannot take scatter away.
    explains_size
        Whether there is scatter with which what remains is no larger than the noise allows; what is merely confounded
        does not count.
    p_value
        Of the χ² test of that.
    scatter
        The variances behind it.
    steps
        By joint: p-value that its errors do not follow steps of the command; only where that could be asked.
    laws
        By joint: the quantity that its errors follow, so that they are no scatter but what no known effect explains.
    note
        What limits the answer, one plain sentence; empty where nothing does.
    """

    findings: tuple[Finding, Finding]
    explains_size: bool
    p_value: float
    scatter: Scatter
    steps: Mapping[str, float]
    laws: Mapping[str, str]
    note: str = ""


def repeated_poses(fit: Fit) -> NDArray[np.int64]:
    """(N,) number of the commanded pose of each row: the same ``pose`` label, or without that column the same command.

    A row whose label is empty stands alone.
    """
    label = fit.campaign.labels.get("pose")
    if label is None:
        same = np.round(fit.campaign.q / _SAME).astype(np.int64)
        return np.asarray(np.unique(same, axis=0, return_inverse=True)[1]).ravel()
    number = np.unique(label, return_inverse=True)[1].ravel()
    empty = label == ""
    number[empty] = number.max() + 1 + np.arange(int(empty.sum()))
    return np.asarray(number)


def random_gap(fit: Fit) -> RandomGap:
    """Say which joints scatter beyond the instrument, anew at each visit or once a pose.

    What a systematic effect leaves may look like scatter of a joint. Errors of a joint that follow a smooth law of a
    recorded quantity are none. Those of an encoder are a sawtooth of the command with a period of √12 of their
    standard deviation. Where repeats do not tell pose from visit, that period does: without it scatter may be wear.

    Parameters
    ----------
    fit
        Frames and systematic effects, fitted.

    Returns
    -------
    RandomGap
        Without repeats the two kinds are one: ``encoder_resolution`` is found where its steps are seen, otherwise
        confounded with ``excess_repeatability``, which is then not testable.
    """
    e, observed = fit.explanation, fit.corrected
    gap, sensitivity = observed.gap, observed.joint_sensitivity
    m = gap.shape[1]
    given = (fit.campaign.noise_position, fit.campaign.noise_orientation)[: m // 3]
    noise = np.repeat([g or e.whitening.noise[3 * k] for k, g in enumerate(given)], 3)
    pose, held = repeated_poses(fit), [bool(g) for g in given]
    asked = np.isin(np.arange(len(gap)), enough_rows(pose, ~e.outliers)) | e.outliers
    used = asked & ~e.outliers
    freedom = round(e.best.effective) + e.linear.frames.shape[2]
    for _ in range(_ROUNDS):
        scatter = variance_components(
            gap, sensitivity, noise, pose, stated=held, freedom=freedom, weights=used.astype(float)
        )
        if not any(c.chosen for c in scatter.components):
            break
        gap = _refitted(fit, scatter, used)
        # rows set aside as gross errors may be no more than this scatter
        within = _distance2(scatter, gap, sensitivity, scatter.noise) <= distance_limit(m, len(gap))
        if 2 * within.sum() < len(within):
            break  # most rows lie beyond any scatter: robot and table do not belong together
        used = within & asked
    laws, steps, kept = _judge(fit, scatter, gap[used], pose, used, noise)
    findings = (_finding(fit, scatter, STEPS, "pose", kept), _finding(fit, scatter, WEAR, "visit", kept))
    p_value, explains = _size(scatter, kept, gap[used], sensitivity[used], noise, held, freedom)
    return RandomGap(findings, explains, p_value, scatter, steps, laws, _note(scatter, laws, kept))


def _refitted(fit: Fit, scatter: Scatter, used: NDArray[np.bool_]) -> Array:
    """(N, m) remainder once frames and explanation are fitted in the covariance of the scatter.

    Generalised least squares. Fitted as if the noise were the instrument's, a joint that scatters pulls the frames by
    far more than the instrument's noise, and what they are off by would count as scatter of everything else.
    """
    e = fit.explanation
    blocks = [e.linear.blocks[b].columns * e.linear.blocks[b].sizes for b in e.best.blocks]
    design = np.concatenate([e.linear.frames, *blocks], axis=2)
    gap = fit.corrected.gap
    if not design.shape[2]:
        return gap
    root = np.linalg.cholesky(scatter.covariance(fit.corrected.joint_sensitivity[used]))
    white = np.linalg.solve(root, design[used]).reshape(-1, design.shape[2])
    length = np.linalg.norm(white, axis=0) + 1e-300
    step = np.linalg.lstsq(white / length, np.linalg.solve(root, gap[used, :, None]).ravel(), rcond=1e-5)[0]
    return np.asarray(gap - design @ (step / length))


def _distance2(scatter: Scatter, gap: Array, sensitivity: Array, noise: Array) -> Array:
    solved = np.linalg.solve(scatter.covariance(sensitivity, noise), gap[:, :, None])[:, :, 0]
    return np.asarray((solved * gap).sum(axis=1))


@dataclass(frozen=True)
class _Kept:
    """A component that is scatter: its step where it is an encoder's, and whether it might be wear as well."""

    component: JointScatter
    step: float
    doubtful: bool


@dataclass(frozen=True, eq=False)
class _Mean:
    """Weighted mean of each pose."""

    number: NDArray[np.int64]
    weight: Array

    @property
    def total(self) -> Array:
        return np.bincount(self.number, self.weight).astype(float)

    def __call__(self, values: Array) -> Array:
        sums = np.zeros((len(self.total), *values.shape[1:]))
        np.add.at(sums, self.number, (self.weight * values.T).T)
        return np.asarray((sums.T / self.total).T)


def _judge(
    fit: Fit, scatter: Scatter, gap: Array, pose: NDArray[np.int64], used: NDArray[np.bool_], noise: Array
) -> tuple[dict[str, str], dict[str, float], list[_Kept]]:
    """Tell scatter from laws, and steps from scatter."""
    names, sensitivity = fit.campaign.robot.joint_names, fit.corrected.joint_sensitivity
    recorded = {name: values[used] for name, values in quantities(fit.corrected).items()}
    number = np.unique(pose[used], return_inverse=True)[1].ravel()
    laws: dict[str, str] = {}
    steps: dict[str, float] = {}
    kept: list[_Kept] = []
    for c in (c for c in scatter.components if c.chosen):
        if c.kind == "visit":
            errors, spread = joint_errors(scatter, gap, sensitivity[used], c.joint)
            weight = 1.0 / (spread**2 + c.sigma**2)
            mean = _Mean(number, weight)
            common, counts = mean(errors)[number], np.bincount(number)[number] > 1
            errors, weight = (errors - common)[counts], weight[counts]
            law = _law(errors, weight, {name: (v - mean(v)[number])[counts] for name, v in recorded.items()})
        else:
            mean = _Mean(number, np.ones(len(number)))
            errors, variance = _pose_errors(scatter, gap, sensitivity[used], mean, c.joint, noise)
            weight, command = 1.0 / (variance + c.sigma**2), mean(fit.campaign.q[used, c.joint])
            law = _law(errors, weight, {name: mean(v) for name, v in recorded.items()})
        if law:
            laws[names[c.joint]] = law
            continue
        step, p, seen = np.sqrt(12.0) * c.sigma, None, False
        if c.kind == "pose":
            step, p, seen = _period(errors, weight, command, step)
        if p is not None:
            steps[names[c.joint]] = p
        if seen and p is not None and p > _REFUTED:
            continue  # what differs from pose to pose without steps is no encoder's
        doubtful = len(scatter.kinds) == 1 and (p is None or p > _LEVEL)
        kept.append(_Kept(c, float(step), doubtful))
    return laws, steps, kept


def _pose_errors(
    scatter: Scatter, gap: Array, sensitivity: Array, mean: _Mean, joint: int, noise: Array
) -> tuple[Array, Array]:
    """(poses,) error of one joint in the mean of each pose's k visits, and its variance from everything else.

    What comes anew at each visit averages out, what a pose brings does not: with N of the noise and N₀ of what visits
    have in common from no joint, the mean has the covariance (N + J Λ_v Jᵀ)/k + N₀ + J Λ_u Jᵀ (Searle, Casella,
    McCulloch, *Variance Components*, 1992, ch. 3).
    """
    gap, sensitivity, visits = mean(gap), mean(sensitivity), mean.total
    errors, variance = np.zeros(len(visits)), np.zeros(len(visits))
    for k in np.unique(visits):
        own = visits == k
        parts = [replace(c, sigma=c.sigma / np.sqrt(k)) if c.kind == "visit" else c for c in scatter.components]
        rest = np.sqrt(scatter.noise**2 / k + (scatter.common * noise) ** 2)
        averaged = replace(scatter, components=tuple(parts), noise=rest)
        errors[own], spread = joint_errors(averaged, gap[own], sensitivity[own], joint)
        anew = sum(c.sigma**2 for c in parts if c.chosen and (c.kind, c.joint) == ("visit", joint))
        variance[own] = spread**2 + anew
    return errors, variance


def _law(errors: Array, weight: Array, recorded: Mapping[str, Array]) -> str:
    """Name the quantity that errors follow smoothly, or nothing: F tests, counted."""
    best, follows = _LEVEL, ""
    root = np.sqrt(weight)
    for name, values in recorded.items():
        columns = smooth_columns(values) if np.ptp(values) > 1e-9 else np.zeros((len(values), 0))
        k, freedom = columns.shape[1], len(errors) - columns.shape[1] - 1
        if not k or freedom < 5:
            continue
        constant, target = root / np.linalg.norm(root), errors * root
        target = target - constant * (constant @ target)
        columns = columns * root[:, None]
        basis = np.linalg.qr(columns - np.outer(constant, constant @ columns))[0]
        total, gained = float(target @ target), float(((basis.T @ target) ** 2).sum())
        rest = max(total - gained, 1e-300)
        p = float(fdtrc(k, freedom, (gained / k) / (rest / freedom))) * len(recorded)
        share = 1.0 - (rest / freedom) / (total / (len(errors) - 1))
        if p < best and share > _MATERIAL_SHARE:
            best, follows = p, name
    return follows


def _period(errors: Array, weight: Array, command: Array, step: float) -> tuple[float, float | None, bool]:
    """Return the step that errors repeat with, the p-value of there being none, and whether it would have been seen.

    Periodogram over all steps near the one that the scatter's size says (Scargle 1982): at a frequency that is not
    the error's its height is exponential. ``None`` where there are too many to search.
    """
    from scipy.fft import next_fast_len, rfft

    highest = _BAND / step
    cell = 0.1 / highest  # rounding the command to it costs 3 % of the height
    place = np.round((command - command.min()) / cell).astype(np.int64)
    if place.max() > _MOST_CELLS:
        return step, None, False
    size = weight * (errors - float(weight @ errors / weight.sum()))
    length = int(next_fast_len(2 * int(place.max()) + 2, real=True))
    frequency = np.arange(length // 2 + 1) / (length * cell)
    power = np.abs(rfft(np.bincount(place, size, length))) ** 2 / float((size**2).sum())
    near = (frequency > highest / _BAND**2) & (frequency < highest)
    if not near.any():
        return step, None, False
    best = int(np.argmax(np.where(near, power, -1.0)))
    tried = int(near.sum())
    p = float(-np.expm1(tried * np.log1p(-np.exp(-power[best]))))
    # the first harmonic holds 6/π² of a sawtooth's power; the root of a height is normal with variance 1/2
    expected = 0.3 * float((weight * step**2 / 12.0).sum())
    seen = np.sqrt(expected) > np.sqrt(np.log(tried) - np.log(_REFUTED)) + 1.6
    if power[best] < _STEPPED * expected:
        p = 1.0 if seen else p  # a ripple on errors of another kind
    return (float(1.0 / frequency[best]) if p < _LEVEL else step), p, bool(seen)


def _finding(fit: Fit, scatter: Scatter, name: str, kind: str, kept: list[_Kept]) -> Finding:
    if kind == "visit" and "visit" not in scatter.kinds:
        return Finding(name, "not_testable", needs=("pose",))
    own, probability = [k for k in kept if k.component.kind == kind], scatter.probability.get(kind, 0.0)
    if probability < _SURE:
        return Finding(name, "not_found", probability, 0.0, (0.0, 0.0))
    if not own:
        # what follows a law, or has no steps, is not this effect
        return Finding(name, "not_found", 0.0 if scatter.chosen(kind) else probability, 0.0, (0.0, 0.0))
    names, lever = fit.campaign.robot.joint_names, fit.corrected.joint_sensitivity[:, :3]
    moved = np.array([k.component.sigma**2 * (lever[:, :, k.component.joint] ** 2).mean() for k in own])
    order = np.argsort(-moved)
    doubtful = all(k.doubtful for k in own)
    status: Status = "confounded" if doubtful else "found"
    return Finding(
        name,
        status,
        probability,
        0.0,
        (0.0, 0.0),
        confounded_with=(WEAR,) if doubtful else (),
        locations=tuple(Location("joint", names[own[k].component.joint], float(moved[k] / moved.sum())) for k in order),
        parameters=tuple(_estimate(fit, own[k], kind) for k in order),
    )


def _estimate(fit: Fit, kept: _Kept, kind: str) -> Estimate:
    c, joint = kept.component, fit.campaign.robot.joint_names[kept.component.joint]
    unit = "m" if fit.campaign.robot.joint_types[c.joint] == "prismatic" else "rad"
    width = (c.upper - c.lower) / (2.0 * 1.96)
    if kind == "visit":
        return Estimate(f"standard deviation, {joint}", c.sigma, width, unit, True)
    return Estimate(f"step, {joint}", kept.step, np.sqrt(12.0) * width, unit, True)


def _size(
    scatter: Scatter,
    kept: list[_Kept],
    gap: Array,
    sensitivity: Array,
    noise: Array,
    held: list[bool],
    freedom: int,
) -> tuple[float, bool]:
    """χ² of what remains in the rows' whole covariance; its freedom is reduced by the tails."""
    parts = np.repeat(held, 3)
    # what may as well be a systematic effect that is not known must not explain the size away
    real = tuple(k.component for k in kept) if any(not k.doubtful for k in kept) else ()
    known = Scatter(scatter.kinds, real, scatter.probability, np.where(parts, noise, scatter.noise))
    distance2 = _distance2(known, gap, sensitivity, known.noise)
    left = max(gap.size - freedom, 1)
    ratio2 = float(distance2.sum()) / left
    m = gap.shape[1]
    spread = max(float((distance2**2).mean() / distance2.mean() ** 2 - 1.0), 2.0 / m)
    effective = left * (2.0 / m) / spread
    p = float(chdtrc(effective, ratio2 * effective))
    # a noise that is not stated fits whatever is left: scatter explains only where there is some
    return p, bool(real) and (p > _LEVEL or ratio2 < _MATERIAL_SCALE**2)


def _note(scatter: Scatter, laws: Mapping[str, str], kept: list[_Kept]) -> str:
    if laws:
        joint, quantity = next(iter(laws.items()))
        return f"what looks like scatter of {joint} follows {quantity}: it is no scatter"
    if kept and all(k.doubtful for k in kept):
        return "the scatter shows no steps: repeats of each pose (column pose) would tell wear from what a pose brings"
    if not kept and scatter.chosen("pose"):
        return "joints err from pose to pose without steps or a law: repeats of each pose would tell wear from that"
    return scatter.note
