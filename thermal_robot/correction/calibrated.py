"""The calibrated robot: what of a model a robot file can hold, and what of it stays in the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import PER_LINK, split_name
from thermal_robot.correction.constant import Told, constant
from thermal_robot.correction.determined import determined
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects import settings
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import Displacement, exp6
from thermal_robot.kinematics.model import PRISMATIC
from thermal_robot.kinematics.rewritten import xyz_rpy
from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A robot with what of a corrected model is the same in all configurations, at one temperature.

    Attributes
    ----------
    robot
        The nominal one.
    displacement
        What displaces its joints (n,) and segments (S, 6); nothing of the base and the tool.
    base
        (4, 4) pose of the root frame in the measurement frame.
    target
        (4, 4) pose of the measured target in the tool frame.
    temperature
        °C at which its lengths hold; ``None`` where the model does not tell how they grow.
    held, undetermined, kept
        Parameters of the model that are in it; that were left out, as the data do not determine them; and that no robot
        file can hold, so that they stay in the model.
    min_sigma
        Standard deviations that those in it are away from zero at least; ``None`` where nobody asked.
    compared
        (4, 4) the target on the tool frame as the campaign declares it, where the robot was compared with a simulator
        of the user's own, which has it; ``None`` where it was compared with the URDF.
    beyond
        In a sentence, that the temperature lies outside those that were measured; empty where it does not.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> warm.temperature, len(warm.held), {told.effect for told in warm.kept}
    (26.0, 5, {'backlash'})
    """

    robot: Robot
    displacement: Displacement
    base: Array
    target: Array
    temperature: float | None
    held: tuple[Told, ...]
    undetermined: tuple[Told, ...]
    kept: tuple[Told, ...]
    min_sigma: float | None = None
    compared: Array | None = None
    beyond: str = ""

    @property
    def joints(self) -> Array:
        """(M,) rad or m by which each movable joint stands elsewhere; one that mimics another follows that one."""
        return np.asarray(self.robot.chain.coupling.matrix @ np.asarray(self.displacement.joint))

    @property
    def placements(self) -> Array:
        """(K, 4, 4) of the chain's elements in the frames of their parent links: P exp(ξ) exp(axis · zero offset)."""
        chain, segments = self.robot.chain, np.asarray(self.displacement.segment)
        placed = np.tile(np.eye(4), (len(chain.names), 1, 1))
        placed[:, :3, :3], placed[:, :3, 3] = chain.rotations, chain.translations
        for s, k in enumerate(chain.placed):
            placed[k] = placed[k] @ exp6(segments[s])
        for j, k in enumerate(chain.movable):
            placed[k] = placed[k] @ exp6(unit_twist(self.robot, int(k)) * self.joints[j])
        return placed

    @property
    def origins(self) -> Mapping[str, Array]:
        """(4, 4) placement by name of the joints that stand elsewhere than on the nominal robot."""
        chain = self.robot.chain
        moved = {*chain.placed[np.asarray(self.displacement.segment).any(axis=1)], *chain.movable[self.joints != 0.0]}
        placed = enumerate(zip(chain.names, self.placements, strict=True))
        return {name: pose for k, (name, pose) in placed if k in moved}

    @property
    def links(self) -> Mapping[str, tuple[str, Array]]:
        """The link of the target, where that is not the tool frame itself: what carries it, and its placement there."""
        tool = self.robot.tool_frame
        return {target_link(tool): (tool, self.target)} if (self.target != np.eye(4)).any() else {}

    def notes(self, holds: str) -> list[str]:
        """Return what a reader of a robot file must know, in lines; ``holds`` names such a file."""
        xyz, rpy = xyz_rpy(self.base)
        warm = "" if self.temperature is None else f", its lengths at {self.temperature:g} °C"
        lines = [
            f"Calibrated by thermal_robot: the robot {self.robot.name!r} from {self.robot.root_frame!r} to "
            f"{self.robot.tool_frame!r} as it was measured{warm}. All in m, rad, K and s.",
            f"In the measurement frame {self.robot.root_frame!r} stands at xyz=({xyz}) rpy=({rpy}).",
            *(f"The measured target is the link {link!r}." for link in self.links),
            "Joint positions are those that are commanded, and so are the limits: they stay as they were.",
        ]
        parts = {"Written here:": self.held}
        if self.beyond:
            lines.append(f"{self.beyond[:1].upper()}{self.beyond[1:]}.")
        if self.compared is not None:
            lines.append("It was compared with your simulator (sim.*), not with the URDF: correct that one by this.")
        if self.min_sigma is not None:
            small = f"Left out, as they are less than {self.min_sigma:g} standard deviations from zero:"
            parts[small] = self.undetermined
        parts[f"Not written, as {holds} cannot hold them; they stay in the model:"] = self.kept
        for title, told in parts.items():
            lines += [title, *(f"  {each}" for each in told)] if told else [f"{title} nothing"]
        return lines


def calibrated(
    model: CorrectedModel, *, temperature: float | None = None, min_sigma: float | None = None
) -> Calibrated:
    """Return the calibrated robot of a corrected model.

    Parameters
    ----------
    model
        The corrected model.
    temperature
        °C at which lengths are to hold, where the model tells how they grow; by default the campaign's reference
        temperature, at which those of the nominal robot hold.
    min_sigma
        Keep only what is so many standard deviations from zero (:func:`~thermal_robot.correction.determined`); all
        where absent.

    Raises
    ------
    CampaignError
        If the temperature is none, or one is given and the model does not tell how the robot grows; or if it does not
        say what is determined.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> print(warm.notes("a URDF")[0])
    Calibrated by thermal_robot: the robot 'rv_m2' from 'base_link' to 'tool0' as it was measured, ...
    """
    gone: tuple[Told, ...] = ()
    if min_sigma is not None:
        model, gone = determined(model, min_sigma, temperature)
    found = constant(model, temperature)
    if temperature is not None and not found.grows:
        problem = "the model does not tell how the robot grows"
        raise CampaignError("temperature", problem, found=f"{temperature:g} °C", expected="none")
    moved = found.displacement
    left_out = {(told.effect, told.parameter) for told in gone}
    held = [told for told, own in zip(found.parameters, found.held, strict=True) if own]
    return Calibrated(
        robot=model.robot,
        displacement=Displacement(moved.joint, moved.segment),
        base=model.frames.base @ exp6(np.asarray(moved.base)),
        target=exp6(np.asarray(moved.tool)) @ model.frames.tool,
        temperature=found.temperature if found.grows else None,
        held=tuple(told for told in held if (told.effect, told.parameter) not in left_out),
        undetermined=gone,
        kept=tuple(told for told, own in zip(found.parameters, found.held, strict=True) if not own),
        min_sigma=min_sigma,
        compared=model.frames.tool if model.simulated else None,
        beyond="" if temperature is None else _beyond(model, found.temperature),
    )


def _beyond(model: CorrectedModel, temperature: float) -> str:
    """Say where a temperature lies outside those that were measured."""
    ranges = {} if model.spread is None else model.spread.ranges
    known = [ends for column, ends in ranges.items() if split_name(column)[0] in PER_LINK]
    low, high = min((low for low, _ in known), default=-np.inf), max((high for _, high in known), default=np.inf)
    beside = settings.BESIDE * (high - low) if known else 0.0
    if low - beside <= temperature <= high + beside:
        return ""
    return f"lengths at {temperature:g} °C are extrapolated: it was measured at {low:.3g} to {high:.3g} °C"


def target_link(tool_frame: str) -> str:
    """Name of the link (body, site) that is the measured target, where a robot file has one."""
    return f"{tool_frame}_target"


def unit_twist(robot: Robot, element: int) -> Array:
    """(6,) twist of a chain's element a unit of its motion, in its own frame; zero for a fixed one."""
    axis, slides = robot.chain.axes[element], robot.chain.kinds[element] == PRISMATIC
    return np.concatenate([axis, np.zeros(3)] if slides else [np.zeros(3), axis])
