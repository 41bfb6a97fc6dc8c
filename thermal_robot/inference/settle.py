"""One explanation at its own exact fit: choose effects, refit them, and choose again there, until the choice stays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect, gate
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.discrepancy import forms
from thermal_robot.inference.explain import Explanation, explain
from thermal_robot.inference.gauss_newton import gauss_newton
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.refine import refined
from thermal_robot.inference.robust import Noise
from thermal_robot.observations import Observations


@dataclass(frozen=True, eq=False)
class Settled:
    """An explanation, linearised at the exact model at which it was found, its effects with their (P,) values.

    ``families`` names the effect that each block belongs to.
    """

    observations: Observations
    explanation: Explanation
    held: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]


def settle(
    start: Observations,
    variants: dict[str, tuple[Effect, ...]],
    progress: Callable[[str], None],
    *,
    held: Sequence[tuple[Effect, Array]] = (),
    before: Explanation | None = None,
    starts: Sequence[Sequence[Effect]] = (),
) -> Settled:
    """Model selection at the exact fit: choose effects, refine their constants, refit, until the choice stays.

    It begins at ``start``, the exact model of effects that are ``held`` with their values, and with the weights that
    were found there ``before``. The first search starts from each of the ``starts``, by default from what is held.
    """
    campaign, observations, held = start.campaign, start, list(held)
    begun = list(dict.fromkeys(effect for one in starts for effect in one))
    whole = dict(variants)
    whole.update({e.name: tuple(dict.fromkeys((*whole[e.name], e))) for e in begun})
    variants = dict(whole)
    for effect, _ in held:
        if effect.name in variants:
            rivals = _others(effect, start, whole[effect.name])
            variants[effect.name] = tuple(dict.fromkeys((*variants[effect.name], effect, *rivals)))
    noise = Noise.of(campaign)
    many = campaign.samples > settings.MANY_ROWS
    revisions = 1 if many else settings.REVISIONS
    for revision in range(revisions + 1):
        progress("combinations of effects" if revision == 0 else f"exact fit, revision {revision}")
        listed = [effect for effect, _ in held if effect.name in variants]
        blocks = tuple(_listed(variants, observations, (*begun, *listed)))
        candidates, families = [b.effect for b in blocks], tuple(b.effect.name for b in blocks)
        chosen = [candidates.index(effect) for effect in listed]
        seeds = [chosen] if revision or not starts else [[candidates.index(e) for e in one] for one in starts]
        linear = at_exact_model(observations, blocks, held)
        explanation = explain(linear, noise, families=families, starts=seeds, before=before, forms=forms(observations))
        factor, since = settings.REFINEMENT ** (1 / 2**revision), held
        held = [(candidates[b], explanation.values[b][0]) for b in explanation.best.blocks]
        finer = refined(explanation, observations, factor) if revision < revisions else held
        stays = [e for e, _ in finer] == [e for e, _ in held] and set(explanation.best.blocks) == set(chosen)
        known = revision > 0 or before is not None
        held, last = finer, revision == revisions or (known and stays)
        least = settings.SETTLED_BETWEEN if many and not last else settings.SETTLED
        observations, held = gauss_newton(campaign, observations.frames, explanation, held, least, since)
        if last:
            break
        before = explanation = replace(explanation, searched=None)  # the next search takes as much memory
        for effect, _ in held:
            b = explanation.block_of(effect)
            leading = _leading(effect, blocks[b], explanation.values[b][0])
            others = _others(effect, start, whole[effect.name])
            variants[effect.name] = tuple(dict.fromkeys((*gate.nearby(effect, factor), *leading, *others)))
    return Settled(observations, explanation, tuple(held), families)


def at_exact_model(observations: Observations, blocks: Sequence[Block], held: Sequence[tuple[Effect, Array]]) -> Linear:
    """Return the linear problem at the exact model: its gap, and what the effects that it holds have moved."""
    moved = (block(observations, effect).columns @ values for effect, values in held)
    gap = observations.gap + sum(moved, np.zeros_like(observations.gap))
    return Linear(gap, frame_columns(observations)[0], tuple(blocks))


def _leading(chosen: Effect, item: Block, values: Array) -> Iterator[Effect]:
    """Yield a setting in all places in those alone that do most, as fitted: in the two, three and more of them."""
    if chosen.places or chosen.share is not None:
        return
    every = gate.places_of(item.parameters)
    of = np.array([parameter.place for parameter in item.parameters])
    columns = item.columns
    moved = [float(np.linalg.norm(columns[:, :, of == place] @ values[of == place])) for place in every]
    most = sorted(every, key=lambda place: -moved[every.index(place)])
    for count in range(2, min(len(every), settings.LEADING_PLACES + 1)):
        yield replace(chosen, places=tuple(place for place in every if place in most[:count]))


def _others(chosen: Effect, observations: Observations, settings_of: Sequence[Effect]) -> Iterator[Effect]:
    """Yield what stays a rival of a setting while its constants are refined.

    One place more, less or another, other places alone, and all places; its places, and each of them, in other
    settings. Of a law, all that were compared with it.
    """
    if chosen.share is not None:
        yield from settings_of
        return
    every = [alone.places[0] for alone in gate.alone(replace(chosen, places=()), observations)]
    own = set(chosen.places)
    fewer = [own - {place} for place in chosen.places] if len(own) > 1 else []
    more = [kept | {place} for kept in (own, *fewer) for place in every if own and place not in own]
    for places in (*more, *fewer):
        yield replace(chosen, places=tuple(place for place in every if place in places))
    yield replace(chosen, places=())
    yield from gate.alone(replace(chosen, places=()), observations)
    for setting in (setting for setting in settings_of if not setting.places):
        if set(chosen.places) <= set(gate.places_of(gate.checked(setting, observations))):
            yield replace(setting, places=chosen.places)
        yield from (alone for place in chosen.places if (alone := gate.at(setting, place, observations)) is not None)


def _listed(
    variants: dict[str, tuple[Effect, ...]], observations: Observations, kept: Sequence[Effect]
) -> Iterator[Block]:
    """Yield all settings but those with a place of which the data see nothing, or nothing beside the frames.

    What is kept stays in any case.
    """
    frames, names = frame_columns(observations)[0], observations.robot.joint_names
    basis = orthonormal(equations_of(frames))
    flat = equations_of(observations.joint_sensitivity[:, : frames.shape[1]])
    left = np.linalg.norm(without(flat, basis), axis=0)
    hidden = {
        n for n, seen in zip(names, left > settings.ALIAS * np.linalg.norm(flat, axis=0), strict=True) if not seen
    }
    segments = observations.robot.segments
    # before the first joint a segment is the base, behind the last one the tool
    hidden |= {s.parent_link for s in segments} - {s.parent_link for s in segments[1:] if s.movable}
    every = [setting for own in variants.values() for setting in own]
    for setting in every:
        if setting in kept or not (hidden & set(setting.places) and constant(setting, observations)):
            item = block(observations, setting)
            if setting in kept or _sees(item):
                yield item


def _sees(item: Block) -> bool:
    """Whether the data see something of each place of a setting in several places."""
    places = item.effect.places if len(item.effect.places) > 1 else ()
    if not places:
        return True
    length = np.linalg.norm(item.columns, axis=(0, 1)) * item.sizes
    of = np.array([parameter.place for parameter in item.parameters])
    return all(length[of == place].max(initial=0.0) > settings.ALIAS * length.max() for place in places)


def constant(effect: Effect, observations: Observations) -> bool:
    """Whether an effect displaces each place by the same in all rows."""
    responses = [r for p in gate.checked(effect, observations) for r in p.responses]
    return all(r.values.ndim == (0 if r.channel == "joint" else 1) for r in responses)
