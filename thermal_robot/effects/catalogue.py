"""Registry of effects: the program's own, those of installed packages, and the user's choice among them."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from thermal_robot.campaign.names import did_you_mean
from thermal_robot.effects.arguments import with_arguments
from thermal_robot.effects.backlash import Backlash
from thermal_robot.effects.beam import ThermalBending
from thermal_robot.effects.compliance import BaseCompliance, LinkCompliance
from thermal_robot.effects.constant import BaseFrame, Geometric, InstrumentScale, JointOffset, ToolFrame
from thermal_robot.effects.drift import Drift
from thermal_robot.effects.effect import Effect
from thermal_robot.effects.joint_compliance import JointCompliance
from thermal_robot.effects.position import JointGain, JointRipple, TransmissionError
from thermal_robot.effects.random_effect import EncoderResolution, ExcessRepeatability, RandomEffect
from thermal_robot.effects.thermal_elongation import ThermalElongation
from thermal_robot.effects.tracking_lag import TrackingLag
from thermal_robot.errors import EffectError, Note, UnknownEffectError

_Said = TypeVar("_Said")
_SYSTEMATIC: dict[str, type[Effect]] = {
    kind.name: kind
    for kind in (
        BaseFrame,
        ToolFrame,
        JointOffset,
        JointGain,
        TransmissionError,
        JointRipple,
        Backlash,
        JointCompliance,
        TrackingLag,
        Geometric,
        LinkCompliance,
        BaseCompliance,
        ThermalElongation,
        ThermalBending,
        Drift,
        InstrumentScale,
    )
}
_RANDOM: dict[str, type[RandomEffect]] = {kind.name: kind for kind in (EncoderResolution, ExcessRepeatability)}

KINEMATIC = (JointOffset.name, Geometric.name)
"""Names of the effects that a calibration of the kinematics fits: what a controller's zeros can take, and the rest."""
FRAMES = (BaseFrame.name, ToolFrame.name)
"""Names of the effects that are errors of a frame which the campaign declares known."""
RANDOM = tuple(_RANDOM)
"""Names of the effects that scatter."""


def random_effects() -> tuple[RandomEffect, ...]:
    """Random effects, which are estimated as variance components of the residual.

    Examples
    --------
    >>> from thermal_robot.effects import random_effects
    >>> [effect.name for effect in random_effects()]
    ['encoder_resolution', 'excess_repeatability']
    """
    return tuple(kind() for kind in _RANDOM.values())


def library() -> dict[str, Effect]:
    """All fixed effects by name: the program's own, then those of installed packages.

    Warns
    -----
    Note
        If an entry point cannot be loaded, gives something that is not an effect, or a name that is already taken; it
        is left out.

    Examples
    --------
    >>> from thermal_robot.effects import library
    >>> library()["backlash"].title
    'lost motion in the joints'
    """
    found: dict[str, Effect] = {name: kind() for name, kind in _SYSTEMATIC.items()}
    for point in _installed():
        try:
            loaded = point.load()
            effect: Effect = loaded() if isinstance(loaded, type) else loaded
            _refuse(effect, found)
        except Exception as error:  # another package's code may raise anything
            reason = str(error) if isinstance(error, EffectError) else f"it raises {error!r}"
            warnings.warn(f"entry point {point.name!r} ({point.value}) is left out: {reason}", Note, stacklevel=2)
            continue
        found[effect.name] = effect
    return found


@cache
def _installed() -> tuple[EntryPoint, ...]:
    """Entry points of installed packages for effects, read once: reading takes a hundredth of a small diagnosis."""
    return tuple(entry_points(group="thermal_robot.effects"))


def _refuse(effect: Effect, known: dict[str, Effect]) -> None:
    """Raise :class:`EffectError` unless an object is an effect, not random, with a name that no known one has."""
    if not isinstance(effect, Effect) or not isinstance(effect.name, str) or not effect.name:
        raise EffectError(f"{effect!r} is not an effect with a name; expected an instance of a subclass of Effect")
    if effect.random:
        raise EffectError(f"{effect.name!r} is random; only {' and '.join(RANDOM)} are told from scatter")
    if effect.name in known or effect.name in RANDOM:
        raise EffectError(f"there are two effects named {effect.name!r}")


@cache
def restored(name: str, arguments: str) -> Effect:
    """Effect of the library by its name and JSON arguments; :class:`EffectError` if unknown or not accepted."""
    known = library()
    if name not in known:
        raise EffectError(f"no effect is named {name!r} here")
    try:
        return with_arguments(type(known[name]), json.loads(arguments), "")
    except (ValueError, RecursionError) as error:
        raise EffectError(f"effect {name!r} does not take the arguments {arguments}: {error}") from error


def named(name: str) -> Effect:
    """Effect of a name, random ones included.

    Raises
    ------
    EffectError
        If there is none; says which name was probably meant.

    Examples
    --------
    >>> from thermal_robot.effects import named
    >>> named("drift").needs
    ()
    >>> named("drft")
    Traceback (most recent call last):
    thermal_robot.errors.EffectError: no effect is named 'drft'; did you mean 'drift'?
    """
    if own := _SYSTEMATIC.get(name) or _RANDOM.get(name):
        return own()  # no package can give one of these names, and looking all of them up takes a while
    known = library()
    if name not in known:
        raise _unknown(name, known)
    return known[name]


def of_effect(answers: Mapping[str, _Said], name: str) -> _Said:
    """Look an effect up in a mapping by name; :class:`UnknownEffectError` suggests the name that was meant."""
    if name not in answers:
        raise UnknownEffectError(f"no effect named {name!r} was considered{_meant(str(name), answers)}")
    return answers[name]


def _meant(name: str, known: Iterable[str]) -> str:
    return did_you_mean(name, known) or f"; there are {', '.join(sorted(known)) or 'none'}"


def _unknown(name: str, known: Iterable[str]) -> EffectError:
    return EffectError(f"no effect is named {name!r}{_meant(name, (*known, *RANDOM))}")


def choose(
    only: str | Iterable[str] = (), without: str | Iterable[str] = (), own: Iterable[Effect] = ()
) -> tuple[Effect, ...]:
    """Return the fixed effects that a user selects; names of random ones are accepted, too.

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

    Examples
    --------
    >>> from thermal_robot.effects import choose
    >>> [effect.name for effect in choose(only=["drift", "backlash"])]
    ['backlash', 'drift']
    """
    known = library()
    for effect in own:
        _refuse(effect, known)
        known[effect.name] = effect
    only, without = ((names,) if isinstance(names, str) else tuple(names) for names in (only, without))
    for name in (*only, *without):
        if name not in known and name not in RANDOM:
            raise _unknown(name, known)
    chosen = tuple(e for name, e in known.items() if (not only or name in only) and name not in without)
    if not chosen:
        raise EffectError("no effect is left to consider")
    return chosen
