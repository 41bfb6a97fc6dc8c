"""Observations: a campaign with its forward kinematics, frozen; the input of effects and inference.

An :class:`Observations` means "kinematics have been run": the chain is evaluated at the commands, with the frames and
displacements that are known so far, and the gap is there. Gauss-Newton re-observes with the corrected model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any
from weakref import ref

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError, require
from thermal_robot.kinematics import (
    ChainFrames,
    Displacement,
    chain_frames,
    frame_jacobians,
    gravity_torques,
    homogeneous,
    placement_sensitivities,
    quaternion_to_rotation,
    segment_loads,
)
from thermal_robot.observables import Sight
from thermal_robot.robot import Robot

HELD_ROWS = 60_000
"""Rows of all observations together that hold frames and sensitivities: 3 kB each. A diagnosis has ten observations of
its rows; what those that were not asked lately held is computed again in less than a second."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Poses of the robot's base and of the target.

    Attributes
    ----------
    base
        (4, 4) pose of the root frame in the measurement frame.
    tool
        (4, 4) pose of the target in the tool frame.
    artefacts
        Unknowns of the instrument that rows share, by name, such as the places of a stand's sockets.
    """

    base: Array
    tool: Array
    artefacts: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("base", "tool"):
            pose = getattr(self, name)
            if not isinstance(pose, np.ndarray) or pose.shape != (4, 4) or not np.isfinite(pose).all():
                raise CampaignError(
                    "Frames", "no pose", column=name, found=repr(pose), expected="a (4, 4) array, finite"
                )

    @classmethod
    def declared(cls, campaign: Campaign) -> Frames:
        """Frames as the campaign declares them: identity base, target without rotation."""
        return cls(np.eye(4), homogeneous(np.eye(3), campaign.target))


@dataclass(frozen=True, eq=False)
class Observations:
    """A campaign with the forward kinematics of its robot, and the gap between measured and predicted.

    Use :func:`observe` to make one. N rows, n joints, S segments, m = 3 (positions) or 6 (poses).

    Attributes
    ----------
    campaign, frames
        What was observed, and the frames used.
    position, rotation
        (N, 3) m and (N, 3, 3): the target's predicted pose in the root frame. Where the campaign brings the prediction
        of the user's own simulator, it stands here.
    instrument
        (N, 3) displacement of the measured point that the instrument adds, measurement frame, m.
    displacement
        Errors of the chain that are known so far and applied.
    parameters
        Cache of the effects' parameters at these observations, shared by an effect's settings in single places.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> seen = tr.observe(tr.demo_campaign())
    >>> seen.q.shape, seen.joint_sensitivity.shape, seen.varies("temperature")
    ((120, 5), (120, 6, 5), True)
    """

    campaign: Campaign
    frames: Frames
    position: Array
    rotation: Array
    instrument: Array | None = None
    displacement: Displacement | None = None
    parameters: dict[Any, tuple[Any, ...]] = field(init=False, default_factory=dict, repr=False)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.campaign.robot

    @property
    def q(self) -> Array:
        """(N, n) commanded joint positions, rad or m."""
        return self.campaign.q

    @property
    def covariates(self) -> Mapping[str, Array]:
        """Recorded quantities by column name, SI."""
        return self.campaign.covariates

    @property
    def clock(self) -> Array | None:
        """(N,) ``time`` in s, or ``order`` where there is no time; ``None`` where there is neither."""
        return self.campaign.clock

    def temperature(self, link: str) -> Array | None:
        """Temperature (N,) of a link, °C, or else the robot's; ``None`` where unrecorded."""
        return self.covariates.get(f"temperature.{link}", self.covariates.get("temperature"))

    def varies(self, column: str) -> bool:
        """Whether a covariate was recorded and takes more than one value."""
        values = self.covariates.get(column)
        return values is not None and len(values) > 0 and bool(np.ptp(values) > 0)

    def forget(self) -> None:
        """Free the cached kinematics; they are recomputed on demand."""
        for name in [name for name in vars(self) if isinstance(getattr(type(self), name, None), cached_property)]:
            vars(self).pop(name, None)
        self.parameters.clear()

    @cached_property
    def chain(self) -> ChainFrames:
        """Frames along the displaced chain, root frame."""
        _hold(self)
        return chain_frames(self.robot, self.q, self.displacement)

    @cached_property
    def commanded(self) -> ChainFrames:
        """Frames along the nominal chain at the commands, without displacement; the effects' drivers depend on them."""
        return self.chain if self.displacement is None else chain_frames(self.robot, self.q)

    @cached_property
    def torque(self) -> Array | None:
        """Joint torque (N, n), N·m: as reported by the robot, else the holding torque against gravity.

        ``None`` where neither masses, nor payload, nor a torque column are there.
        """
        robot, covariates = self.robot, self.covariates
        payload = covariates.get("payload")
        reported = [covariates.get(f"torque.{joint}") for joint in robot.joint_names]
        if not robot.has_masses and payload is None and all(r is None for r in reported):
            return None
        holding = gravity_torques(robot, self.q, payload=payload, payload_com=self.campaign.payload_com)
        for j, values in enumerate(reported):
            if values is not None:
                holding[:, j] = values
        return holding

    @cached_property
    def segment_load(self) -> Array:
        """Gravity force (N) and moment (N·m), (N, S, 6), on each segment's far end, in the segment's own frame."""
        return segment_loads(
            self.robot, self.q, payload=self.covariates.get("payload"), payload_com=self.campaign.payload_com
        )

    @cached_property
    def predicted_position(self) -> Array:
        """Predicted target (N, 3), measurement frame, before the instrument's own error, m."""
        base = self.frames.base
        return self.position @ base[:3, :3].T + base[:3, 3]

    @cached_property
    def gap(self) -> Array:
        """(N, m) measured − predicted: displacement (m) and rotation vector (rad), in the root frame's axes."""
        if not self.campaign.measured:
            raise ValueError("these observations hold no measurements")
        return self.sight.gap

    @cached_property
    def sight(self) -> Sight:
        """Measurement model of the rows, each by its kind: its gap, and the part of a target's motion that it sees."""
        pose, own = (self.position, self.rotation), self.frames
        return Sight.of(self.campaign, pose, (own.base, own.tool), self.instrument, own.artefacts)

    def in_root_axes(self, turns: Array) -> Array:
        """Rotate the gap's rotation vectors (N, 3), rad, into root frame axes; unchanged without several targets."""
        return turns if self.campaign.targets is None else np.einsum("nij,nj->ni", self.rotation, turns)

    @cached_property
    def lever(self) -> Array:
        """Lever arm (N, 3) from the tool frame's origin to the target, root frame axes, m."""
        return self.chain.tool_rotation @ self.frames.tool[:3, 3]

    @property
    def _jacobian(self) -> Array:
        return frame_jacobians(self.robot, self.q, frames=self.chain, point=self.frames.tool[:3, 3])

    @cached_property
    def joint_sensitivity(self) -> Array:
        """Geometric Jacobian (N, 6, n) at the target, linear first, root frame axes, as far as each row sees it."""
        return self.sight.sees(self._jacobian)

    @property
    def joint_sensitivity_there(self) -> Array:
        """The same (N, 6, n) at the predicted target, where rows look at it elsewhere."""
        return self.sight.sees(self._jacobian, there=True)

    @cached_property
    def segment_sensitivity(self) -> Array:
        """Kinematic regressor (N, 6, S, 6): twist of the target per unit twist of each segment's placement."""
        found = placement_sensitivities(self.robot, self.q, frames=self.chain, point=self.frames.tool[:3, 3])
        return self.sight.sees(found.reshape(len(found), 6, -1)).reshape(found.shape)

    @cached_property
    def base_sensitivity(self) -> Array:
        """Twist (N, 6, 6) of the target per unit twist of the base, root frame."""
        point = self.chain.tool_position + self.lever
        return self.sight.sees(_twist_map(np.broadcast_to(np.eye(3), (len(point), 3, 3)), point))

    @cached_property
    def tool_sensitivity(self) -> Array:
        """What rows see (N, 6, 6), root frame axes, of the target's twist per unit twist of the tool, own axes."""
        return self.sight.sees(_twist_map(self.chain.tool_rotation, self.lever))


_HOLDING: list[ref[Observations]] = []


def _hold(observations: Observations) -> None:
    """Free the kinematics computed longest ago until all observations together hold at most ``HELD_ROWS`` rows."""
    holding = [found for each in _HOLDING if (found := each()) is not None and "chain" in vars(found)]
    rows = observations.campaign.samples + sum(found.campaign.samples for found in holding)
    while holding and rows > HELD_ROWS:
        rows -= holding[0].campaign.samples
        holding.pop(0).forget()
    _HOLDING[:] = [*map(ref, holding), ref(observations)]


def _twist_map(axes: Array, arm: Array) -> Array:
    """Adjoint map of twists to a point ``arm`` away: [[R, −[arm]× R], [0, R]] in rows of 6."""
    mapped = np.zeros((len(arm), 6, 6))
    mapped[:, :3, :3] = axes
    mapped[:, 3:, 3:] = axes
    # column k of the rotational part: (axis_k) × arm
    mapped[:, :3, 3:] = np.cross(axes.transpose(0, 2, 1), arm[:, None, :]).transpose(0, 2, 1)
    return mapped


def observe(
    campaign: Campaign,
    frames: Frames | None = None,
    *,
    displacement: Displacement | None = None,
    instrument: Array | None = None,
) -> Observations:
    """Run the forward kinematics of a campaign.

    Parameters
    ----------
    campaign
        Commands, measurements and conditions.
    frames
        Base and tool; as declared where absent.
    displacement
        What is displaced in the chain (the corrected model); nothing where absent.
    instrument
        (N, 3) what the instrument adds to the measured position, measurement frame, m.

    Returns
    -------
    Observations
        Frozen; everything further is computed when first asked for.

    Notes
    -----
    With ``sim.*`` columns the prediction is the simulator's pose plus what the displacement does to the URDF's pose:
    the simulator says where the nominal robot is, the URDF how an error moves it.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> sound = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=10)
    >>> bool(abs(tr.observe(sound).gap).max() < 1e-12)
    True
    """
    require("observe()", campaign, (Campaign,), "a campaign")
    require("observe(), frames", frames, (Frames, type(None)), "Frames, or None for those that the file declares")
    frames = frames or Frames.declared(campaign)
    robot = campaign.robot
    chain = chain_frames(robot, campaign.q, displacement)
    position = chain.tool_position + chain.tool_rotation @ frames.tool[:3, 3]
    rotation = chain.tool_rotation @ frames.tool[:3, :3]
    if campaign.simulated_position is not None:
        nominal = chain_frames(robot, campaign.q)
        shift = position - nominal.tool_position - nominal.tool_rotation @ frames.tool[:3, 3]
        position = campaign.simulated_position + shift
        if campaign.simulated_orientation is not None:
            turn = chain.tool_rotation @ nominal.tool_rotation.transpose(0, 2, 1)
            rotation = turn @ quaternion_to_rotation(campaign.simulated_orientation)
    found = Observations(campaign, frames, position, rotation, instrument, displacement)
    _hold(found)
    vars(found)["chain"] = chain  # as the property would find it
    own = found.sight.artefacts
    if any(frames.artefacts.get(name) is not artefact for name, artefact in own.items()):
        object.__setattr__(found, "frames", replace(frames, artefacts={**frames.artefacts, **own}))
    return found
