"""The contract of an effect: where error enters the chain, and the quantity it grows with.

An effect is a frozen dataclass that names its parameters and gives, for each, the *unit response*: what a
parameter of one unit does in the channels, read from the observations. It calls no kinematics, fits nothing and
holds no fitted value. Constructor arguments carry what is nonlinear (a time constant, an origin of time, an order);
:meth:`Effect.variants` proposes values for them, and estimation chooses.

A new effect is a file like this one::

    from dataclasses import dataclass
    from thermal_robot.effects import Effect, Parameter, at_joint

    @dataclass(frozen=True)
    class JointSag(Effect):
        name = "joint_sag"
        needs = ("speed",)

        def parameters(self, observations):
            return tuple(
                Parameter("sag", "rad", 1e-3, "joint", joint, (at_joint(j, observations.covariates["speed"]),))
                for j, joint in enumerate(observations.robot.joint_names)
            )

Register it under the entry point group ``thermal_robot.effects`` or pass it to :func:`thermal_robot.diagnose`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

Channel = Literal["joint", "segment", "base", "tool", "instrument"]


@dataclass(frozen=True, eq=False)
class Response:
    """What one unit of a parameter does in one place of one channel.

    Attributes
    ----------
    channel
        ``joint`` (displacement of a joint), ``segment`` (twist of a joint placement, LOCAL), ``base`` (twist in the
        root frame), ``tool`` (twist in the tool frame), ``instrument`` (displacement in the measurement frame).
    index
        Joint or segment number; 0 elsewhere.
    values
        Joint: (N,) or scalar, rad or m. Segment, base, tool: (6,) or (N, 6), linear part first, m and rad.
        Instrument: (N, 3), m.
    """

    channel: Channel
    index: int
    values: NDArray[np.float64]


def at_joint(index: int, values: Any) -> Response:
    """Displacement of joint ``index``: rad or m, scalar or (N,)."""
    return Response("joint", index, np.asarray(values, dtype=float))


def at_segment(index: int, twist: Any) -> Response:
    """Twist of the placement of segment ``index`` in its own frame: (6,) or (N, 6)."""
    return Response("segment", index, np.asarray(twist, dtype=float))


def at_base(twist: Any) -> Response:
    """Twist of the base in the root frame: (6,) or (N, 6)."""
    return Response("base", 0, np.asarray(twist, dtype=float))


def at_tool(twist: Any) -> Response:
    """Twist of the tool in the tool frame: (6,) or (N, 6)."""
    return Response("tool", 0, np.asarray(twist, dtype=float))


def at_instrument(displacement: Any) -> Response:
    """Displacement of the measured point in the measurement frame: (N, 3), m."""
    return Response("instrument", 0, np.asarray(displacement, dtype=float))


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter of an effect with its unit response.

    Attributes
    ----------
    label
        What it is, without the place ("strain per kelvin").
    unit
        Its unit as text.
    size
        Expected size (one sigma) in that unit, before the campaign's ``[priors]``.
    kind
        ``joint``, ``link``, ``base``, ``tool`` or ``instrument``: the kind of place it sits in.
    place
        The joint's or link's URDF name.
    responses
        What one unit does in the channels.
    """

    label: str
    unit: str
    size: float
    kind: str
    place: str
    responses: tuple[Response, ...]

    @property
    def name(self) -> str:
        """Label and place, unique within the effect."""
        return f"{self.label}, {self.place}" if self.place else self.label


@dataclass(frozen=True)
class Effect(ABC):
    """Base of all effects; see the module's docstring for how to write one."""

    name: ClassVar[str] = ""
    needs: ClassVar[tuple[str, ...]] = ()
    """Covariates without which the effect is not testable."""

    @abstractmethod
    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return the parameters with their unit responses, for the observations' rows."""

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return what the campaign lacks for this effect to be testable; empty when it can be tested."""
        return tuple(need for need in self.needs if not observations.varies(need))

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the covariates that its responses were read from: whoever predicts must know them, too."""
        return tuple(need for need in self.needs if need in observations.covariates)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings of the nonlinear arguments that estimation should compare."""
        return (self,)

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Return settings near this one, by about a factor, with which estimation refines it; itself among them."""
        return (self,)

    def at(self, joint: str) -> Effect | None:
        """Return the effect in one joint alone; ``None`` where it has no such setting."""
        return None

    def arguments(self) -> dict[str, Any]:
        """Return the constructor's arguments, for saving."""
        return asdict(self)
