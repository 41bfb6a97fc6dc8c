"""What to enter in a controller as the zeros of its joints, of all that a model holds constant.

Where a model holds zero offsets, these are they. Where it holds geometry instead, a part of that is zeros: it is told
in other coordinates, the zeros first and then the errors of the axes after Denavit and Hartenberg, as the diagnosis
tells it (:mod:`thermal_robot.inference.inside`). What the unknown frames can take up nobody sees, and it is not told.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.correction.constant import Constant, constant, rows_of_every_kind
from thermal_robot.correction.determined import determined
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects import Parameter, at_joint, at_segment, gate
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.columns import frame_columns, moved_by
from thermal_robot.inference.inside import distinct, identified
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


_ROWS = 100
"""Of poses in which zeros are told from the rest of the geometry: as many as a good campaign has."""
_SEEN = settings.SEEN**0.5
"""Of the largest singular value: a direction below is an exact alias of the unknown frames, or of others."""
TOLD, UNSEEN, NONE = "determined", "not determined", "not in the model"
"""What may be said of a zero."""


def zero_offsets(
    model: CorrectedModel, *, temperature: float | None = None, min_sigma: float | None = None
) -> pd.DataFrame:
    """Return what to enter in a controller as the zeros of its joints.

    Parameters
    ----------
    model
        The corrected model.
    temperature, min_sigma
        As for :func:`~thermal_robot.correction.calibrated`.

    Returns
    -------
    pandas.DataFrame
        A row for each joint that is commanded. ``joint``; ``add_to_command``: the joint is where it was meant to be
        once this is added to its command (it stands at its command minus this); ``std``, one standard deviation, empty
        where the model does not tell; ``unit``, that of the joint's column in the campaign; ``zero``: ``determined``,
        ``not determined`` (the unknown base or tool can take it up, or the data leave half or more of the deviation
        that was expected before them: the rule by which a diagnosis calls a parameter identified) or
        ``not in the model``, both with an offset of 0.

    Raises
    ------
    CampaignError
        As :func:`~thermal_robot.correction.calibrated`.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import zero_offsets
    >>> off = {"joint_offset": {"joint_2": 1e-3}}
    >>> campaign = tr.simulate("builtin:rv_m2", off, tool_frame="tool0", rows=40, noise=1e-5, base_known=False)
    >>> table = zero_offsets(tr.diagnose(campaign).model)
    >>> table["zero"][1], round(float(table["add_to_command"][1]), 4)
    ('determined', -0.001)
    """
    import pandas as pd

    if min_sigma is not None:
        model = determined(model, min_sigma, temperature)[0]
    known = constant(model, temperature)
    used = np.flatnonzero(
        known.responses[:, :-12].any(axis=1) & np.array([t.value != 0.0 for t in known.parameters], dtype=bool)
    )
    change, said = _coordinates(model, known, used)
    units, robot = model.settings.units, model.robot
    scales = np.array([units.joint_scale(kind) for kind in robot.joint_types])
    values = change @ np.array([known.parameters[k].value for k in used])
    std, expected = _deviations(model, known, used, change)
    told = np.array([word == TOLD for word in said]) & (np.isnan(std) | identified(std, expected))
    said = [UNSEEN if word == TOLD and not own else word for word, own in zip(said, told, strict=True)]
    return pd.DataFrame(
        {
            "joint": robot.joint_names,
            "add_to_command": np.where(told, -values, 0.0) / scales + 0.0,
            "std": np.where(told, std, np.nan) / scales,
            "unit": [units.joint_unit(kind) for kind in robot.joint_types],
            "zero": said,
        }
    )


def _deviations(model: CorrectedModel, known: Constant, used: NDArray[np.int64], change: Array) -> tuple[Array, Array]:
    """(n,) standard deviation of each joint's zero, NaN where the model does not tell, and what it was before the data.

    A model of an older program does not say how large its parameters were expected to be: the effects do.
    """
    spread, count = model.spread, len(known.parameters)
    if spread is None or len(spread.covariance) < count:
        return np.full(len(change), np.nan), np.full(len(change), np.nan)
    numbers = len(spread.covariance) - count + used
    variance = (change @ spread.covariance[np.ix_(numbers, numbers)] * change).sum(axis=1)
    prior = spread.prior
    if prior is None or len(prior) != count:
        seen = rows_of_every_kind(model)
        prior = np.array([p.size for effect, _ in model.effects for p in gate.checked(effect, seen)])
    return np.sqrt(np.maximum(variance, 0.0)), np.linalg.norm(change * prior[used], axis=1)


def _coordinates(model: CorrectedModel, known: Constant, used: NDArray[np.int64]) -> tuple[Array, list[str]]:
    """Return (n, U) the zero of each joint a unit of each used parameter, and what is said of each zero."""
    robot, observations = model.robot, rows_of_every_kind(model, rows=_ROWS)
    own = [_acting(robot, known, int(k)) for k in used]
    zeros = [Parameter("zero", "", 1.0, "joint", name, (at_joint(j, 1.0),)) for j, name in enumerate(robot.joint_names)]
    rest = [p for effect, _ in model.effects for p in gate.independent(effect, observations)]
    frames = frame_columns(observations)[0]
    equations = frames.shape[0] * frames.shape[1]
    frames = frames.reshape(equations, -1) if frames.size else np.zeros((equations, 0))
    whole = moved_by(observations, [*zeros, *rest, *own]).reshape(equations, -1)
    length = np.linalg.norm(whole, axis=0) + settings.TINY
    left = (without(whole, orthonormal(frames)) if frames.size else whole) / length
    # what moves the target by rounding alone is hidden, too: a joint on whose axis it sits
    hidden = (np.linalg.norm(left, axis=0) < _SEEN) | (length < _SEEN * length.max(initial=0.0))
    change, said = np.zeros((robot.n, len(own))), [UNSEEN if unseen else NONE for unseen in hidden[: robot.n]]
    if not own or hidden[-len(own) :].all():
        return change, said
    basis, size, turn = np.linalg.svd(left[:, -len(own) :], full_matrices=False)
    seen = size > _SEEN * size[0]
    # what each is in the directions of the constants that can be seen, if it is nothing beside them
    inside = basis[:, seen].T @ left
    within = ~hidden & (np.linalg.norm(left - basis[:, seen] @ inside, axis=0) < _SEEN)
    across = inside / size[seen, None]
    chosen = distinct(across / (np.linalg.norm(across, axis=0) + settings.TINY), within)
    of_each = np.linalg.pinv(across[:, chosen]) @ turn[seen] * length[-len(own) :] / length[chosen, None]
    for row, j in zip(of_each, chosen, strict=True):
        if j < robot.n:
            change[j], said[j] = row, TOLD
    return change, said


def _acting(robot: Robot, known: Constant, k: int) -> Parameter:
    """Return a constant with what it does in joints and segments alone."""
    joints, twists = known.responses[k, : robot.n], known.responses[k, robot.n : -12].reshape(-1, 6)
    turned = [at_joint(int(j), joints[j]) for j in np.flatnonzero(joints)]
    placed = [at_segment(int(s), twists[s]) for s in np.flatnonzero(twists.any(axis=1))]
    return Parameter(known.parameters[k].parameter, "", 1.0, "link", "", (*turned, *placed))
