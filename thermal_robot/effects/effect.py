"""Contract of an effect: where error enters the chain, and the quantity that it grows with.

An effect is a frozen dataclass. It names its parameters and gives the *unit response* of each: what one unit does in
the channels, read from the observations. It calls no kinematics, fits nothing and holds no fitted value. Arguments of
its constructor carry what is nonlinear (a time constant, an order); :meth:`Effect.variants` proposes values for them.

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

Register it under the entry point group ``thermal_robot.effects`` or pass it to :func:`thermal_robot.diagnose`. All else
that may stand in the class has a default (:class:`Effect`). Nobody asks an effect directly:
:mod:`thermal_robot.effects.gate` does, checks the answer, and names the effect where it breaks the contract or raises.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics import exp6

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

Channel = Literal["joint", "segment", "base", "tool", "instrument"]
Driver = tuple[str, str, Array]
"""What drives an effect at a place: name, unit and (N,) values of a quantity."""

SOURCED, UNSOURCED = 0.5, 1.5
"""Standard deviation of the logarithm of an effect's size: where the expected one stands on sources, 99 % of robots are
within a factor of 3.6 of it; where nobody knows it, three times more or less is no surprise."""
TWIST = (*((f"translation {axis}", "m") for axis in "xyz"), *((f"rotation {axis}", "rad") for axis in "xyz"))
"""Name and unit of each component of a twist."""


@dataclass(frozen=True, eq=False)
class Response:
    """Unit response: displacement of one place of one channel per unit of a parameter.

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
    values: Array


def at_joint(index: int, values: Any) -> Response:
    """Displacement of joint ``index``: rad or m, scalar or (N,).

    Examples
    --------
    >>> from thermal_robot.effects import at_joint
    >>> at_joint(2, 1.0)
    Response(channel='joint', index=2, values=array(1.))
    """
    return Response("joint", index, np.asarray(values, dtype=float))


def at_segment(index: int, twist: Any) -> Response:
    """Twist of the placement of segment ``index`` in its own frame: (6,) or (N, 6).

    Examples
    --------
    >>> from thermal_robot.effects import at_segment
    >>> at_segment(1, [1, 0, 0, 0, 0, 0]).values  # it grows along x
    array([1., 0., 0., 0., 0., 0.])
    """
    return Response("segment", index, np.asarray(twist, dtype=float))


def at_base(twist: Any) -> Response:
    """Twist of the base in the root frame: (6,) or (N, 6).

    Examples
    --------
    >>> from thermal_robot.effects import at_base
    >>> at_base([0, 0, 0, 0, 0, 1]).channel  # it turns about z
    'base'
    """
    return Response("base", 0, np.asarray(twist, dtype=float))


def at_tool(twist: Any) -> Response:
    """Twist of the tool in the tool frame: (6,) or (N, 6).

    Examples
    --------
    >>> from thermal_robot.effects import at_tool
    >>> at_tool([0, 0, 1, 0, 0, 0]).channel  # it is longer along z
    'tool'
    """
    return Response("tool", 0, np.asarray(twist, dtype=float))


def at_instrument(displacement: Any) -> Response:
    """Displacement of the measured point in the measurement frame: (N, 3), m.

    Examples
    --------
    >>> from thermal_robot.effects import at_instrument
    >>> at_instrument([[0, 0, 1e-5]] * 4).values.shape
    (4, 3)
    """
    return Response("instrument", 0, np.asarray(displacement, dtype=float))


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter of an effect with its unit response.

    Attributes
    ----------
    label
        Name without the place ("strain per kelvin").
    unit
        Its unit as text.
    size
        Expected size (one sigma) in that unit, before the campaign's ``[priors]``.
    kind
        ``joint``, ``link``, ``base``, ``tool`` or ``instrument``: the kind of place it sits in.
    place
        The joint's or link's URDF name; ``base``, ``tool`` or ``instrument`` (or a link) for these kinds; empty for all
        that the responses act on.
    responses
        Displacement of the channels per unit.
    positive
        Whether it cannot be negative, as a compliance: its prior is half-normal.
    """

    label: str
    unit: str
    size: float
    kind: str
    place: str
    responses: tuple[Response, ...]
    positive: bool = False

    @property
    def name(self) -> str:
        """Label and place, unique within the effect."""
        return f"{self.label}, {self.place}" if self.place else self.label

    @cached_property
    def bare(self) -> Parameter:
        """Copy without the responses, which may be large."""
        return replace(self, responses=())


@dataclass(frozen=True)
class Effect(ABC):
    """Base class of effects; the module's docstring shows how to write one.

    Attributes
    ----------
    places
        Names of the joints or links whose parameters are kept; empty for all. One place at fault needs few parameters,
        and those of the sound places would count against it.
    excluded
        Names of the joints or links whose parameters are not kept, whatever ``places`` says.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import thermal_robot as tr
    >>> from thermal_robot.effects import Parameter, at_joint
    >>> @dataclass(frozen=True)
    ... class WristLate(tr.Effect):
    ...     name = "wrist_late"
    ...     def parameters(self, observations):
    ...         return (Parameter("lag", "rad", 1e-3, "joint", "joint_5", (at_joint(4, 1.0),)),)
    >>> tr.simulate("builtin:rv_m2", {WristLate(): 2e-3}, tool_frame="tool0", rows=8, measures="pose")
    <Campaign 'simulated': 8 samples of pose, 5 joints, 7 covariates>
    """

    places: tuple[str, ...] = field(default=(), kw_only=True)
    excluded: tuple[str, ...] = field(default=(), kw_only=True)

    name: ClassVar[str] = ""
    """By which it is asked for and reported."""
    title: ClassVar[str] = ""
    """Plain words for a sentence; the name with spaces where a class states none."""
    in_model: ClassVar[str] = ""
    """What it is where another model of the same robot says its pose, such as the controller's; empty for what no model
    holds, such as wear."""
    in_model_times: ClassVar[float] = 1.0
    """Times of its expected size that it has there."""
    frame: ClassVar[str] = ""
    """Frame, ``base`` or ``tool``, that its first setting displaces by any twist: it begins where registration has it
    if another model says the pose."""
    singular: ClassVar[str] = ""
    """The same of a single joint; the title where a class states none."""
    sided_by: ClassVar[tuple[str, ...]] = ()
    """Quantities that give parameters that cannot be negative their side: of ``torque``, ``approach``, ``temperature``
    and ``gravity`` the first that the campaign has."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Covariates without which the effect is not testable."""
    size_spread: ClassVar[float] = SOURCED
    """Standard deviation of the logarithm of its size: of the common factor of all expected sizes, which is learnt."""
    random: ClassVar[bool] = False
    """Whether it scatters: no mean follows from it; see :class:`thermal_robot.effects.random_effect.RandomEffect`."""
    contained_in: ClassVar[tuple[str, ...]] = ()
    """Names of larger effects that can do exactly what it does, but for the unknown frames; where that holds for some
    arms only, the class says so."""
    told_inside: ClassVar[bool] = False
    """Whether its own part is told where a larger effect that contains it was found: what somebody could set anew."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Derive title and singular from the class name where a class gives none."""
        super().__init_subclass__(**options)
        if "name" in vars(cls) and "title" not in vars(cls):
            cls.title = str(cls.name).replace("_", " ")
        if "name" in vars(cls) and "singular" not in vars(cls):
            cls.singular = cls.title

    @abstractmethod
    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Parameters with their unit responses, for the observations' rows."""

    def independent(self, observations: Observations) -> tuple[Parameter, ...]:
        """Equivalent smaller set of parameters, in the order of reporting; empty where all are reported.

        Each is a combination of :meth:`parameters`. Together with those of the contained effects (:attr:`told_inside`),
        which come first, they are a minimal set.
        """
        return ()

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Columns that the campaign lacks for this effect to be testable; empty when it can be tested."""
        return tuple(need for need in self.needs if not observations.varies(need))

    @property
    def share(self) -> float | None:
        """Share of the prior probability of its name; ``None`` where places and ``weight`` decide it.

        Effects with a share are not searched in single places.
        """
        return None

    @property
    def weight(self) -> float:
        """Prior weight against other settings of the same places."""
        return 1.0

    @property
    def apart(self) -> int:
        """Number of constants that differ from a common one; each costs prior probability."""
        return 0

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Covariates on which its responses depend, and which a prediction needs."""
        return tuple(need for need in self.needs if need in observations.covariates)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings of the nonlinear arguments that inference compares: the coarse grid.

        What a setting takes from the campaign (an origin of time, a record) is fixed here, once, so that a saved model
        predicts other samples with it.
        """
        return (self,)

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Return the settings near this one, itself among them, for the refinement of constants.

        A coordinate search moves to the best of them, with decreasing factors (above 1).
        """
        return (self,)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Quantity that drives the effect at one place, for plots.

        Parameters
        ----------
        observations
            Observations of the fitted model.
        parameters
            Those at the place, at least one.
        error
            (N,) what the effect does there, rad or m.

        Returns
        -------
        Driver or None
            ``None`` where no quantity can be named: the one that goes with the error most is then drawn.
        """
        return None

    def told(self, values: Array) -> Array:
        """Return the fitted values (P,) as a finding tells them; a frame's twist as its place and rotation vector."""
        if self.frame and len(values) == len(TWIST):
            return np.concatenate([exp6(values)[:3, 3], values[3:]])
        return values

    def delivered(self, observations: Observations) -> Effect:
        """Equivalent effect for prediction at other rows."""
        return self

    def elsewhere(self, observations: Observations) -> Effect:
        """Effect in another campaign of the robot, with that campaign's record."""
        return self

    def arguments(self) -> dict[str, Any]:
        """Return the constructor arguments for saving; ``places`` and ``excluded`` only where they are set."""
        return {name: value for name, value in asdict(self).items() if name not in ("places", "excluded") or value}


def in_words(kind: str, place: str) -> str:
    """Name of a place, preceded by its kind unless the name contains it."""
    return (place or kind) if not place or kind in place else f"{kind} {place}"
