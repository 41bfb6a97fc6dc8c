"""Thermal elongation of links and displacement of the tool, and the inverse (Kluz et al. 2018, Eqs 5-13).

Elongations of a robot by temperature (Eq 5); z test of the displaced mean (Eq 13); first-order thermal lag of links;
optimal design of measuring poses, and least squares for the elongations from displacements there (Eq 12).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError, RobotError
from thermal_robot.kinematics import Displacement, elongation_jacobian, growing, tool_poses
from thermal_robot.robot import Robot, Segment


def displacement(robot: Robot, q: ArrayLike, elongations: PerSegment, *, exact: bool = False) -> Array:
    """Displacement of the tool point by elongations of the segments, Eqs 6–8 (9–11 for the RV-M2).

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    elongations
        m: (S,) or one number for all configurations, (N, S), or a mapping from names to numbers or (N,); (T, S) with
        one configuration gives T displacements.
    exact
        Move the tool with the elongated chain, not by the derivative. An elongation turns nothing, so both agree to
        rounding; the linear one is faster and keeps its digits however small the elongations are.

    Returns
    -------
    ndarray
        (N, 3) or (T, 3) m in the root frame; the tool is not turned.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    grown = per_segment(robot, elongations, "elongation")
    jacobian = elongation_jacobian(robot, q)
    if grown.ndim > 2 or (grown.ndim == 2 and 1 not in (len(jacobian), len(grown)) and len(jacobian) != len(grown)):
        raise RobotError(f"elongations of shape {grown.shape} do not fit {len(jacobian)} configurations")
    if not exact:
        linear: Array = (jacobian @ grown[..., None])[..., 0]
        return linear
    rows = np.broadcast_to(np.atleast_2d(grown), (max(len(jacobian), len(np.atleast_2d(grown))), jacobian.shape[2]))
    joints = np.broadcast_to(np.atleast_2d(np.asarray(q, dtype=float)), (len(rows), robot.n))
    twists = np.zeros((len(rows), len(robot.segments), 6))
    for column, s in enumerate(growing(robot)):
        twists[:, s, :3] = rows[:, column, None] * robot.segments[s].direction
    after, before = tool_poses(robot, joints, Displacement(segment=twists)), tool_poses(robot, joints)
    moved: Array = after[:, :3, 3] - before[:, :3, 3]
    return moved


def sensitivity(robot: Robot, q: ArrayLike, *, coefficients: PerSegment) -> Array:
    """Displacement of the tool point per kelvin in each segment alone: column i of the matrix of Eq 14 times χ_i l_i.

    The sum over the segments is the displacement for a kelvin in the whole robot; its norm, drawn over the workspace,
    is the map of where a part is joined with the least sensitivity to temperature.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    coefficients
        1/K, as for :func:`~thermal_robot.assembly.thermal.elongation`.

    Returns
    -------
    ndarray
        (N, 3, S) m/K in the root frame.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    strain = per_segment(robot, coefficients, "coefficient of expansion")
    per_kelvin: Array = elongation_jacobian(robot, q) * (strain * lengths(robot))[..., None, :]
    return per_kelvin


PerSegment: TypeAlias = "ArrayLike | Mapping[str, ArrayLike]"
"""One number for all segments, an array (..., S), or a value (...) for each name of a segment or of its link."""

STANDARD_TEMPERATURE = 20.0
"""°C at which lengths are meant (ISO 1)."""


def segment_names(robot: Robot) -> tuple[str, ...]:
    """Names of the S segments with a length, from the root on: the order of all arrays of elongations."""
    return tuple(segment.name for segment in _segments(robot))


def lengths(robot: Robot) -> Array:
    """Lengths (S,), m, of the segments with a length, in the order of :func:`segment_names`."""
    return np.array([segment.length for segment in _segments(robot)])


def elongation(
    robot: Robot,
    temperature: PerSegment,
    *,
    coefficients: PerSegment,
    reference: float = STANDARD_TEMPERATURE,
) -> Array:
    """Elongation of every segment with a length: Δl_i = χ_i l_i (T_i − T_reference), Eq 5.

    Parameters
    ----------
    robot
        The robot.
    temperature
        °C: one number, an array (..., S), or a mapping from the names of segments, or of the links that carry them,
        to numbers or to arrays of one shape (...), such as the instants of a warm-up.
    coefficients
        Coefficient of expansion, 1/K, in the same forms.
    reference
        °C at which the lengths of the robot description hold.

    Returns
    -------
    ndarray
        (..., S) m, in the order of :func:`segment_names`.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    rise = per_segment(robot, temperature, "temperature") - reference
    return per_segment(robot, coefficients, "coefficient of expansion") * lengths(robot) * rise


def expansion_coefficients(robot: Robot, elongations: PerSegment, rise: PerSegment) -> Array:
    """Coefficient of expansion (..., S), 1/K, of each segment that grew by ``elongations`` (m) in ``rise`` kelvins."""
    strain = per_segment(robot, elongations, "elongation") / lengths(robot)
    found: Array = strain / per_segment(robot, rise, "rise of temperature")
    return found


def expansion_coefficient(
    robot: Robot, elongations: PerSegment, rise: PerSegment, *, segments: Iterable[str] | None = None
) -> float:
    """Return the common coefficient of expansion of measured elongations, by least squares.

    Parameters
    ----------
    robot
        The robot.
    elongations, rise
        m and K, in the forms of :func:`elongation`; any number of states may be given at once.
    segments
        Names of the segments, or links, to count; all by default.

    Returns
    -------
    float
        1/K.

    Raises
    ------
    RobotError
        If a name is unknown or a shape does not fit.
    """
    chosen = slice(None) if segments is None else [c for name in segments for c in columns_of(robot, name)]
    expected = (lengths(robot) * per_segment(robot, rise, "rise of temperature"))[..., chosen]
    grown = per_segment(robot, elongations, "elongation")[..., chosen]
    return float(np.sum(expected * grown) / np.sum(np.broadcast_to(expected, np.broadcast(expected, grown).shape) ** 2))


def per_segment(robot: Robot, values: PerSegment, what: str) -> Array:
    """Values in any form of :data:`PerSegment` as an array (..., S), one for each segment with a length.

    A value by a segment's name overrides one by its link's. ``RobotError`` for unknown names, missing values or shapes.
    """
    names = segment_names(robot)
    if not isinstance(values, Mapping):
        array = np.asarray(values, dtype=float)
        if array.ndim == 0:
            return np.full(len(names), array)
        if array.shape[-1] != len(names):
            raise RobotError(
                f"{what} of shape {array.shape} does not fit the {len(names)} segments of robot {robot.name!r}: "
                f"{', '.join(names)}",
                name=robot.name,
                candidates=names,
            )
        return array
    found: dict[int, Array] = {}
    # Links first, so that a segment's own value replaces the value of its link.
    for name in sorted(values, key=lambda name: name in names):
        for column in columns_of(robot, name):
            found[column] = np.asarray(values[name], dtype=float)
    missing = tuple(name for column, name in enumerate(names) if column not in found)
    if missing:
        raise RobotError(f"no {what} is given for {', '.join(missing)}", name=missing[0], candidates=missing)
    return np.stack(np.broadcast_arrays(*(found[column] for column in range(len(names)))), axis=-1)


def columns_of(robot: Robot, name: str) -> tuple[int, ...]:
    """Columns, among the segments with a length, of a segment or of a link's segments; ``RobotError`` if unknown."""
    chosen = _segments(robot)
    own = tuple(column for column, segment in enumerate(chosen) if segment.name == name)
    carried = tuple(column for column, segment in enumerate(chosen) if segment.parent_link == name)
    if not (own or carried):
        known = tuple(dict.fromkeys(n for segment in chosen for n in (segment.name, segment.parent_link)))
        raise RobotError(
            f"{name!r} is no segment with a length, nor a link that carries one, of robot {robot.name!r}; "
            f"these are {', '.join(known)}",
            name=name,
            candidates=known,
        )
    return own or carried


def _segments(robot: Robot) -> list[Segment]:
    return [robot.segments[s] for s in growing(robot)]


@dataclass(frozen=True, eq=False)
class MeanShift:
    """Result of the two-sided z test of a mean, :func:`mean_shift_test`; arrays have one entry for each axis.

    Parameters
    ----------
    mean, mu0, sigma
        Mean of the sample, its value by the hypothesis, standard deviation of one measurement; in one unit.
    n
        Size of the sample.
    alpha
        Level of significance.
    u
        U = (mean − μ0) √n / σ, Eq 13; standard normal under the hypothesis.
    critical
        u(1 − α/2): the critical set is |U| beyond it.
    p_value
        Probability, under the hypothesis, of a |U| at least this large.
    accepted
        Whether there is no reason to reject the hypothesis; one bool for each axis.
    """

    mean: Array
    mu0: Array
    sigma: Array
    n: int
    alpha: float
    u: Array
    critical: float
    p_value: Array
    accepted: NDArray[np.bool_]

    def power(self, shift: ArrayLike) -> Array:
        """Probability of rejecting the hypothesis when the true mean is off μ0 by ``shift`` (unit of σ)."""
        from scipy.special import ndtr

        moved = np.asarray(shift, dtype=float) / self.sigma * np.sqrt(self.n)
        return np.asarray(ndtr(moved - self.critical) + ndtr(-moved - self.critical))


def mean_shift_test(
    sample: ArrayLike, mu0: ArrayLike, sigma: ArrayLike | None = None, *, n: int | None = None, alpha: float = 0.05
) -> MeanShift:
    """Two-sided z test of a mean against μ0, with known standard deviation (Eq 13).

    Parameters
    ----------
    sample
        Measurements (n,) or (n, axes); or, if ``n`` is given, their mean, a number or (axes,).
    mu0
        Mean by the hypothesis, such as the displacement that was found statically, in the unit of the sample.
    sigma
        Standard deviation of one measurement. ``None`` takes the sample's own, for which U is normal only for large
        samples (the paper: n > 30).
    n
        Size of the sample of which ``sample`` is the mean.
    alpha
        Level of significance.

    Returns
    -------
    MeanShift
        U, p-value and decision for each axis; the power of the test for any shift.

    Raises
    ------
    EstimationError
        If there are no measurements, σ is not positive, or α is not between 0 and 1.
    """
    from scipy.special import ndtr, ndtri

    values = np.asarray(sample, dtype=float)
    if n is None:
        if values.ndim == 0 or len(values) < 2:
            raise EstimationError("a sample has at least two measurements; give n if this is their mean")
        n, mean = len(values), values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) if sigma is None else np.asarray(sigma, dtype=float)
    elif sigma is None:
        raise EstimationError("a mean alone has no standard deviation: give sigma")
    else:
        mean, spread = values, np.asarray(sigma, dtype=float)
    if n < 1 or not 0.0 < alpha < 1.0 or not np.all(spread > 0.0):
        raise EstimationError(f"needs n ≥ 1, σ > 0 and 0 < α < 1, got n = {n}, σ = {spread}, α = {alpha}")
    hypothesis = np.asarray(mu0, dtype=float)
    u = np.asarray((mean - hypothesis) / spread * np.sqrt(n))
    critical = float(ndtri(1.0 - alpha / 2.0))
    return MeanShift(
        np.asarray(mean),
        hypothesis,
        spread,
        n,
        alpha,
        u,
        critical,
        2.0 * ndtr(-np.abs(u)),
        np.asarray(np.abs(u) <= critical),
    )


@dataclass(frozen=True, eq=False)
class LinkWarmUp:
    """Temperatures of the S segments of a robot at T instants; made by :func:`warm_up`.

    Parameters
    ----------
    robot
        The robot.
    times
        (T,) s.
    ambient
        (T, S) °C around each segment.
    temperatures
        (T, S) °C of each segment.
    """

    robot: Robot
    times: Array
    ambient: Array
    temperatures: Array

    def elongations(self, *, coefficients: PerSegment, reference: float = STANDARD_TEMPERATURE) -> Array:
        """Elongations (T, S) m, Eq 5; arguments as for :func:`~thermal_robot.assembly.thermal.elongation`."""
        return elongation(self.robot, self.temperatures, coefficients=coefficients, reference=reference)

    def displacements(
        self, q: ArrayLike, *, coefficients: PerSegment, reference: float = STANDARD_TEMPERATURE
    ) -> Array:
        """Displacements (T, 3) m of the tool point at the T instants; ``q`` is (n,) for all, or (T, n)."""
        grown = self.elongations(coefficients=coefficients, reference=reference)
        return displacement(self.robot, q, grown)


def warm_up(
    robot: Robot,
    times: ArrayLike,
    ambient: PerSegment,
    *,
    time_constants: PerSegment,
    initial: PerSegment | None = None,
) -> LinkWarmUp:
    """Temperatures of all segments by first-order lag behind their surroundings: τ_i dT_i/dt = T_ambient,i − T_i.

    Parameters
    ----------
    robot
        The robot.
    times
        (T,) s, not decreasing. Two equal times are a step of the ambient temperature.
    ambient
        °C at ``times``, linear in between, for which the solution is exact: a number, (T,), (T, S), or a mapping from
        names of segments or links to numbers or (T,), where a link has surroundings of its own, such as a motor.
    time_constants
        τ_i > 0, s: a number, (S,), or a mapping from names to numbers.
    initial
        °C of the segments at the first instant, in the forms of the time constants; ambient by default.

    Returns
    -------
    LinkWarmUp
        Temperatures of the segments at ``times``, and from them elongations and displacements.

    Raises
    ------
    RobotError
        If times decrease, a time constant is not positive and finite, a name is unknown, or a shape does not fit.
    """
    instants = np.asarray(times, dtype=float)
    if instants.ndim != 1 or not len(instants) or not np.all(np.diff(instants) >= 0.0):
        raise RobotError("the times of a warm-up are at least one number of seconds and do not decrease")
    around = _over_time(robot, ambient, len(instants))
    lag = per_segment(robot, time_constants, "time constant")
    if lag.ndim != 1 or not np.all((lag > 0.0) & np.isfinite(lag)):
        raise RobotError("every segment needs one positive time constant, s")
    start = around[0] if initial is None else per_segment(robot, initial, "initial temperature")
    temperatures = np.empty_like(around)
    temperatures[0] = start
    for i, step in enumerate(np.diff(instants)):
        now, begins, ends = temperatures[i], around[i], around[i + 1]
        elapsed = step / lag
        caught_up = -np.expm1(-elapsed)
        # A ramp is followed at a distance of slope · τ, reached as the exponential dies; a step has no duration.
        slope = (ends - begins) / step if step > 0.0 else np.zeros_like(begins)
        temperatures[i + 1] = now + (begins - now) * caught_up + slope * lag * (elapsed - caught_up)
    return LinkWarmUp(robot, instants, around, temperatures)


def _over_time(robot: Robot, ambient: PerSegment, rows: int) -> Array:
    array = None if isinstance(ambient, Mapping) else np.asarray(ambient, dtype=float)
    # A row of T numbers is the hall's temperature over time, whatever the number of segments.
    if array is not None and array.ndim == 1:
        if len(array) != rows:
            raise RobotError(f"{len(array)} ambient temperatures do not fit {rows} times")
        ambient = array[:, None] * np.ones(len(per_segment(robot, 0.0, "")))
    values = per_segment(robot, ambient, "ambient temperature")
    if values.ndim > 2 or (values.ndim == 2 and len(values) != rows):
        raise RobotError(f"ambient temperatures of shape {values.shape} do not fit {rows} times")
    return np.broadcast_to(values, (rows, values.shape[-1])).copy()


Axes: TypeAlias = "str | Sequence[str]"
"""Letters among x, y and z that are measured at every pose, or a word of them for each pose."""

_RANK = 1e-9
# Singular values below this share of the largest are zero: between rounding and any geometry that can be built.
_LEAST_SHARE = 1e-6
# Of an unknown in what the system cannot see: a millimetre there would be a nanometre here.


def axes_of(axes: Axes, count: int) -> tuple[str, ...]:
    """Measured axes as one word of letters x, y, z for each of ``count`` poses; ``EstimationError`` if invalid."""
    words = (axes,) * count if isinstance(axes, str) else tuple(axes)
    if len(words) != count:
        raise EstimationError(f"measured axes are given for {len(words)} poses, but there are {count}")
    for word in words:
        if not word or set(word) - set("xyz") or len(set(word)) != len(word):
            raise EstimationError(f"the axes measured at a pose are some of the letters x, y and z, not {word!r}")
    return words


def measured(words: Sequence[str]) -> NDArray[np.bool_]:
    """Mask (N, 3) of the measured components x, y, z, from a word of these letters for each of N poses."""
    return np.array([[letter in word for letter in "xyz"] for word in words], dtype=bool).reshape(-1, 3)


def pseudo_inverse(system: Array) -> tuple[Array, int, NDArray[np.bool_]]:
    """Pseudo-inverse (S, m) of a system (m, S), its rank, and the mask (S,) of identified unknowns.

    By singular values above 1e-9 of the largest. An unknown is identified if its component in the null space is < 1e-6.
    """
    left, singular, right = np.linalg.svd(system, full_matrices=True)
    rank = int(np.sum(singular > _RANK * np.max(singular, initial=0.0)))
    known = np.linalg.norm(right[rank:], axis=0) < _LEAST_SHARE
    return (right[:rank].T / singular[:rank]) @ left[:, :rank].T, rank, np.asarray(known)


_CANDIDATES = 2000
_SWEEPS = 30


@dataclass(frozen=True, eq=False)
class BestPoses:
    """Optimal poses at which to measure elongations, from :func:`best_poses`.

    Parameters
    ----------
    q
        (count, n) rad or m.
    axes
        The components to measure at each pose.
    names
        S names of the segments with a length.
    errors
        (S,) standard error of each elongation for a standard deviation of 1 of every component: times σ in m it is
        in m. NaN where the poses do not determine it.
    condition
        Condition number of the system; infinite where something is not determined.
    """

    q: Array
    axes: tuple[str, ...]
    names: tuple[str, ...]
    errors: Array
    condition: float


def best_poses(
    robot: Robot,
    count: int,
    *,
    candidates: ArrayLike | int = _CANDIDATES,
    criterion: Literal["D", "A", "E"] = "D",
    axes: Axes = "xyz",
    seed: int = 0,
) -> BestPoses:
    """Optimal experimental design (D, A or E) of poses for measuring elongations: greedy choice, then exchanges.

    Parameters
    ----------
    robot
        The robot.
    count
        Number of poses.
    candidates
        (M, n) configurations to choose from, of which those outside the joint limits are left out; or how many to draw
        evenly within the limits (±π where there is none).
    criterion
        ``"D"``: the smallest volume of the confidence region; ``"A"``: the smallest mean variance; ``"E"``: the
        smallest variance of the worst combination. What no candidate determines is left out of all three.
    axes
        What is measured: letters for all poses, or a word for each, as for
        :func:`~thermal_robot.assembly.thermal.identify_elongations`.
    seed
        Seed of the random candidates.

    Returns
    -------
    BestPoses
        Different poses, except that one may come twice with different axes.

    Raises
    ------
    EstimationError
        If there are fewer candidates within the limits than poses, or the criterion or the axes are unknown.
    """
    if criterion not in ("D", "A", "E"):
        raise EstimationError(f"the criterion is D, A or E, not {criterion!r}")
    words, pool = axes_of(axes, count), _pool(robot, candidates, seed)
    if not 0 < count <= len(pool):
        raise EstimationError(f"{count} poses cannot be chosen from {len(pool)} candidates within the joint limits")
    jacobian = elongation_jacobian(robot, pool)
    # What no candidate shows is left out: an orthonormal basis of the rest.
    seen = jacobian[:, measured(words).any(axis=0)].reshape(-1, jacobian.shape[2])
    _, singular, right = np.linalg.svd(seen, full_matrices=False)
    basis = right[singular > _RANK * np.max(singular)].T
    rows = {word: jacobian[:, measured([word])[0]] @ basis for word in set(words)}
    chosen = np.array(_chosen({word: np.swapaxes(r, 1, 2) @ r for word, r in rows.items()}, words, criterion))
    system = jacobian[chosen][measured(words)]
    inverse, rank, known = pseudo_inverse(system)
    errors = np.where(known, np.linalg.norm(inverse, axis=1), np.nan)
    return BestPoses(pool[chosen], words, segment_names(robot), errors, _condition(system, rank))


def _pool(robot: Robot, candidates: ArrayLike | int, seed: int) -> Array:
    if isinstance(candidates, int):
        low, high = (np.where(np.isfinite(x), x, y) for x, y in ((robot.lower, -np.pi), (robot.upper, np.pi)))
        return np.random.default_rng(seed).uniform(low, high, (candidates, robot.n))
    rows = np.atleast_2d(np.asarray(candidates, dtype=float))
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise EstimationError(f"candidates of shape {rows.shape} do not fit: expected (M, {robot.n})")
    return rows[np.all((rows >= robot.lower) & (rows <= robot.upper), axis=1)]


def _chosen(information: dict[str, Array], words: tuple[str, ...], criterion: str) -> list[int]:
    """Row of the candidate for each pose, by greedy choice and then by exchanges of one pose while the criterion rises.

    The greedy choice goes by determinant, the one criterion that ranks underdetermined systems. ``information``: Gram
    matrices (M, k, k) of all candidates for each word of axes.
    """
    chosen: list[int] = []
    for slot in range(len(words)):
        chosen.append(int(np.argmax(_scores(information, words, chosen, slot, "D", 1e-6))))
    for _ in range(_SWEEPS):
        before = list(chosen)
        for slot in range(len(words)):
            # A little of everything keeps the criteria finite where fewer components than unknowns are measured.
            scores = _scores(information, words, chosen, slot, criterion, 1e-9)
            best = int(np.argmax(scores))
            if scores[best] > scores[chosen[slot]] + 1e-12 * abs(scores[best]):
                chosen[slot] = best
        if chosen == before:
            break
    return chosen


def _scores(
    information: dict[str, Array], words: tuple[str, ...], chosen: list[int], slot: int, criterion: str, least: float
) -> Array:
    """Optimality criterion (M,) of the design with each candidate at ``slot`` and the other poses as chosen.

    Log determinant (D), −trace of the inverse (A) or least eigenvalue (E) of the information; −inf for a repeated pose.
    """
    others = [(words[other], c) for other, c in enumerate(chosen) if other != slot]
    own = information[words[slot]]
    total = least * np.eye(own.shape[1])
    for word, c in others:
        total = total + information[word][c]
    with_each = total + own
    if criterion == "D":
        scores = np.linalg.slogdet(with_each)[1]
    elif criterion == "A":
        scores = -np.trace(np.linalg.inv(with_each), axis1=1, axis2=2)
    else:
        scores = np.linalg.eigvalsh(with_each)[:, 0]
    scores[[c for word, c in others if word == words[slot]]] = -np.inf
    return np.asarray(scores)


def _condition(system: Array, rank: int) -> float:
    return float(np.linalg.cond(system)) if rank == system.shape[1] else np.inf


@dataclass(frozen=True, eq=False)
class IdentifiedElongations:
    """Least-squares elongations of the S segments with a length, from m components; what is not identified is NaN.

    Parameters
    ----------
    names
        S names of segments.
    values, standard_errors
        (S,) m; standard errors are NaN too where the noise is neither given nor left over in the residuals.
    covariance
        (S, S) m².
    identified
        (S,) whether the measured components determine the elongation by themselves.
    condition
        Condition number of the m × S system, unweighted; infinite where something is not identified.
    rank
        Number of combinations of elongations that are determined.
    residuals
        (N, 3) m, measured − fitted; NaN where a component was not measured.
    """

    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    covariance: Array
    identified: NDArray[np.bool_]
    condition: float
    rank: int
    residuals: Array

    def __str__(self) -> str:
        width = max(len(name) for name in self.names)
        lines = [f"elongations from {int(np.sum(np.isfinite(self.residuals)))} components, µm:"]
        for name, value, error, known in zip(
            self.names, 1e6 * self.values, 1e6 * self.standard_errors, self.identified, strict=True
        ):
            spread = f"± {error:.2f}" if np.isfinite(error) else "(noise unknown)"
            lines.append(
                f"  {name:<{width}}  " + (f"{value:.2f} {spread}" if known else "not identified by these poses")
            )
        return "\n".join([*lines, f"  condition number {self.condition:.3g}"])


def identify_elongations(
    robot: Robot,
    q: ArrayLike,
    displacement: ArrayLike,
    *,
    axes: Axes = "xyz",
    sigma: ArrayLike | None = None,
    covariance: ArrayLike | None = None,
) -> IdentifiedElongations:
    """Weighted least squares for the elongations of Eq 12, from displacements measured at N poses.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m, held while the temperature changed.
    displacement
        (N, 3) m in the root frame; components that ``axes`` leaves out are not read.
    axes
        What was measured: letters for all poses, such as ``"xyz"``, or a word for each, such as
        ``("x", "x", "x", "x", "z")`` for the paper's Eq 12.
    sigma
        Standard deviation of a measured component, m: a number, (3,) or (N, 3). By default all have one unknown
        standard deviation, which is then taken from the residuals if there are more components than unknowns.
    covariance
        (3, 3) or (N, 3, 3) m² instead, where the components of a pose are correlated, such as
        :func:`~thermal_robot.assembly.repeatability.tool_covariance` over the number of repetitions.

    Returns
    -------
    IdentifiedElongations
        Values with standard errors, covariance, condition number and residuals.

    Raises
    ------
    EstimationError
        If shapes do not fit, a measured component or the noise is not finite, or both kinds of noise are given.
    """
    jacobian = elongation_jacobian(robot, q)
    moved = np.atleast_2d(np.asarray(displacement, dtype=float))
    if moved.shape != (len(jacobian), 3) or not len(jacobian):
        raise EstimationError(f"displacements of shape {moved.shape} do not fit: expected {(len(jacobian), 3)}")
    chosen = measured(axes_of(axes, len(moved)))
    if not np.all(np.isfinite(moved[chosen])):
        raise EstimationError("a measured component of a displacement is not a finite number")
    noise = _noise(len(moved), sigma, covariance)
    both, weighted = np.concatenate([jacobian, moved[..., None]], axis=2), []
    for pose, kept in enumerate(chosen):
        rows = both[pose, kept]
        weighted.append(rows if noise is None else np.linalg.solve(_root(noise[pose][np.ix_(kept, kept)]), rows))
    whole = np.concatenate(weighted)
    design, observed = whole[:, :-1], whole[:, -1]
    inverse, rank, known = pseudo_inverse(design)
    values, spread = inverse @ observed, inverse @ inverse.T
    if noise is None:
        freedom = len(observed) - rank
        spread = spread * (np.sum((observed - design @ values) ** 2) / freedom if freedom else np.nan)
    residuals = np.where(chosen, moved - jacobian @ values, np.nan)
    return IdentifiedElongations(
        segment_names(robot),
        np.where(known, values, np.nan),
        np.where(known, np.sqrt(np.diag(spread)), np.nan),
        np.where(np.outer(known, known), spread, np.nan),
        known,
        _condition(jacobian[chosen], rank),
        rank,
        residuals,
    )


def _noise(poses: int, sigma: ArrayLike | None, covariance: ArrayLike | None) -> Array | None:
    """Noise covariance (N, 3, 3) of the measured displacements, m²; None where neither form of it is given."""
    if sigma is not None and covariance is not None:
        raise EstimationError("give the noise as sigma or as a covariance, not as both")
    if covariance is not None:
        given = np.asarray(covariance, dtype=float)
        if given.shape not in ((3, 3), (poses, 3, 3)):
            raise EstimationError(f"a covariance of shape {given.shape} does not fit: expected {(poses, 3, 3)}")
        return np.broadcast_to(given, (poses, 3, 3))
    if sigma is None:
        return None
    deviations = np.asarray(sigma, dtype=float)
    if deviations.shape not in ((), (3,), (poses, 3)):
        raise EstimationError(f"sigma of shape {deviations.shape} does not fit: expected {(poses, 3)}")
    squares: Array = np.broadcast_to(deviations**2, (poses, 3))[:, :, None] * np.eye(3)
    return squares


def _root(covariance: Array) -> Array:
    """Cholesky factor of a pose's noise covariance; ``EstimationError`` unless finite and positive definite."""
    if not np.all(np.isfinite(covariance)):
        raise EstimationError("the noise of a measured component is not a finite number")
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=float)
    except np.linalg.LinAlgError as error:
        raise EstimationError("the covariance of a measured displacement is not positive definite") from error
