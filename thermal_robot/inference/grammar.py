"""Laws beyond one place that follows one quantity: effects that change, products of quantities, memory."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.turning import moves
from thermal_robot.effects import Effect, Parameter, Response, gate, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN, quantities, unit
from thermal_robot.inference.laws import hystereses, law_of, relaxing, straight
from thermal_robot.observations import Observations


def conditions(observations: Observations, joint: str = "") -> list[str]:
    """Return the quantities of the campaign that may act on a place: recorded ones, the clock and the session.

    Of those recorded for each joint, a joint's own; what another joint does is no condition of this one.
    """
    robot = observations.robot
    others = tuple(f".{name}" for name in robot.joint_names if name != joint)
    computed = {*robot.joint_names, *GRAVITY, *REACH}
    return [name for name in quantities(observations) if name not in computed and not name.endswith(others)]


def modulated(observations: Observations, effects: Iterable[Effect] | None = None) -> list[Discovered]:
    """Return laws of known effects whose size in one joint changes with a condition or with the joint's position.

    An effect whose response is the same in all rows, such as a zero that is off, is left out: times a law it is a plain
    law of that joint. So is what drives the effect itself: lost motion times the direction of approach is a zero that
    is off, a wave times a law of the same position any law of it. An effect that is not installed is left out, too, as
    a saved law could not be read.

    Parameters
    ----------
    observations
        Where columns and quantities are read from.
    effects
        In the settings that are to be tried; the whole library, each in its first setting, where absent.
    """
    installed = library()
    offered = installed.values() if effects is None else effects
    known = quantities(observations)
    follow = {name: straight(law_of(observations, Discovered(), name, values)) for name, values in known.items()}
    found = []
    for effect in offered:
        if type(installed.get(effect.name)) is not type(effect) or gate.missing(effect, observations):
            continue
        setting = gate.variants(effect, observations)[0] if effects is None else effect
        arguments = {k: v for k, v in gate.arguments(setting).items() if k not in ("places", "excluded")}
        for joint in _changing(setting, observations):
            driver = _driver(setting, observations, joint)
            followed = (*conditions(observations, joint), joint)
            names = [name for name in followed if driver not in (name, f"position of {name}")]
            plain = [follow[name] for name in names if name in known]
            text = json.dumps(arguments)
            found += [replace(law, place=joint, of=effect.name, of_arguments=text) for law in plain]
    return found


def _changing(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Return the joints in which an effect's response differs between rows."""
    own = [p for p in gate.checked(effect, observations) if p.kind == "joint"]
    return gate.places_of([p for p in own if any(np.ptp(r.values, axis=0).any() for r in _rows(p))])


def _driver(effect: Effect, observations: Observations, joint: str) -> str:
    """Return the name of the quantity that drives an effect in a joint; empty where nothing that is recorded does."""
    own = [p for p in gate.checked(effect, observations) if p.kind == "joint" and p.place == joint]
    driver = gate.driver(effect, observations, own, np.zeros(observations.campaign.samples))
    return driver[0] if driver else ""


def _rows(parameter: Parameter) -> Iterator[Response]:
    """Yield the responses of a parameter that have a value for each row."""
    yield from (r for r in parameter.responses if r.values.ndim == (1 if r.channel == "joint" else 2))


def products(observations: Observations, kinds: Sequence[str]) -> list[Discovered]:
    """Return laws of two quantities at once: 1, u, v and u·v, the first a condition of the place or a joint's position.

    Parameters
    ----------
    observations
        Where quantities are read from.
    kinds
        ``joint``, ``base``, ``tool``.
    """
    robot, known = observations.robot, quantities(observations)
    turns = observations.campaign.measures == "pose"
    further = [name for name in (*robot.joint_names, *GRAVITY, *REACH) if name in known]
    follow = {
        name: Discovered(
            turns=turns,
            quantity=name,
            shape="ramp",
            unit=unit(robot, name),
            origin=float(values.min()),
            span=float(np.ptp(values)),
        )
        for name, values in known.items()
    }
    found = []
    for kind in kinds:
        for place in robot.joint_names if kind == "joint" else (kind,):
            own = [n for n in conditions(observations, place) if n not in observations.campaign.labels]
            first = [*own, place] if place in known else own
            for i, name in enumerate(first):
                law = replace(follow[name], kind=kind, place=place)
                for by in [*first[i + 1 :], *(n for n in further if n not in first)]:
                    found.append(replace(law, by=by, by_origin=follow[by].origin, by_span=follow[by].span))
    return found


def memory(observations: Observations) -> list[Discovered]:
    """Return laws of what each joint remembers: its last turning point (smooth, or elements that slip), its start."""
    found, past, known = [], observations.campaign.since_turn, quantities(observations)
    clock = next((name for name in CLOCK if name in observations.covariates and name in known), None)
    for joint in observations.robot.joint_names:
        if joint in past and moves(past[joint]):
            smooth = law_of(observations, Discovered(place=joint), TURN + joint, past[joint])
            found += [smooth, *hystereses(smooth, past[joint])[:2]]
        if clock:
            found += relaxing(observations, law_of(observations, Discovered(place=joint), clock, known[clock]))
    return found
