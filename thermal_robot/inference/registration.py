"""Registration: fit of the unknown base and tool frames, before any effect.

The rigid alignment of the base and the linear fit of the target's place alternate, robust to a third of gross errors.
Starts run side by side, each until its own median distance converges, independently of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations, product
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import POSITION
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve
from thermal_robot.inference.columns import frame_columns, unknown_frames
from thermal_robot.kinematics import align, exp6, quaternion_to_rotation, tool_poses
from thermal_robot.observables import Observable, instrument_rows, kinds_of, tool_width
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import Robot

CUBE = [
    np.asarray(turn)
    for axes in permutations(np.eye(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(turn := np.array(axes) * np.array(signs)[:, None]) > 0.0
]
"""The 24 rotations of a cube: no rotation is farther than 63° from the nearest of them."""


class BaseAndTarget(NamedTuple):
    """Poses of base and target, (..., 4, 4) each, for data sets side by side."""

    base: Array
    tool: Array


class PoseProtocol(Protocol):
    """Protocol of commands paired with measurements; see :class:`~thermal_robot.campaign.Campaign`."""

    @property
    def robot(self) -> Robot: ...  # noqa: D102
    @property
    def q(self) -> Array: ...  # noqa: D102
    @property
    def position(self) -> Array | None: ...  # noqa: D102
    @property
    def orientation(self) -> Array | None: ...  # noqa: D102
    @property
    def simulated_position(self) -> Array | None: ...  # noqa: D102
    @property
    def base_known(self) -> bool: ...  # noqa: D102
    @property
    def tool_known(self) -> bool: ...  # noqa: D102


def starts(campaign: PoseProtocol) -> Array:
    """Return the initial shifts (S, 3) of the target, m, for :func:`alternate`: zero first, alone if it is known."""
    fixed = campaign.tool_known or campaign.simulated_position is not None
    return settings.TARGET_STARTS[:1] if fixed else settings.TARGET_STARTS


def cauchy_weights(distance: Array) -> Array:
    """Cauchy weights of distances (..., N) at the scale of their median, robust to a third of gross errors."""
    scale = settings.CAUCHY_SCALE * middle(distance)[..., None] + settings.UNSEEN
    return np.asarray(1.0 / (1.0 + (distance / scale) ** 2))


def middle(values: Array) -> Array:
    """Median (...) along the last axis of finite values (..., N); faster than NumPy's, which checks for NaN."""
    half, odd = divmod(values.shape[-1], 2)
    parted = np.partition(values, half if odd else (half - 1, half), axis=-1)
    return np.asarray(parted[..., half] if odd else 0.5 * (parted[..., half - 1] + parted[..., half]))


def alternate(
    campaign: PoseProtocol,
    declared: Frames,
    targets: Array,
    rounds: int = settings.START_ROUNDS,
    some: NDArray[np.int64] | slice = slice(None),
    poses: Array | None = None,
) -> tuple[Array, BaseAndTarget]:
    """Robust registration by alternation: rigid alignment of the base, then linear fit of the target's place.

    Targets (..., S, 3), m in the tool frame, are S starts; the columns of the campaign may have several in front (...,
    N), which go side by side; ``poses`` (..., N, 4, 4) are the tool frame's in the rows ``some``. Returns the smallest
    of the starts' median distances (...), m, and the frames of that start.
    """
    lead, many = campaign.q.shape[:-2], targets.shape[-2]
    measured, turns = np.asarray(campaign.position)[..., some, :], None
    if campaign.simulated_position is not None:
        origin = campaign.simulated_position[..., some, :]
    else:
        poses = tool_poses(campaign.robot, campaign.q[some]) if poses is None else poses
        origin, turns = poses[..., :3, 3], poses[..., :3, :3]

    def repeated(own: Array, axes: int) -> Array:
        """Return the data repeated (S, ...) for each start; unchanged without leading axes."""
        if not lead:
            return own
        shape = own.shape[own.ndim - axes :]
        return np.repeat(np.broadcast_to(own, (*lead, *shape)).reshape(-1, *shape), many, axis=0)

    begun = np.broadcast_to(declared.tool[:3, 3] if campaign.tool_known else targets, (*lead, many, 3)).reshape(-1, 3)
    several = None if turns is None else repeated(turns, 3)
    known = campaign.base_known, campaign.tool_known
    found = _alternated(repeated(measured, 2), repeated(origin, 2), several, declared.base, begun, known, rounds)
    best = np.arange(0, len(begun), many) + found[3].reshape(-1, many).argmin(axis=1)
    base, place, weights, cost = (own[best].reshape((*lead, *own.shape[1:])) for own in found)
    tool = np.broadcast_to(declared.tool, base.shape).copy()
    tool[..., :3, 3] = place
    if campaign.orientation is not None and turns is not None and not campaign.tool_known:
        tool[..., :3, :3] = _turn(turns, base, quaternion_to_rotation(campaign.orientation[..., some, :]), weights)
    return cost[()], BaseAndTarget(base, tool)


def _turn(turns: Array, base: Array, measured: Array, weights: Array) -> Array:
    """Weighted mean rotation (..., 3, 3) of the target on the tool frame (SVD), weights (..., N)."""
    seen = turns.swapaxes(-1, -2) @ base[..., None, :3, :3].swapaxes(-1, -2) @ measured
    u, _, vt = np.linalg.svd(np.einsum("...n,...nij->...ij", weights, seen))
    upright = np.ones(u.shape[:-1])
    upright[..., 2] = np.linalg.det(u @ vt)
    return np.asarray((u * upright[..., None, :]) @ vt)


def _alternated(
    measured: Array,
    origin: Array,
    turns: Array | None,
    base: Array,
    place: Array,
    known: tuple[bool, bool],
    rounds: int,
) -> tuple[Array, Array, Array, Array]:
    """Alternation from S starts side by side: bases (S, 4, 4), targets (S, 3), weights (S, N), medians (S,).

    Measured points and origins (N, 3) and turns (N, 3, 3) of the tool frame are those of all starts, or have the S in
    front; ``known``: base and tool.
    """
    bases, places, costs = np.repeat(base[None], len(place), axis=0), place.copy(), np.full(len(place), np.inf)
    weights, moving = np.ones((len(place), measured.shape[-2])), np.arange(len(place))
    for _ in range(rounds):
        base, place, weight = bases[moving], places[moving], weights[moving]
        seen, start = (own if own.ndim == 2 else own[moving] for own in (measured, origin))
        turn = turns if turns is None or turns.ndim == 3 else turns[moving]
        if not known[0]:
            base = align(_predicted(start, turn, place), seen, weight)
        rotation, shift = base[:, :3, :3], base[:, None, :3, 3]
        if turn is not None and not known[1]:
            # (measured in the root frame − origin) = R t: the mean over rows of Rᵀ(…), since each R is orthogonal
            local = np.einsum("...nji,...nj->...ni", turn, (seen - shift) @ rotation - start)
            place = (weight[:, None] @ local)[:, 0] / weight.sum(axis=1)[:, None]
        away = seen - _predicted(start, turn, place) @ rotation.transpose(0, 2, 1) - shift
        distance = np.sqrt((away * away).sum(axis=2))
        before, cost = costs[moving], middle(distance)
        bases[moving], places[moving], costs[moving], weights[moving] = base, place, cost, cauchy_weights(distance)
        moving = moving[~(np.abs(before - cost) < settings.START_SETTLED * cost)]
        if not len(moving):
            break
    return bases, places, weights, costs


def _predicted(origin: Array, turns: Array | None, place: Array) -> Array:
    """Predicted positions of the target (S, N, 3) in the root frame, or the simulator's prediction."""
    if turns is None:
        return np.broadcast_to(origin, (len(place), *origin.shape[-2:]))
    return np.asarray(origin + (turns @ place[:, None, :, None])[..., 0])


def register(campaign: Campaign, keep: NDArray[np.bool_] | None = None) -> Frames:
    """Register the unknown frames at the nominal robot; known frames stay as declared.

    Alternates the rigid alignment of the base with the linear fit of the target's place, from several starts (the
    target may sit 0.3 m from the tool frame), on a sample of the rows, robustly; then Gauss-Newton on all rows, or by
    least squares on those of ``keep`` (N,). Raises :class:`EstimationError` if fewer than three rows have weight.
    """
    if frames_known(campaign):
        return Frames.declared(campaign)
    used = campaign if keep is None or keep.all() else campaign.take(np.flatnonzero(keep))
    if used is not campaign and campaign.position is None:  # rows that are kept may not say where each artefact is
        return refined_frames(used, register(campaign), robust=False)
    return refined_frames(used, found_frames(used), robust=keep is None)


def frames_known(campaign: Campaign) -> bool:
    """Tell whether no frame or artefact has to be fitted: base declared, and tool declared or held by a simulator."""
    if campaign.position is None and campaign.measured and unknown_frames(campaign):
        return False
    return campaign.base_known and (campaign.tool_known or campaign.simulated_position is not None)


def found_frames(campaign: Campaign) -> Frames:
    """Return frames registered robustly on a sample of rows, close enough to linearise; declared ones stay.

    Raises :class:`EstimationError` for fewer than three rows of positions.
    """
    frames, rows = Frames.declared(campaign), campaign.samples
    if campaign.position is None:
        return _turned(campaign, _found_by_instrument(campaign, frames))
    if rows < 3:
        raise EstimationError("at least three rows are needed to fit the unknown frames")
    some = np.linspace(0, rows - 1, min(rows, settings.START_ROWS)).astype(np.int64)
    return Frames(*alternate(campaign, frames, frames.tool[:3, 3] + starts(campaign), some=some)[1])


def _found_by_instrument(campaign: Campaign, frames: Frames) -> Frames:
    """Register the base on the rows that an instrument measured; with fewer than three it stays as declared."""
    rows = np.flatnonzero(instrument_rows(campaign))
    if campaign.base_known or len(rows) < 3:
        return frames
    some, places = campaign.take(rows), np.column_stack([campaign.readings[axis][rows] for axis in POSITION])
    found = found_frames(replace(some, position=places, readings={}))
    return found if not campaign.tool_known else replace(found, tool=frames.tool)


def _turned(campaign: Campaign, frames: Frames) -> Frames:
    """Register the rotation of the target on the tool, if measured, from the best of the 24 rotations of a cube."""
    if campaign.tool_known or tool_width(campaign) == 3:
        return frames
    some, found = campaign.take(_some(campaign)), list[tuple[float, Frames]]()
    for turn in CUBE:
        tool = frames.tool.copy()
        tool[:3, :3] = turn
        begun = replace(frames, tool=tool)
        with np.errstate(invalid="ignore", divide="ignore"):
            found.append((_median_distance(some, begun), begun))
    nearest = sorted(found, key=lambda one: one[0])[: settings.TURNS_TRIED]
    tried = [refined_frames(some, begun, robust=True) for _, begun in nearest]
    best = min(tried, key=lambda one: _median_distance(some, one))
    return replace(best, artefacts={})


def _some(campaign: Campaign) -> NDArray[np.int64]:
    """Rows to start with, evenly from those of each kind and artefact, and of each enough to place it."""
    groups = rows_of_artefacts(campaign)
    each = settings.START_ROWS // len(groups)
    counts = [min(len(rows), max(each, own.fewest)) for own, rows in groups]
    evenly = (rows[np.linspace(0, len(rows) - 1, n).astype(int)] for n, (_, rows) in zip(counts, groups, strict=True))
    return np.sort(np.concatenate([*evenly]))


def rows_of_artefacts(campaign: Campaign) -> list[tuple[Observable, NDArray[np.int64]]]:
    """Return kind and row numbers of each kind of measurement and artefact; all rows at once where there is one."""
    found = list[tuple[Observable, NDArray[np.int64]]]()
    for own, rows in kinds_of(campaign):
        rows = np.arange(campaign.samples) if rows is None else rows
        number = campaign.numbered[own.label][1][rows] if own.label else np.zeros(len(rows))
        found += [(own, rows[number == k]) for k in np.unique(number)]
    return found


def _robust_weights(distance: Array, groups: Sequence[NDArray[np.int64]]) -> Array:
    """Cauchy weights (N,) at the median of each group: rows of an artefact that starts astray bring it back."""
    weights = np.empty_like(distance)
    for rows in groups:
        weights[rows] = cauchy_weights(distance[rows])
    return weights


def _median_distance(campaign: Campaign, frames: Frames) -> float:
    """Return the median residual distance with given frames, m; infinite where it is NaN."""
    distance = float(np.median(np.linalg.norm(observe(campaign, frames).gap, axis=1)))
    return distance if np.isfinite(distance) else np.inf


def moved(frames: Frames, step: Array, names: tuple[str, ...]) -> Frames:
    """Apply a step (f,) of the parameters of :func:`~thermal_robot.inference.columns.frame_columns` to the frames."""
    own = np.array(names, dtype=object)
    base_step, tool_step = (step[own == name] for name in ("base", "tool"))
    shared = {name: each for name, each in frames.artefacts.items() if name in names}
    artefacts = {name: each.moved(step[own == name]) for name, each in shared.items()}
    base = frames.base @ exp6(base_step) if base_step.size else frames.base
    turn = exp6(np.concatenate([tool_step, np.zeros(6 - tool_step.size)])) if tool_step.size else np.eye(4)
    return Frames(base, turn @ frames.tool, {**frames.artefacts, **artefacts})


def refined_frames(campaign: Campaign, frames: Frames, robust: bool) -> Frames:
    """Gauss-Newton registration of positions and orientations, each scaled by its median; noisy rows weigh less.

    Rows have Cauchy weights where ``robust``, equal weights otherwise.
    """
    relative = np.ones((1, 1)) if campaign.relative_noise is None else campaign.relative_noise
    groups = [rows for _, rows in rows_of_artefacts(campaign)]
    for _ in range(settings.START_ROUNDS):
        observations = observe(campaign, frames)
        (columns, names), gap = frame_columns(observations), observations.gap
        root_weight = np.zeros_like(gap)
        for part in (slice(0, 3), slice(3, 6))[: gap.shape[1] // 3]:
            distance = np.linalg.norm(gap[:, part], axis=1)
            weight = np.sqrt(_robust_weights(distance, groups)) if robust else np.ones(len(distance))
            root_weight[:, part] = weight[:, None] / (middle(distance) + settings.UNSEEN)
        root_weight = root_weight / relative
        design = equations_of(columns * root_weight[:, :, None])
        step = solve(design.T @ design, design.T @ (gap * root_weight).ravel())
        frames = moved(observations.frames, step, names)
        if np.abs(step).max() < settings.ROUNDING:
            break
    return frames
