"""The corrected model: nominal robot, frames and effects; predicts, corrects commands, saved as JSON.

Samples to predict are made from a table or from arrays and conditions, and must bring what the model needs.

**Commands** are joint positions at which the tool of the robot as it really is reaches the nominal poses. The nominal
pose of a row is where the nominal robot would bring the target at the row's joint positions, p₀(q₀), in the root frame,
on the target as it was fitted. The real robot brings it to p(q) = p₀ displaced by all that the effects do in the chain,
at the row's conditions. Wanted is the q with p(q) = p₀(q₀).

What displaces the base counts too (a pedestal that yields, drift): the pose is meant where the base was when the frames
were fitted. What an instrument adds does not: its scale says nothing of where the tool is, and a robot that was moved
for it would miss. Where a campaign brought the predictions of a simulator, what the simulator says at q is taken to
differ from what it said at q₀ as the URDF's poses do.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, Settings, names, read_samples, read_table, with_commands, with_prediction
from thermal_robot.campaign.campaign import read_alike
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.units import SI
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import depends_on, displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.files import write_text
from thermal_robot.kinematics import (
    Displacement,
    inverse_kinematics,
    nearest_postures,
    rotation_to_quaternion,
    tool_poses,
)
from thermal_robot.model_file import fields_of, read, written
from thermal_robot.observations import Frames, Observations, observe
from thermal_robot.prediction import FileGap, Prediction, Spread
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


MISSED = 1e-7
"""m; a command that brings the target no nearer does not reach the pose: a hundredth of what any tracker sees."""
ROUNDED = 1e-9
"""rad, m by which a position may lie beyond its limit as it was rounded; less than a hundredth of :data:`MISSED`."""
ORTHOGONAL = 1e-6
"""By which the axes of a pose may fail to be orthogonal and of length one: rounding to six digits."""
FARTHEST = {"revolute": 0.2, "continuous": 0.2, "prismatic": 0.05}
"""rad, m; a joint goes no farther from its nominal position: ten times the largest errors of robots. What asks for more
lies at a singular pose, or is another posture, whose way there nobody has looked at."""


@dataclass(frozen=True, eq=False)
class Commands:
    """Corrected joint commands, with the uncertainty and the error of direction that remain.

    Attributes
    ----------
    q
        (N, n) rad or m, in the chain's order, within the joints' limits.
    std
        (N, 3) one standard deviation per axis of where the target will be, measurement frame, m; NaN for a model
        without :attr:`CorrectedModel.spread`.
    outside
        Per row: names of the joints and columns whose values are outside the measured range.
    direction
        (N,) rad by which the direction of the target is missed: 0 but for rounding, unless the arm has fewer than six
        joints, or stands at a singular pose or at a limit.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> commands = tr.diagnose(campaign).model.corrected_commands(campaign.take([0, 1]))
    >>> commands.q.shape, commands.std.shape, commands.outside
    ((2, 5), (2, 3), ((), ()))
    """

    q: Array
    std: Array
    outside: tuple[tuple[str, ...], ...]
    direction: Array


def _nominal_positions(robot: Robot, frames: Frames, poses: ArrayLike) -> Array:
    """Nominal inverse kinematics: joint positions (N, n), rad or m, for target poses (N, 4, 4), root frame.

    A pose out of reach is an error with its row, counted from 1.
    """
    expected = "an array (N, 4, 4) of poses, m"
    try:
        wanted = np.asarray(poses, dtype=float)
    except (TypeError, ValueError) as error:
        raise CampaignError("<poses>", "these are no poses", found=str(error), expected=expected) from error
    turns = wanted[..., :3, :3]
    if wanted.shape[1:] != (4, 4) or not np.allclose(turns @ turns.swapaxes(-1, -2), np.eye(3), atol=ORTHOGONAL):
        raise CampaignError("<poses>", "these are no poses", found=f"shape {wanted.shape}", expected=expected)
    found = nearest_postures(robot, wanted, tool=frames.tool)
    missed = np.flatnonzero(~(found.miss <= MISSED))
    if missed.size:
        left = f"{1e3 * found.miss[missed[0]]:.3g} mm are left"
        raise CampaignError("<poses>", "out of reach for the nominal robot", row=int(missed[0]) + 1, found=left)
    return found.q


def _require_within_limits(samples: Campaign, q: Array) -> None:
    """Raise ``CampaignError`` for the first row whose solved commands (N, n) lie beyond a joint limit."""
    robot = samples.robot
    wrong = np.argwhere(np.maximum(robot.lower - q, q - robot.upper) > ROUNDED)
    if len(wrong):
        row, joint = (int(k) for k in wrong[0])
        more = len(np.unique(wrong[:, 0])) - 1
        low, high = (_in_units(samples, joint, end[joint]) for end in (robot.lower, robot.upper))
        raise CampaignError(
            samples.name,
            "the joint cannot stand beyond its limit" + (f", nor in {more} more rows" if more else ""),
            row=int(samples.rows[row]),
            column=robot.joint_names[joint],
            found=_in_units(samples, joint, samples.q[row, joint]),
            expected=f"a position from {low} to {high} (arrays are in rad and m)",
        )


def _in_units(samples: Campaign, joint: int, position: float) -> str:
    """Position of a joint in the campaign's unit, and in SI where that differs."""
    kind = samples.robot.joint_types[joint]
    units = dict.fromkeys((samples.units, SI))
    own, *si = dict.fromkeys(f"{position / u.joint_scale(kind):.6g} {u.joint_unit(kind)}" for u in units)
    return f"{own} ({si[0]})" if si else own


_NAME = "<conditions>"
"""What samples from arrays are called in messages."""


def _depends(effect: Effect, seen: Observations, column: str) -> bool:
    try:
        return column in depends_on(effect, seen)
    except EffectError:  # it may refuse such values: then it reads them
        return True


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedModel:
    """Fitted error model of a robot: nominal robot, fitted base and tool frames, and effects with parameter values.

    Attributes
    ----------
    robot, settings
        The nominal robot, and the declarations of the campaign it was fitted to (units, frames, payload).
    frames
        Fitted base and tool.
    effects
        Each effect of the fit with the (P,) values of its parameters, SI.
    measures
        ``position`` or ``pose``.
    needs
        Columns that samples must have, besides the joints.
    simulated
        Whether the nominal prediction is that of the user's own simulator (``sim.*``).
    last_order
        First and last ``order`` of the campaign, where it had that column.
    spread
        Predictive uncertainty; ``None`` for a file of version 0.2, which lacks it.
    files
        Expected gap with the robot files that can be made of it; empty where nobody asked.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> model = tr.diagnose(tr.demo_campaign()).model
    >>> model, model.measures
    (CorrectedModel('rv_m2': backlash, thermal_elongation), 'position')
    """

    robot: Robot
    settings: Settings
    frames: Frames
    effects: tuple[tuple[Effect, Array], ...]
    measures: str
    needs: tuple[str, ...] = ()
    simulated: bool = False
    last_order: tuple[float, float] | None = None
    spread: Spread | None = None
    files: tuple[FileGap, ...] = ()

    def predict(
        self,
        samples: Campaign | str | Path | pd.DataFrame | ArrayLike,
        conditions: Mapping[str, ArrayLike] | None = None,
    ) -> pd.DataFrame:
        """Predict measured poses as a data frame, whatever the samples are; :meth:`prediction` returns arrays in SI.

        Parameters
        ----------
        samples
            Commands and conditions; measurements, if any, are ignored. A campaign; a table, or the path of one, read as
            by :meth:`samples`; or an array (N, n) of joint positions, rad or m.
        conditions
            With an array: by column name, one value for all rows or (N,), SI: ``{"temperature": 24.0}``.

        Returns
        -------
        pandas.DataFrame
            The samples' own columns and the predicted ones, in the units of the campaign: see :meth:`predicted`.

        Raises
        ------
        CampaignError
            If a column that the model needs is missing or has an empty cell, which the error names; if a value is so
            large that no finite position follows.
        EffectError
            If an effect of the model cannot be evaluated in these rows.

        Examples
        --------
        >>> model, campaign = tr.diagnose(tr.demo_campaign()).model, tr.demo_campaign()
        >>> model.predict(campaign)[["x", "y", "z", "std.x"]].shape
        (120, 4)
        >>> still = {**dict.fromkeys(model.needs, 0.0), "temperature": 24.0}
        >>> model.predict([[0.1, 0.2, -0.3, 0.4, 0.5]], still)[["x", "y", "z"]].round(1).to_numpy().tolist()
        [[-1518.3, -234.3, -590.4]]
        """
        given: Any = samples
        if isinstance(samples, (np.ndarray, list, tuple)):
            given = self.samples_at(samples, conditions)
        elif conditions is not None:
            expected = "an array of joint positions; a table has them in its columns"
            raise CampaignError("predict(), conditions", "are of use with an array only", expected=expected)
        if isinstance(given, (str, os.PathLike)):
            given = read_table(Path(given))
        rows = given if isinstance(given, Campaign) else self.samples(given)
        if isinstance(given, Campaign):
            given = rows.to_frame()
        elif isinstance(given, Table):
            given = given.frame(numbers=True)
        return with_prediction(given, self.robot, *self.prediction(rows), rows.units)

    def predicted(self, samples: pd.DataFrame, prediction: Prediction) -> pd.DataFrame:
        """Return the samples with predicted columns, in the units of the campaign.

        Parameters
        ----------
        samples
            Their own columns are kept as they stand, but for those of measurements.
        prediction
            Prediction of these samples.

        Returns
        -------
        pandas.DataFrame
            Samples with columns x y z, qw qx qy qz where the campaign measured orientation, std.x std.y std.z, and
            ``outside``: columns in which the row leaves the measured range, separated by blanks.

        Examples
        --------
        >>> model, table = tr.diagnose(tr.demo_campaign()).model, tr.demo_campaign().to_frame()
        >>> list(model.predicted(table, model.prediction(table)).columns[-7:])
        ['x', 'y', 'z', 'std.x', 'std.y', 'std.z', 'outside']
        """
        return with_prediction(samples, self.robot, *prediction, self.settings.units)

    def prediction(self, samples: Campaign | str | Path | pd.DataFrame, *, noise: bool = False) -> Prediction:
        """Predict measured positions (and orientations) with standard deviations, as arrays in SI.

        Parameters
        ----------
        samples
            As for :meth:`predict`.
        noise
            Whether the standard deviations include the instrument's noise, so that they are those of a measurement.

        Raises
        ------
        CampaignError
            As :meth:`predict`.

        Examples
        --------
        >>> prediction = tr.diagnose(tr.demo_campaign()).model.prediction(tr.demo_campaign())
        >>> bool(prediction.std.max() < 1e-4)
        True
        """
        samples = self._ready(samples)
        nominal = observe(samples, self.frames)
        moved, instrument = displacement(nominal, self.effects)
        corrected = observe(samples, self.frames, displacement=moved)
        position = corrected.predicted_position + (0.0 if instrument is None else instrument)
        wrong = np.flatnonzero(~np.isfinite(position).all(axis=1))
        if wrong.size:
            row = int(samples.rows[wrong[0]])
            raise CampaignError(samples.name, "the values of this row lead to no finite position", row=row)
        turned = self.measures == "pose"
        orientation = rotation_to_quaternion(self.frames.base[:3, :3] @ corrected.rotation) if turned else None
        if self.spread is None:
            return Prediction(position, orientation, np.full_like(position, np.nan), ((),) * len(position))
        outside = self.spread.outside(samples, self.effects)
        std = self.spread.std(corrected, self.effects, outside, noise)
        return Prediction(position, orientation, std, outside)

    def corrected_commands(
        self,
        poses: Campaign | str | Path | pd.DataFrame | ArrayLike,
        conditions: Mapping[str, ArrayLike] | None = None,
    ) -> Commands:
        """Joint positions at which the corrected model brings the target to the nominal poses (inverse kinematics).

        Parameters
        ----------
        poses
            Nominal joint positions: a table, or the path of one, read as by :meth:`samples`, with the conditions of
            each row in its columns; or an array (N, n), rad or m; or (N, 4, 4), poses of the target in the root frame,
            m, of which each is reached in the posture nearest to the middle of the joints' limits.
        conditions
            With an array: by column name, one value for all rows or (N,), SI: ``{"temperature": 24.0}``.

        Returns
        -------
        Commands
            Joint positions, how far from the nominal pose the target may be then, and what of its direction is missed.
            An arm with more than six joints stays near its nominal position; one with fewer brings the point to its
            place, and turns the target as near as it can.

        Raises
        ------
        CampaignError
            As :meth:`predict`; and if a pose is out of reach for the real robot, whose row is named.

        Examples
        --------
        >>> model = tr.diagnose(tr.demo_campaign()).model
        >>> warm = {**dict.fromkeys(model.needs, 1.0), "temperature": 26.0}
        >>> model.corrected_commands([[0.1, 0.2, -0.3, 0.4, 0.5]], warm).q.round(4).tolist()
        [[0.1, 0.2016, -0.3037, 0.4023, 0.5]]
        """
        if conditions is None and not isinstance(poses, (np.ndarray, list, tuple)):
            return self._commands(self._ready(poses))
        if np.asarray(poses, dtype=object).ndim == 3:
            poses = _nominal_positions(self.robot, self.frames, poses)  # type: ignore[arg-type]
        return self._commands(self._ready(self.samples_at(poses, conditions)))

    def commanded(self, samples: pd.DataFrame, commands: Commands) -> pd.DataFrame:
        """Return the samples with corrected commands as joint positions, in the units of the campaign.

        Parameters
        ----------
        samples
            Their other columns are kept as they stand, but for those of measurements.
        commands
            Corrected commands of these samples.

        Returns
        -------
        pandas.DataFrame
            Samples with corrected joint positions and the columns std.x std.y std.z, ``outside``: columns in which the
            row leaves the measured range, separated by blanks, and ``miss.direction``: error angle of the target's
            direction.

        Examples
        --------
        >>> model, table = tr.diagnose(tr.demo_campaign()).model, tr.demo_campaign().to_frame().head(2)
        >>> model.commanded(table, model.corrected_commands(table)).shape
        (2, 18)
        """
        q, std, outside, missed = commands.q, commands.std, commands.outside, commands.direction
        return with_commands(samples, self.robot, q, std, outside, missed, self.settings.units)

    def _commands(self, samples: Campaign) -> Commands:
        """Solve the inverse kinematics of the displaced robot; ``CampaignError`` for limits and unreachable poses."""
        robot, frames, effects = samples.robot, self.frames, self.effects
        farthest = np.array([FARTHEST[kind] for kind in robot.joint_types])
        # a row beyond a limit is solved as it stands; the correction may bring it back
        low = np.minimum(np.maximum(samples.q - farthest, robot.lower), samples.q)
        high = np.maximum(np.minimum(samples.q + farthest, robot.upper), samples.q)

        def at(q: Array) -> Campaign:
            return replace(samples, q=q, travelled=samples.since_turn)

        def displaced(q: Array) -> Displacement:
            return displacement(observe(at(q), frames), effects)[0]

        wanted = tool_poses(robot, samples.q) @ frames.tool
        found = inverse_kinematics(robot, wanted, samples.q, tool=frames.tool, displaced=displaced, within=(low, high))
        _require_within_limits(samples, found.q)
        missed = np.flatnonzero(~(found.miss <= MISSED))
        if missed.size:
            row, more = int(missed[0]), f", and so are {missed.size - 1} more rows" if missed.size > 1 else ""
            raise CampaignError(
                samples.name,
                f"the pose of this row is out of reach for the real robot{more}",
                row=int(samples.rows[row]),
                found=f"{1e3 * found.miss[row]:.3g} mm are left",
                expected="a pose within the limits, and away from singular ones",
            )
        q = np.clip(found.q, robot.lower, robot.upper)
        if self.spread is None:
            return Commands(q, np.full((samples.samples, 3), np.nan), ((),) * samples.samples, found.turned)
        outside = self.spread.outside(at(q), effects)
        std = self.spread.std(observe(at(q), frames, displacement=displaced(q)), effects, outside, noise=False)
        return Commands(q, std, outside, found.turned)

    def samples_at(self, q: Any, conditions: Mapping[str, ArrayLike] | None = None) -> Campaign:
        """Return the samples to predict, from arrays instead of a table.

        Parameters
        ----------
        q
            (N, n) joint positions, rad or m; (n,) counts as one row.
        conditions
            Conditions by column name, one value for all rows or (N,), SI.

        Raises
        ------
        CampaignError
            If an array does not fit or is not one of numbers; if the name of a condition is unknown.

        Examples
        --------
        >>> model = tr.diagnose(tr.demo_campaign()).model
        >>> model.samples_at([0.1, 0.2, -0.3, 0.4, 0.5], {"temperature": 26.0})
        <Campaign '<conditions>': 1 samples to predict, 5 joints, 1 covariate>
        """
        known = dict.fromkeys(self.needs) | names.conditions(self.robot.joint_names, self.robot.urdf_links)
        for name in conditions or {}:
            if name not in known:
                reason = f"nothing has this name{names.did_you_mean(str(name), known)}"
                expected = ", ".join(self.needs) or "none, as the model needs no condition"
                raise CampaignError(_NAME, reason, column=str(name), expected=expected)
        try:
            rows = np.atleast_2d(np.asarray(q, dtype=float))
            given = {
                name: np.broadcast_to(np.asarray(value, dtype=float), len(rows)).copy()
                for name, value in (conditions or {}).items()
            }
        except (TypeError, ValueError) as error:
            what = f"an array (N, {self.robot.n}), and for each condition one number or N"
            raise CampaignError(_NAME, "these are no rows of numbers", found=str(error), expected=what) from error
        return Campaign(name=_NAME, robot=self.robot, q=rows, covariates=given, **self.settings.of_rows())

    def _ready(self, samples: Any) -> Campaign:
        """Read samples, require the columns that the model needs, and drop those that it does not read."""
        if not isinstance(samples, Campaign):
            samples = self.samples(samples)
        rows: Campaign = read_alike(samples, self.robot, self.settings.turned)
        self._require_needed(rows)
        read = {name: values for name, values in rows.covariates.items() if name in self.needs}
        if self.last_order is not None and self.counts_anew(rows):
            # such an order does not say when a sample would be measured: what settles is taken as settled
            read["order"] = np.full(rows.samples, self.last_order[1])
        return replace(rows, covariates=read)

    def _require_needed(self, samples: Campaign) -> None:
        """Raise ``CampaignError``, naming column and row, if samples lack a column that the model needs or a cell."""
        for column in self.needs:
            gaps = np.flatnonzero(samples.missing.get(column, np.zeros(0, dtype=bool)))
            if column in samples.covariates and not gaps.size:
                continue
            # what the effects read is asked of rows that have all columns; any possible values will do
            whole = {name: np.ones(samples.samples) for name in self.needs}
            seen = observe(replace(samples, covariates=whole, missing={}))
            every = [effect.name for effect, _ in self.effects]
            own = [effect.name for effect, _ in self.effects if _depends(effect, seen, column)]
            reason = f"the model ({', '.join(own or every)}) needs this column"
            if column not in samples.covariates:
                raise CampaignError(samples.name, reason, column=column, found="no such column", expected="numbers")
            row, found = int(samples.rows[gaps[0]]), "an empty cell"
            raise CampaignError(samples.name, reason, row=row, column=column, found=found, expected="a number")
        if self.simulated and samples.simulated_position is None:
            raise CampaignError(
                samples.name,
                "the model corrects the prediction of your simulator",
                column="sim.x",
                found="no such column",
                expected="sim.x, sim.y, sim.z",
            )

    def counts_anew(self, samples: Campaign) -> bool:
        """Whether the ``order`` of the samples merely numbers the rows of their own file.

        It does if it starts at the campaign's first value, has no gaps, and ends earlier. False if the model does not
        use it.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).model.counts_anew(tr.demo_campaign())
        False
        """
        order = samples.covariates.get("order")
        if order is None or self.last_order is None or "order" not in self.needs:
            return False
        first, last = self.last_order
        return len(order) < last - first and np.array_equal(order, first + np.arange(len(order)))

    def follows_rows(self, samples: Campaign) -> bool:
        """Whether a discovered law depends on ``order``, which the samples lack: they count as after the campaign.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).model.follows_rows(tr.demo_campaign())
        False
        """
        laws = (effect for effect, _ in self.effects if isinstance(effect, Discovered))
        return "order" not in samples.covariates and any("order" in (law.quantity, law.by) for law in laws)

    def samples(self, table: str | Path | pd.DataFrame | Table) -> Campaign:
        """Read a table of commands and conditions in the units of the campaign that the model was fitted to.

        Raises
        ------
        CampaignError
            A table that cannot be used.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).model.samples(tr.demo_campaign().to_frame().head(4))
        <Campaign 'table': 4 samples to predict, 5 joints, 8 covariates>
        """
        if isinstance(table, (str, os.PathLike)):
            table = read_table(Path(table))
        samples = read_samples(table, self.settings, self.robot)
        return replace(samples, name=table.file) if isinstance(table, Table) else samples

    def to_dict(self) -> dict[str, Any]:
        """Return the model as plain values for JSON, with the URDF's text and a checksum.

        Examples
        --------
        >>> "effects" in tr.diagnose(tr.demo_campaign()).model.to_dict()
        True
        """
        return written(vars(self))

    @classmethod
    def from_dict(
        cls, plain: dict[str, Any], effects: Sequence[Effect] = (), *, file: str = "<model>"
    ) -> CorrectedModel:
        """Build a model from the output of :meth:`to_dict`; ``effects`` are your own effects that it may hold.

        Raises
        ------
        CampaignError
            If a value is not what it must be, which is named, or was changed after it was written.
        EffectError
            If it holds an effect that is not installed.

        Examples
        --------
        >>> tr.CorrectedModel.from_dict(tr.diagnose(tr.demo_campaign()).model.to_dict()).measures
        'position'
        """
        return cls(**fields_of(plain, effects, file))

    def save(self, path: str | Path) -> None:
        """Write the model to a self-contained JSON file by an atomic replace.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).model.save("model.json")
        """
        write_text(path, json.dumps(self.to_dict(), indent=1) + "\n")

    @classmethod
    def load(cls, path: str | Path, effects: Sequence[Effect] = ()) -> CorrectedModel:
        """Read a file that :meth:`save` wrote; ``effects`` are your own effects that it may hold.

        Raises
        ------
        CampaignError
            If it is not such a file, was written by a newer version, is damaged, or was changed after it was written;
            the value that is wrong is named by its place, as ``effects[2].values[3]``.
        EffectError
            If it holds an effect that is not installed.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).model.save("model.json")
        >>> tr.CorrectedModel.load("model.json").robot.name
        'rv_m2'
        """
        require("load()", path, (str, os.PathLike), "the path of a file that save() wrote")
        return cls.from_dict(read(Path(path)), effects, file=str(path))

    def __repr__(self) -> str:
        held = ", ".join(effect.name for effect, _ in self.effects) or "no effect"
        return f"CorrectedModel({self.robot.name!r}: {held})"
