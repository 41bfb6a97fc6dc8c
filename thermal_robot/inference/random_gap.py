"""What is random in a gap beyond the instrument: joints that scatter, told from laws and from steps of an encoder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from thermal_robot.arrays import Array
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.generalised import generalised
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.robust import distance_limit
from thermal_robot.inference.rows import repeated_poses
from thermal_robot.inference.scatter import JointScatter, Scatter, enough_rows, joint_errors, variance_components
from thermal_robot.inference.steps import followed, period, seen, stepped


@dataclass(frozen=True)
class Kept:
    """A component that counts as scatter, and the step that an encoder would have, rad or m."""

    component: JointScatter
    step: float


@dataclass(frozen=True, eq=False)
class RandomGap:
    """What is random in the gap beyond the instrument.

    Attributes
    ----------
    kept
        The components of the scatter that are scatter.
    explains_size
        Whether scatter explains the size of the remainder: no more is left than instrument and scatter allow. What
        poses bring counts where it is more probably an encoder's than not.
    p_value
        Of the χ² test that no more is left.
    scatter
        The variances behind it.
    steps
        By joint: logarithm of the Bayes factor of steps of the command against errors that follow nothing.
    laws
        By joint: the quantity that its errors follow, so that they are no scatter but what no known effect explains.
    note
        What limits the answer, one plain sentence; empty where nothing does.
    """

    kept: tuple[Kept, ...]
    explains_size: bool
    p_value: float
    scatter: Scatter
    steps: Mapping[str, float]
    laws: Mapping[str, str]
    note: str = ""

    @property
    def seen(self) -> float:
        """The logarithm of the Bayes factor of steps in all those joints, some of whose steps may stay hidden."""
        return seen(tuple(self.steps.values()))

    @property
    def stepped(self) -> float:
        """Probability that what poses bring is due to such steps."""
        return stepped(self.seen, again=len(self.scatter.kinds) > 1)

    def kept_of(self, kind: str) -> list[Kept]:
        """Return the kept components of one kind."""
        return [k for k in self.kept if k.component.kind == kind]


def nothing_random(fit: Fit) -> RandomGap:
    """Return the random gap of which nothing can be said."""
    return RandomGap((), False, 1.0, Scatter((), (), {}, fit.explanation.whitening.noise), {}, {})


def random_gap(fit: Fit) -> RandomGap:
    """Say which joints scatter beyond the instrument, anew at each visit or once a pose.

    What a systematic effect leaves may look like scatter of a joint. If a joint's errors follow a smooth law of a
    recorded quantity, they are no scatter. Errors of an encoder are a sawtooth of the command with the period √12 σ.
    Without repeats only that period separates an encoder's steps from wear.

    Parameters
    ----------
    fit
        Frames and systematic effects, fitted.

    Returns
    -------
    RandomGap
        Without repeats the two kinds are one.
    """
    e, observed = fit.explanation, fit.corrected
    m = observed.gap.shape[1]
    even = _even(fit)
    gap, sensitivity = observed.gap / even, observed.joint_sensitivity[:, :m] / even[:, :, None]
    given = (fit.campaign.noise_position, fit.campaign.noise_orientation)[: m // 3]
    noise = np.repeat([g or e.whitening.noise[3 * k] for k, g in enumerate(given)], 3)
    pose, held = repeated_poses(fit.campaign), [bool(g) for g in given]
    asked = np.isin(np.arange(len(gap)), enough_rows(pose, ~e.outliers)) | e.outliers
    used = asked & ~e.outliers
    freedom = round(e.best.effective) + e.linear.frames.shape[2]
    for _ in range(settings.SCATTER_PASSES):
        scatter = variance_components(
            gap,
            sensitivity,
            noise,
            pose,
            stated=held,
            freedom=freedom,
            weights=used.astype(float),
            start=_in_joints(fit),
        )
        if not any(c.chosen for c in scatter.components):
            break
        gap = _refitted(fit, scatter, used, even)
        # rows set aside as gross errors may be no more than this scatter
        within = _distance2(scatter, gap, sensitivity, scatter.noise) <= distance_limit(m, len(gap))
        if 2 * within.sum() < len(within):
            break  # most rows lie beyond any scatter: robot and table do not belong together
        used = within & asked
    scatter, used, carried = _stands(scatter, gap, sensitivity, noise, pose, held, freedom, used)
    laws, steps, kept = _judge(fit, scatter, gap[used], sensitivity[used], pose, used, noise, freedom)
    likely = stepped(seen(tuple(steps.values())), again=len(scatter.kinds) > 1)
    real = tuple(k.component for k in kept if k.component.kind == "visit" or likely >= settings.SCATTER_SURE)
    p_value, explains = _chance_of_size(scatter, real, gap[used], sensitivity[used], noise, held, freedom)
    few = ", ".join(fit.campaign.robot.joint_names[j] for j in carried)
    note = _note(scatter, laws, few, bool(steps) and likely < settings.SCATTER_SURE)
    return RandomGap(tuple(kept), explains, p_value, scatter, steps, laws, note)


def _stands(
    scatter: Scatter,
    gap: Array,
    sensitivity: Array,
    noise: Array,
    pose: NDArray[np.int64],
    held: list[bool],
    freedom: int,
    used: NDArray[np.bool_],
) -> tuple[Scatter, NDArray[np.bool_], list[int]]:
    """Ask whether scatter is seen without the few rows that speak most for it; scatter is in all rows.

    Returns the scatter and the rows that count, and the joints of which a few rows had told it: the scatter is then
    that of the other rows.
    """
    chosen = [c for c in scatter.components if c.chosen]
    if not chosen:
        return scatter, used, []
    rows = np.flatnonzero(used)
    told = [joint_errors(scatter, gap[rows], sensitivity[rows], c.joint) for c in chosen]
    most = np.argsort(-np.max([np.abs(errors / spread) for errors, spread in told], axis=0), kind="stable")
    rest = used.copy()
    rest[rows[most[: int(np.ceil(settings.CARRYING * len(rows)))]]] = False
    start = [(c.kind, c.joint) for c in chosen]
    again = variance_components(
        gap, sensitivity, noise, pose, stated=held, freedom=freedom, weights=rest.astype(float), start=start
    )
    speaks = {(c.kind, c.joint) for c in again.components if c.chosen or c.log_bayes_factor > 0.0}
    carried = [joint for kind, joint in start if (kind, joint) not in speaks]
    return (again, rest, carried) if carried else (scatter, used, [])


def _in_joints(fit: Fit) -> list[tuple[str, int]]:
    """Return the kind and the joints of a discrepancy that is anew in every pose or visit."""
    form, names = fit.explanation.discrepancy.form, fit.campaign.robot.joint_names
    if form is None or not form.anew:
        return []
    kind = "visit" if form.name.startswith("visits") else "pose"
    return [(kind, names.index(joint)) for joint in form.joints]


def _even(fit: Fit) -> Array:
    """(N, m) what figures and sensitivities are divided by, so that all rows have the same noise.

    Of rows that repeat a pose it is their root mean square: what the pose brings then cancels in their contrasts, as it
    must, and the mean square of a contrast stays that of the noise.
    """
    relative = fit.campaign.relative_noise
    if relative is None:
        return np.ones_like(fit.corrected.gap)
    pose = repeated_poses(fit.campaign)
    return np.sqrt(_Mean(pose, np.ones(len(pose)))(relative**2))[pose]


def _refitted(fit: Fit, scatter: Scatter, used: NDArray[np.bool_], even: Array) -> Array:
    """(N, m) remainder once frames and explanation are fitted in the covariance of the scatter.

    Generalised least squares. If the noise were taken for the instrument's alone, a joint that scatters would pull the
    frames far off, and their error would then count as scatter of the other joints.
    """
    e = fit.explanation
    blocks = [e.linear.blocks[b].columns * e.linear.blocks[b].sizes for b in e.best.blocks]
    design = np.concatenate([e.linear.frames, *blocks], axis=2)
    gap, design = fit.corrected.gap / even, design / even[:, :, None]
    if not design.shape[2]:
        return gap
    covariance = scatter.covariance(fit.corrected.joint_sensitivity[used, : gap.shape[1]] / even[used, :, None])
    white = generalised(Linear(gap[used], design[used], ()), covariance, np.ones(gap.shape[1]))
    columns = equations_of(white.frames)
    return np.asarray(gap - design @ solve(columns.T @ columns, columns.T @ white.gap.ravel()))


def _distance2(scatter: Scatter, gap: Array, sensitivity: Array, noise: Array) -> Array:
    solved = np.linalg.solve(scatter.covariance(sensitivity, noise), gap[:, :, None])[:, :, 0]
    return np.asarray((solved * gap).sum(axis=1))


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
    fit: Fit,
    scatter: Scatter,
    gap: Array,
    sensitivity: Array,
    pose: NDArray[np.int64],
    used: NDArray[np.bool_],
    noise: Array,
    freedom: int,
) -> tuple[dict[str, str], dict[str, float], list[Kept]]:
    """Sort the chosen components: those that follow a law, and scatter; with what speaks for steps of each joint.

    What was fitted took errors of the poses with it: a share of so many parameters in all that was measured of them.
    """
    names = fit.campaign.robot.joint_names
    recorded = {name: values[used] for name, values in quantities(fit.corrected).items()}
    number = np.unique(pose[used], return_inverse=True)[1].ravel()
    taken = freedom / (gap.shape[1] * (int(number.max()) + 1))
    laws: dict[str, str] = {}
    factors: dict[str, float] = {}
    kept: list[Kept] = []
    for c in (c for c in scatter.components if c.chosen):
        if c.kind == "visit":
            errors, spread = joint_errors(scatter, gap, sensitivity, c.joint)
            weight = 1.0 / (spread**2 + c.sigma**2)
            mean = _Mean(number, weight)
            common, counts = mean(errors)[number], np.bincount(number)[number] > 1
            errors, weight = (errors - common)[counts], weight[counts]
            within = {name: (v - mean(v)[number])[counts] for name, v in recorded.items()}
            law = followed(errors, weight, within, number[counts])
        else:
            mean = _Mean(number, np.ones(len(number)))
            errors, variance = _pose_errors(scatter, gap, sensitivity, mean, c.joint, noise)
            weight, command = 1.0 / (variance + c.sigma**2), mean(fit.campaign.q[used, c.joint])
            law = followed(errors, weight, {name: mean(v) for name, v in recorded.items()})
        if law:
            laws[names[c.joint]] = law
            continue
        step = float(np.sqrt(settings.FLAT) * c.sigma)
        if c.kind == "pose":
            found = period(errors, variance + taken * c.sigma**2, command, step)
            step, factors[names[c.joint]] = found.step, found.log_factor
        kept.append(Kept(c, step))
    return laws, factors, kept


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


def _chance_of_size(
    scatter: Scatter,
    real: tuple[JointScatter, ...],
    gap: Array,
    sensitivity: Array,
    noise: Array,
    held: list[bool],
    freedom: int,
) -> tuple[float, bool]:
    """Test the remainder in the rows' whole covariance by χ²; heavy tails reduce its degrees of freedom."""
    parts = np.repeat(held, 3)
    known = Scatter(scatter.kinds, real, scatter.probability, np.where(parts, noise, scatter.noise))
    distance2 = _distance2(known, gap, sensitivity, known.noise)
    left = max(gap.size - freedom, 1)
    ratio2 = float(distance2.sum()) / left
    m = gap.shape[1]
    spread = max(float((distance2**2).mean() / max(float(distance2.mean()) ** 2, settings.TINY) - 1.0), 2.0 / m)
    effective = left * (2.0 / m) / spread
    p = float(chdtrc(effective, ratio2 * effective))
    # a noise that is not stated fits whatever is left: scatter explains only where there is some
    return p, bool(real) and (p > settings.LEVEL or ratio2 < settings.MATERIAL_SCALE**2)


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
