"""What is random in a gap beyond the instrument: joints that scatter, told from laws and from steps of an encoder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, expit, log_ndtr, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.problem import Linear, generalised
from thermal_robot.inference.robust import distance_limit
from thermal_robot.inference.rows import repeated_poses
from thermal_robot.inference.scatter import Component, JointScatter, Scatter, enough_rows, variance_components
from thermal_robot.inference.target import Target

Rows = NDArray[np.bool_]


def followed(errors: Array, weight: Array, recorded: Mapping[str, Array], pose: NDArray[np.int64] | None = None) -> str:
    """F test of each recorded quantity: name that which errors (K,) of weight 1/variance follow smoothly, or none.

    The p-value is multiplied by their number (Bonferroni); a law must also explain a good part of the errors. ``pose``
    (K,): where errors are those within a pose, the mean of each was taken out of them.
    """
    root = np.sqrt(weight)
    number = np.zeros(len(errors), dtype=np.int64) if pose is None else np.unique(pose, return_inverse=True)[1]
    means = np.eye(int(number.max()) + 1)[number] * root[:, None]
    means = means / np.linalg.norm(means, axis=0)
    target = Target(without(errors * root, means), root[:, None], means)
    vary = {name: values for name, values in recorded.items() if np.ptp(values) > settings.ROUNDING}
    worth = {name: target.worth(smooth_columns(values)[:, None, :]) for name, values in vary.items()}
    p_values = {name: w.p_value for name, w in worth.items() if w.share > settings.SCATTER_LAW_SHARE}
    best = min(p_values, key=p_values.__getitem__, default="")
    return best if best and p_values[best] * len(recorded) < settings.LEVEL else ""


@dataclass(frozen=True)
class Steps:
    """Distance of an encoder's steps, rad or m, and the log Bayes factor of steps over none.

    Where none is seen the distance is what the errors' size implies, and the factor 0 where it cannot be asked.
    """

    step: float
    log_factor: float


def period(errors: Array, variance: Array, command: Array, step: float) -> Steps:
    """Periodogram of a sawtooth: look for the distance of the only positions at which a joint stands, an encoder's.

    The joint stands at the multiple of the step s, from a first position φ on, that is nearest to its command. Its
    error (K,) is then a sawtooth of the command, u s with u from -½ to ½, seen with its variance v and a slack of the
    steps; without steps it is normal with the variance v + s²/12. The Bayes factor is the ratio of these likelihoods,
    its mean over φ, over slacks, and over the frequencies 1/s near that which the size of the errors implies (``step``,
    rad or m). The logarithm of a row's likelihood is periodic in φ less the command: by its Fourier series the sum over
    rows is one of waves exp(2π i k command/s).
    """
    some = np.linspace(0.0, len(errors) - 1.0, min(len(errors), settings.STEP_POSES)).round().astype(np.int64)
    errors, variance, command = errors[some] / step, variance[some] / step**2, (command - command.mean())[some] / step
    without_steps = float(_normal(errors, 0.0, variance + 1.0 / 12).sum())
    tried = [_tried(errors, variance, command, slack) for slack in settings.STEP_SLACKS]
    if not all(len(frequency) for frequency, _ in tried):
        return Steps(step, 0.0)
    means = [float(logsumexp(each) - np.log(len(each))) for _, each in tried]
    factor = float(logsumexp(means) - np.log(len(means))) - without_steps
    frequency, each = tried[int(np.argmax(means))]
    return Steps(step / float(frequency[np.argmax(each)]) if factor > settings.CONVINCING else step, factor)


def _tried(errors: Array, variance: Array, command: Array, slack: float) -> tuple[Array, Array]:
    """Return frequencies, none where there are too many, and the log likelihood of steps of each, its mean over phase.

    All are in implied steps.
    """
    known = variance + slack**2
    width = 1.0 / (max(float(command.std()), 1.0) * np.sqrt(max(float((1.0 / known).sum()), (2.0 * np.pi) ** 2)))
    bands = np.geomspace(1.0 / settings.BAND, settings.BAND, settings.STEP_BANDS + 1)
    if (bands[-1] - bands[0]) / width > settings.MOST_FREQUENCIES:
        return np.zeros(0), np.zeros(0)
    frequencies, likelihoods = [], []
    for low, high in pairwise(bands):
        here, frequency = float(np.sqrt(low * high)), np.arange(low, high, width)
        series = _series(errors * here, known * here**2, slack)
        waves = [_sums(c, k * command, low, width, len(frequency)) for k, c in enumerate(series.T)]
        of_phase = np.fft.irfft(np.stack(waves), settings.STEP_PHASES, axis=0) + len(errors) * np.log(here)
        likelihoods.append(logsumexp(of_phase, axis=0) - np.log(settings.STEP_PHASES))
        frequencies.append(frequency)
    return np.concatenate(frequencies), np.concatenate(likelihoods)


def _normal(x: Array, mean: Array | float, variance: Array) -> Array:
    return np.asarray(-0.5 * ((x - mean) ** 2 / variance + np.log(2.0 * np.pi * variance)))


def _series(errors: Array, variance: Array, slack: float) -> NDArray[np.complex128]:
    """(K, H) Fourier coefficients, over the place of the first position, of each row's log likelihood; in steps.

    Of the positions around a command the nearest is taken, up to the slack.
    """
    u = np.arange(settings.STEP_PHASES) / settings.STEP_PHASES
    near = np.stack([u - 1.0, u, u + 1.0]) - 0.5
    taken = log_ndtr((0.5 - np.abs(near)) / slack)
    taken = taken - logsumexp(taken, axis=0)
    each = taken + _normal(errors[:, None, None], near, variance[:, None, None])
    return np.asarray(np.fft.rfft(logsumexp(each, axis=1), axis=1)[:, : settings.STEP_HARMONICS + 1])


def _sums(weight: NDArray[np.complex128], place: Array, lowest: float, width: float, count: int) -> Array:
    """(count,) Fourier sums Σ weight exp(-2π i f place) at frequencies f that begin at the lowest, a width apart.

    A frequency is a coarse one and a fine one, so that the sums are a product of two small matrices.
    """
    fine = int(np.sqrt(count)) + 1
    coarse = lowest + width * fine * np.arange(-(-count // fine))
    first, second = (np.exp(-2j * np.pi * np.outer(f, place)) for f in (coarse, width * np.arange(fine)))
    return np.asarray(((weight * first) @ second.T).ravel()[:count])


def stepped(log_factors: Iterable[float]) -> float:
    """Posterior probability that joints which err anew from pose to pose do so by the steps of their encoders.

    From the log Bayes factor of each joint, of which some steps may stay hidden. That later visits of a pose find the
    same error does not tell steps.
    """
    shown = np.log1p(-settings.STEPS_HIDDEN) + np.array(list(log_factors), dtype=float)
    return float(expit(np.logaddexp(shown, np.log(settings.STEPS_HIDDEN)).sum() - np.log(settings.RIVALS)))


@dataclass(frozen=True)
class Kept:
    """A component that counts as scatter, and the step that an encoder would have, rad or m."""

    component: JointScatter
    step: float


@dataclass(frozen=True, eq=False)
class RandomGap:
    """What is random in the gap beyond the instrument, by the variances of ``scatter``.

    ``kept`` are its components that are scatter. ``explains_size``: no more is left than instrument and scatter allow,
    by a χ² test (``p_value``); what poses bring counts where it is more probably an encoder's. By joint: ``steps``, the
    log Bayes factor of steps of the command against errors that follow nothing, and ``laws``, the quantity that its
    errors follow, so that they are no scatter. ``note`` says what limits the answer.
    """

    kept: tuple[Kept, ...]
    explains_size: bool
    p_value: float
    scatter: Scatter
    steps: Mapping[str, float]
    laws: Mapping[str, str]
    note: str = ""

    @property
    def stepped(self) -> float:
        """Probability that what poses bring is due to such steps."""
        return stepped(self.steps.values())


def nothing_random(fit: Fit) -> RandomGap:
    """Return the random gap of which nothing can be said."""
    noise = fit.explanation.whitening.noise
    return RandomGap((), False, 1.0, Scatter((), (), {}, noise, 0.0 * noise), {}, {})


def random_gap(fit: Fit) -> RandomGap:
    """Say which joints scatter beyond the instrument, anew at each visit or once a pose; without repeats these are one.

    If a joint's errors follow a smooth law of a recorded quantity, they are no scatter. Errors of an encoder are a
    sawtooth of the command with the period √12 σ; without repeats only that separates its steps from wear.
    """
    e, observed, even = fit.explanation, fit.corrected, _even(fit)
    m = even.shape[1]
    gap, sensitivity = observed.gap / even, observed.joint_sensitivity[:, :m] / even[:, :, None]
    given = (fit.campaign.noise_position, fit.campaign.noise_orientation)[: m // 3]
    noise = np.repeat([g or e.whitening.noise[3 * k] for k, g in enumerate(given)], 3)
    pose, held = repeated_poses(fit.campaign), [bool(g) for g in given]
    asked = np.isin(np.arange(len(gap)), enough_rows(pose, ~e.outliers)) | e.outliers
    used = asked & ~e.outliers
    freedom = round(e.best.effective) + e.linear.frames.shape[2]
    estimate = partial(
        variance_components, sensitivity=sensitivity, noise=noise, pose=pose, stated=held, freedom=freedom
    )
    for _ in range(settings.SCATTER_PASSES):
        scatter = estimate(gap, used=used, start=_in_joints(fit))
        if not scatter.components:
            break
        gap = _refitted(fit, scatter, sensitivity, used, even)
        # rows set aside as gross errors may be no more than this scatter
        within = _distance2(scatter, gap, sensitivity) <= distance_limit(m, len(gap))
        if 2 * within.sum() < len(within):
            break  # most rows lie beyond any scatter: robot and table do not belong together
        used = within & asked
    scatter, used, carried = _stands(partial(estimate, gap), scatter, gap, sensitivity, used)
    gap, sensitivity = gap[used], sensitivity[used]
    laws, steps, kept = _judge(fit, scatter, gap, sensitivity, pose, used, freedom)
    likely = stepped(steps.values()) >= settings.SCATTER_SURE
    real = tuple(k.component for k in kept if k.component.kind == "visit" or likely)
    known = replace(scatter, components=real, noise=np.where(np.repeat(held, 3), noise, scatter.noise))
    p_value, explains = _chance_of_size(_distance2(known, gap, sensitivity), m, freedom)
    few = ", ".join(fit.campaign.robot.joint_names[j] for j in carried)
    note = _note(scatter, laws, few, bool(steps) and not likely)
    return RandomGap(tuple(kept), bool(real) and explains, p_value, scatter, steps, laws, note)


def _stands(
    estimate: Callable[..., Scatter], scatter: Scatter, gap: Array, sensitivity: Array, used: Rows
) -> tuple[Scatter, Rows, list[int]]:
    """Ask whether scatter is seen without the few rows that speak most for it; scatter is in all rows.

    Returns it, the rows that count, and the joints of which a few rows had told it: it is then that of the other rows.
    """
    if not scatter.components:
        return scatter, used, []
    rows = np.flatnonzero(used)
    told = [scatter.errors(c.joint, gap[rows], sensitivity[rows]) for c in scatter.components]
    most = np.argsort(-np.max([errors**2 / variance for errors, variance in told], axis=0), kind="stable")
    rest = used.copy()
    rest[rows[most[: int(np.ceil(settings.FEW_ASIDE * len(rows)))]]] = False
    start = [(c.kind, c.joint) for c in scatter.components]
    again = estimate(used=rest, start=start)
    speaks = {(c.kind, c.joint) for c in again.components} | {c for c, f in again.log_factors.items() if f > 0.0}
    carried = [joint for kind, joint in start if (kind, joint) not in speaks]
    return (again, rest, carried) if carried else (scatter, used, [])


def _in_joints(fit: Fit) -> list[Component]:
    """Return the kind and the joints of a discrepancy that is anew in every pose or visit."""
    form, names = fit.explanation.discrepancy.form, fit.campaign.robot.joint_names
    if form is None or not form.anew:
        return []
    kind = "visit" if form.name.startswith("visits") else "pose"
    return [(kind, names.index(joint)) for joint in form.joints]


def _means(values: Array, number: NDArray[np.int64], weight: Array | None = None) -> Array:
    """(P, ...) weighted mean of the rows of each pose."""
    weight = np.ones(len(number)) if weight is None else weight
    total = np.bincount(number, weight)
    sums = np.zeros((len(total), *values.shape[1:]))
    np.add.at(sums, number, (weight * values.T).T)
    return np.asarray((sums.T / total).T)


def _even(fit: Fit) -> Array:
    """(N, m) what figures and sensitivities are divided by, so that all rows have the same noise.

    Of rows that repeat a pose it is their root mean square: what the pose brings then cancels in their contrasts, as it
    must, and the mean square of a contrast stays that of the noise.
    """
    relative = fit.campaign.relative_noise
    if relative is None:
        return np.ones_like(fit.corrected.gap)
    pose = repeated_poses(fit.campaign)
    return np.asarray(np.sqrt(_means(relative**2, pose))[pose])


def _refitted(fit: Fit, scatter: Scatter, sensitivity: Array, used: Rows, even: Array) -> Array:
    """(N, m) residual of generalised least squares: frames and explanation in the covariance of the scatter.

    If the noise were taken for the instrument's alone, a joint that scatters would pull the frames far off, and their
    error would then count as scatter of the other joints.
    """
    e = fit.explanation
    blocks = [e.linear.blocks[b].columns * e.linear.blocks[b].sizes for b in e.best.blocks]
    design = np.concatenate([e.linear.frames, *blocks], axis=2) / even[:, :, None]
    gap = fit.corrected.gap / even
    if not design.shape[2]:
        return gap
    covariance = scatter.covariance(sensitivity[used])
    white = generalised(Linear(gap[used], design[used], ()), covariance, np.ones(gap.shape[1]))
    columns = equations_of(white.frames)
    return np.asarray(gap - design @ solve(columns.T @ columns, columns.T @ white.gap.ravel()))


def _distance2(scatter: Scatter, gap: Array, sensitivity: Array) -> Array:
    solved = np.linalg.solve(scatter.covariance(sensitivity), gap[:, :, None])[:, :, 0]
    return np.asarray((solved * gap).sum(axis=1))


def _judge(
    fit: Fit, scatter: Scatter, gap: Array, sensitivity: Array, pose: NDArray[np.int64], used: Rows, freedom: int
) -> tuple[dict[str, str], dict[str, float], list[Kept]]:
    """Sort the components: those that follow a law, and scatter; with what speaks for steps of each joint.

    What was fitted took errors of the poses with it: a share of so many parameters in all that was measured of them.
    """
    recorded = {name: values[used] for name, values in quantities(fit.corrected).items()}
    number = np.unique(pose[used], return_inverse=True)[1].ravel()
    visits = np.bincount(number)
    averaged = _means(gap, number), _means(sensitivity, number)
    laws: dict[str, str] = {}
    factors: dict[str, float] = {}
    kept: list[Kept] = []
    for c in scatter.components:
        name, step = fit.campaign.robot.joint_names[c.joint], float(np.sqrt(12) * c.sigma)
        if c.kind == "visit":
            law = _within_poses(*scatter.errors(c.joint, gap, sensitivity), c.sigma, recorded, number)
        else:
            errors, variance = scatter.errors(c.joint, *averaged, visits)
            law = followed(errors, 1.0 / (variance + c.sigma**2), {n: _means(v, number) for n, v in recorded.items()})
        if law:
            laws[name] = law
            continue
        if c.kind == "pose":
            taken, command = freedom / averaged[0].size, _means(fit.campaign.q[used, c.joint], number)
            found = period(errors, variance + taken * c.sigma**2, command, step)
            step, factors[name] = found.step, found.log_factor
        kept.append(Kept(c, step))
    return laws, factors, kept


def _within_poses(
    errors: Array, variance: Array, sigma: float, recorded: Mapping[str, Array], number: NDArray[np.int64]
) -> str:
    """F test as :func:`followed`, of what errors (N,) of visits differ by from the mean of their pose."""
    weight, repeated = 1.0 / (variance + sigma**2), np.bincount(number)[number] > 1

    def within(values: Array) -> Array:
        return np.asarray((values - _means(values, number, weight)[number])[repeated])

    inside = {name: within(values) for name, values in recorded.items()}
    return followed(within(errors), weight[repeated], inside, number[repeated])


def _chance_of_size(distance2: Array, m: int, freedom: int) -> tuple[float, bool]:
    """χ² test of squared distances (N,) of rows in their whole covariance; heavy tails reduce its degrees of freedom.

    Returns the p-value, and whether the size is explained.
    """
    left = max(m * len(distance2) - freedom, 1)
    ratio2 = float(distance2.sum()) / left
    spread = max(float((distance2**2).mean() / max(float(distance2.mean()) ** 2, settings.TINY) - 1.0), 2.0 / m)
    effective = left * (2.0 / m) / spread
    p = float(chdtrc(effective, ratio2 * effective))
    return p, p > settings.LEVEL or ratio2 < settings.MATERIAL_SCALE**2


def _note(scatter: Scatter, laws: Mapping[str, str], few: str, doubtful: bool) -> str:
    if few:
        return f"what looks like scatter of {few} is carried by a few rows: it is no scatter"
    if laws:
        joint, quantity = next(iter(laws.items()))
        return f"what looks like scatter of {joint} follows {quantity}: it is no scatter"
    if doubtful and len(scatter.kinds) == 1:
        return "the scatter shows no steps: repeats of each pose (column pose) would tell wear from what a pose brings"
    if doubtful:
        return "joints err from pose to pose without the steps of an encoder, and follow nothing that was recorded"
    return scatter.note
