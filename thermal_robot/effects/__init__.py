"""Every effect in a file of its own; the library of all of them, and the user's own through entry points."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from importlib.metadata import entry_points

from thermal_robot.effects.backlash import Backlash
from thermal_robot.effects.base_frame import BaseFrame
from thermal_robot.effects.drift import Drift
from thermal_robot.effects.effect import (
    Effect,
    Parameter,
    Response,
    at_base,
    at_instrument,
    at_joint,
    at_segment,
    at_tool,
)
from thermal_robot.effects.geometric import Geometric
from thermal_robot.effects.instrument_scale import InstrumentScale
from thermal_robot.effects.joint_compliance import JointCompliance
from thermal_robot.effects.joint_gain import JointGain
from thermal_robot.effects.joint_offset import JointOffset
from thermal_robot.effects.link_compliance import LinkCompliance
from thermal_robot.effects.thermal_bending import ThermalBending
from thermal_robot.effects.thermal_elongation import ThermalElongation
from thermal_robot.effects.tool_frame import ToolFrame
from thermal_robot.effects.tracking_lag import TrackingLag
from thermal_robot.effects.transmission_error import TransmissionError
from thermal_robot.errors import EffectError

_BUILTIN: tuple[type[Effect], ...] = (
    BaseFrame,
    ToolFrame,
    JointOffset,
    JointGain,
    TransmissionError,
    Backlash,
    JointCompliance,
    TrackingLag,
    Geometric,
    LinkCompliance,
    ThermalElongation,
    ThermalBending,
    Drift,
    InstrumentScale,
)

RANDOM = ("encoder_resolution", "excess_repeatability")
"""Effects that scatter: no mean follows from them, so they are told from what remains, not fitted (formats.md)."""


def library() -> dict[str, Effect]:
    """Return every known effect by name: the program's own, then those of installed packages.

    Raises
    ------
    EffectError
        If an entry point gives something that is not an effect, or a name that is already taken.
    """
    found: dict[str, Effect] = {kind.name: kind() for kind in _BUILTIN}
    for point in entry_points(group="thermal_robot.effects"):
        loaded = point.load()
        effect = loaded() if isinstance(loaded, type) else loaded
        if not isinstance(effect, Effect) or not effect.name:
            raise EffectError(f"entry point {point.name!r} ({point.value}) does not give an effect with a name")
        if effect.name in found:
            raise EffectError(f"entry point {point.name!r} gives the name {effect.name!r}, which is taken")
        found[effect.name] = effect
    return found


def choose(
    only: str | Iterable[str] = (), without: str | Iterable[str] = (), own: Iterable[Effect] = ()
) -> tuple[Effect, ...]:
    """Return the effects that a user asked for.

    Parameters
    ----------
    only
        Names to keep; all where empty.
    without
        Names to leave out.
    own
        The user's own effects, beside those of the library.

    Raises
    ------
    EffectError
        If a name is not known, taken twice, or nothing is left; if one of ``own`` is not an effect.
    """
    known = library()
    for effect in own:
        if not isinstance(effect, Effect) or not effect.name:
            raise EffectError(f"{effect!r} is not an effect with a name; pass an instance of a subclass of Effect")
        if effect.name in known:
            raise EffectError(f"there are two effects named {effect.name!r}")
        known[effect.name] = effect
    only, without = ((names,) if isinstance(names, str) else tuple(names) for names in (only, without))
    for name in (*only, *without):
        if name not in known and name not in RANDOM:
            near = difflib.get_close_matches(name, (*known, *RANDOM), n=3, cutoff=0.3) or sorted(known)
            raise EffectError(f"no effect is named {name!r}; near to it: {', '.join(near)}")
    chosen = tuple(e for name, e in known.items() if (not only or name in only) and name not in without)
    if not chosen:
        raise EffectError("no effect is left to consider")
    return chosen


__all__ = [
    "RANDOM",
    "Backlash",
    "BaseFrame",
    "Drift",
    "Effect",
    "Geometric",
    "InstrumentScale",
    "JointCompliance",
    "JointGain",
    "JointOffset",
    "LinkCompliance",
    "Parameter",
    "Response",
    "ThermalBending",
    "ThermalElongation",
    "ToolFrame",
    "TrackingLag",
    "TransmissionError",
    "at_base",
    "at_instrument",
    "at_joint",
    "at_segment",
    "at_tool",
    "choose",
    "library",
]
