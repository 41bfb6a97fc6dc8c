"""How far the gap shrinks, on rows that were not used for the fit.

Neighbouring rows are alike in time, temperature and place. Folds of consecutive rows therefore favour a fit that only
follows the course of the campaign (Roberts et al., *Ecography* 40, 2017, on blocked cross-validation). Other schemes
show whether it extrapolates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.turning import moves
from thermal_robot.diagnosis.one_walk import Model, Squares, Walk, deviation, share
from thermal_robot.diagnosis.values import FoldScheme, HeldOut
from thermal_robot.effects.law_words import is_event
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.columns import block as columns
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import blocks, each, neighbourhoods

Labels = NDArray[np.int64]
Share = tuple[float, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """Held-out shrinkage of the gap, overall and per effect; all with the noise of the held-out rows in it.

    ``overall``: rms before and after; ``with_aside``: the same, m, over all rows, set aside or not. ``before`` and
    ``after`` (N,): distance of each row while it was held out, m, NaN where set aside. ``shares`` of the gap's mean
    square, with 95 % intervals: for an effect of the fit the Shapley value (these sum to the overall shrinkage), for
    another the gain from adding it. ``left`` (N, m): what the model left of each row, root frame, m and rad, NaN where
    never held out.
    """

    overall: HeldOut
    before: Array
    after: Array
    with_aside: tuple[float, float]
    shares: dict[str, Share]
    left: Array


def held_out(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Shrinkage:
    """Cross-validate in blocks of consecutive measurements, one block held out at a time.

    Frames and parameters come from the training rows alone. What was chosen stays that of all rows: candidates,
    effects, the place and quantity of a law, refined constants, prior scales, the point of linearisation, noise, and
    which rows are set aside. Choosing anew in each fold was tried: as an estimate for the model that is saved it is off
    by more, not by less. The price is that an effect chosen by chance from noise alone seems worth a little;
    :func:`~thermal_robot.diagnosis.earned.earned` asks for more than that. The intervals are of what fresh rows of the
    same kind would say of the saved model, noise included: for the whole of the mean squares after and before, for an
    effect of its Shapley value. Raises :class:`EstimationError` if all rows repeat one pose, so that there is only one
    fold.
    """
    block = blocks(fit.campaign)
    count = int(block.max()) + 1
    if count < 2:
        raise EstimationError("all rows repeat one pose: nothing can be held out, and nothing told about the robot")
    progress(f"held out: {count} blocks, one at a time")
    before = replace(fit.before, blocks=tuple(columns(fit.nominal, effect) for effect, _ in fit.effects))
    return shrinkage(fit.explanation, before, fit.families, block)


def shrinkage(explanation: Explanation, before: Linear, families: Sequence[str], block: Labels) -> Shrinkage:
    """Cross-validate an explanation, linearised at the corrected model; see :func:`held_out`.

    ``before`` is the problem at the nominal robot with the blocks of the best combination, in their order; rows of one
    ``block`` (N,) are held out together.
    """
    walks = _Walks.of(explanation, before, families, block)
    left = walks.residuals(walks.players)
    far, near = (np.linalg.norm(of[:, :3], axis=1) for of in (walks.residuals(()), left))
    value, interval = share(walks.gain((), walks.players), walks.left(()))
    kept = ~explanation.outliers
    aside = (_rms(far), _rms(near))
    overall = HeldOut("blocked", int(block.max()) + 1, _rms(far[kept]), _rms(near[kept]), value, interval, *aside)
    far[~kept] = near[~kept] = np.nan
    return Shrinkage(overall, far, near, aside, _shares(walks, families), left)


@dataclass(frozen=True, eq=False)
class _Walks:
    """What is left before and after: of the nominal robot, and of the model with some of its effects.

    ``before`` has a part of the model's effects, ``after`` every effect asked about; ``numbers`` are their blocks in
    the explanation, ``players`` those in the model, ``seen`` sums of squares by the effects that are in.
    """

    before: Walk
    after: Walk
    numbers: tuple[int, ...]
    players: tuple[int, ...]
    seen: dict[tuple[int, ...], Squares] = field(default_factory=dict)

    @classmethod
    def of(cls, explanation: Explanation, before: Linear, families: Sequence[str], block: Labels) -> _Walks:
        """Take the effects of the model, and of each other the setting that the evidence likes best beside them."""
        best, further, taken = explanation.best.blocks, {}, set()
        for found in sorted(explanation.combinations, key=lambda c: -c.log_evidence):
            beside = set(found.blocks) - set(best)
            if len(beside) == 1 and len(found.blocks) == len(best) + 1:
                (b,) = beside
                if families[b] not in taken:
                    taken.add(families[b])
                    further[b] = found.scales[b]
        model = Model.of(explanation, block, further)
        parts = model.partial(before, [explanation.values[b][0] for b in best])
        part, whole = (Walk.over(m, each(block)) for m in (parts, model))
        return cls(part, whole, (*best, *further), tuple(range(len(best))))

    def left(self, chosen: Sequence[int]) -> Squares:
        key = tuple(sorted(chosen))
        if key not in self.seen:
            self.seen[key] = self._walk(key).squares(key)
        return self.seen[key]

    def _walk(self, chosen: Sequence[int]) -> Walk:
        return self.after if chosen and set(self.players) <= set(chosen) else self.before

    def gain(self, chosen: Sequence[int], more: Sequence[int]) -> Squares:
        return self.left(chosen) - self.left((*chosen, *more))

    def residuals(self, chosen: Sequence[int]) -> Array:
        """(N, m) what is left of each row while held out, root frame, m and rad; NaN where it never was."""
        walk = self._walk(chosen)
        left = np.full((len(walk.model.block), walk.model.linear.measures), np.nan)
        left[walk.numbers] = walk.residuals(chosen)
        return left


def _rms(distance: Array) -> float:
    return float(np.sqrt(np.nanmean(distance**2)))


def _shares(walks: _Walks, families: Sequence[str]) -> dict[str, Share]:
    """Return by effect its Shapley value, or for an effect outside the model what adding it brings."""
    players, nothing = walks.players, walks.left(())
    shares = {}
    for player in players:
        others = [p for p in players if p != player]
        value = 0.0 * nothing
        for size in range(len(players)):
            weight = factorial(size) * factorial(len(others) - size) / factorial(len(players))
            for chosen in combinations(others, size):
                value += weight * walks.gain(chosen, (player,))
        shares[families[walks.numbers[player]]] = share(value, nothing)
    outside = {families[b]: k for k, b in enumerate(walks.numbers) if k not in players}
    for family in dict.fromkeys(families):
        if family not in shares:
            gained = walks.gain(players, (outside[family],)) if family in outside else 0.0 * nothing
            shares[family] = share(gained, nothing)
    return shares


Rows = NDArray[np.bool_]


def worst_folds(fit: Fit) -> tuple[FoldScheme, ...]:
    """Hold rows out by time, session, temperature, region, reach and range; the largest rms after comes first.

    Its shrinkage need not be the smallest, as the gap before may be larger on its rows, too. Every figure has the noise
    of the held-out rows in it. A scheme is left out if the campaign lacks its column; a fold if its training rows do
    not determine the frames.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    plain = model.bare(fit.before)
    known = events_known(fit, plain, model)
    apart = {"time": (plain, model)}
    found = [_judged(*apart.get(name, known), name, words, tests) for name, words, tests in schemes(fit)]
    return tuple(sorted((f for f in found if f is not None), key=lambda f: -f.rms_after))


def events_known(fit: Fit, plain: Model, model: Model) -> tuple[Model, Model]:
    """Return the models of the frames alone and of a fit once what its events moved is taken out of the gap.

    What stands elsewhere in a session is not told by the others, nor what stood elsewhere in all rows of a region:
    whether the rest carries over to these can be asked only where that is known, as by registering anew.
    """
    e, held = fit.explanation, list(zip(fit.explanation.best.blocks, fit.effects, strict=True))
    events = [(b, effect) for b, (effect, _) in held if is_event(effect)]
    if not events:
        return plain, model
    before = fit.before.gap - sum(block(fit.nominal, effect).columns @ e.values[b][0] for b, effect in events)
    after = e.linear.gap - sum(e.linear.contribution(b, e.values[b][0]) for b, _ in events)
    rest = [k for k, (_, (effect, _)) in enumerate(held) if not is_event(effect)]
    linear = Linear(after, e.linear.frames, tuple(model.linear.blocks[k] for k in rest))
    bare = Linear(before, plain.linear.frames, ())
    scales = tuple(model.scales[k] for k in rest)
    return replace(plain, linear=bare, seen={}), replace(model, linear=linear, scales=scales, seen={})


def hardest(schemes: Sequence[FoldScheme], average: HeldOut) -> FoldScheme | None:
    """Return the least favourable scheme where it leaves clearly more than the average; ``None`` where it does not."""
    return next((s for s in schemes[:1] if s.rms_after > settings.HARDER * average.rms_after), None)


def harmed(schemes: Sequence[FoldScheme]) -> FoldScheme | None:
    """Return the way of holding out by session or region that the correction harms; ``None`` where there is none."""
    return next((s for s in schemes if s.name in ("session", "region") and s.shrinkage < 0.0), None)


def schemes(fit: Fit) -> Iterator[tuple[str, str, list[Rows]]]:
    """Yield name and description of each scheme, and a mask (N,) of the rows that each of its folds holds out."""
    campaign = fit.campaign
    yield "time", "blocks of consecutive rows", each(blocks(campaign))
    session = campaign.labels.get("session")
    if session is not None and len(set(session.tolist())) > 1:
        yield "session", "one session after the other", each(np.unique(session, return_inverse=True)[1])
    temperature = _temperature(campaign)
    if temperature is not None and np.ptp(temperature) > settings.COLDEST:
        yield "temperature", "the coldest fifth, and the warmest", _ends(temperature)
    yield "region", "neighbourhoods of joint positions", each(neighbourhoods(campaign, settings.FOLDS))
    reach = np.linalg.norm(fit.nominal.position, axis=1)
    yield "reach", "the fifth that reaches out furthest", _ends(reach)[1:]
    # where few positions repeat, an end may hold most of the rows
    ends = [end for position in campaign.q[:, moves(campaign.q)].T for end in _ends(position) if end.mean() < 0.5]
    yield "range", "the lowest and the highest fifth of a joint's positions", ends


def _ends(values: Array) -> list[Rows]:
    """Return masks (N,) of the fifths of the rows with the lowest and with the highest values."""
    low, high = np.quantile(values, (1.0 / settings.FOLDS, 1.0 - 1.0 / settings.FOLDS))
    return [values <= low, values >= high]


def _temperature(campaign: Campaign) -> Array | None:
    """(N,) temperature of the robot, or the mean of its links, °C; ``None`` if not recorded."""
    recorded = campaign.covariates
    columns = ["temperature"] if "temperature" in recorded else [c for c in recorded if c.startswith("temperature.")]
    return np.mean([recorded[c] for c in columns], axis=0) if columns else None


def _judged(plain: Model, model: Model, name: str, held_out: str, tests: list[Rows]) -> FoldScheme | None:
    walk = Walk.over(model, tests)
    if not walk.tests:
        return None
    before = Walk(plain, walk.tests).squares(())
    after = walk.squares(range(len(model.spans))) if model.spans else before
    return FoldScheme(
        name,
        held_out,
        len(walk.tests),
        walk.rows,
        float(np.sqrt(before.total / walk.rows)),
        float(np.sqrt(after.total / walk.rows)),
        1.0 - after.total / before.total if before.total > 0.0 else 0.0,
        deviation(np.sqrt(after.without / np.maximum(walk.rows_without, 1.0))),
    )
