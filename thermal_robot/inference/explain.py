"""From the linear problem to an explanation: effects, outliers and noise, found together until they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect
from thermal_robot.inference import settings
from thermal_robot.inference.discrepancy import Form
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.ladder import PLAIN, Ladder, Rung
from thermal_robot.inference.problem import Linear, Whitening, discrepancy_mean, frame_step, parameter_values
from thermal_robot.inference.robust import Noise, distance_limit, first_whitening, reweigh
from thermal_robot.inference.stack import Stack

NOTHING = np.zeros(0)


@dataclass(frozen=True)
class Discrepancy:
    """What no effect accounts for: the probability that there is any, and of each form by its name.

    Beside the best combination: ``form`` and ``tau``, its rms over the noise (``None`` and 0 where there is none), and
    ``noise`` in units of the whitening noise.
    """

    form: Form | None
    tau: float
    probability: float
    forms: Mapping[str, float]
    noise: float = 1.0


@dataclass(frozen=True, eq=False)
class Explanation:
    """The most probable combination of effects, with its outliers and noise, and the probability of each rival.

    ``problem`` is the Gram matrix of the ``linear`` problem at the final ``whitening``; ``combinations`` all that were
    compared, most probable first, without values; ``values`` mean and covariance per block of the best; ``remainder``
    (N, m) the residual of all rows, gap less effects and frames; ``smooth`` (N, m) the discrepancy's posterior mean,
    part of it; ``outliers`` (N,) rows set aside; ``searched`` holds all that was weighed.
    """

    linear: Linear
    whitening: Whitening
    problem: Gram
    best: Combination
    combinations: Sequence[Combination]
    probabilities: Array
    values: dict[int, tuple[Array, Array]]
    remainder: Array
    smooth: Array
    outliers: NDArray[np.bool_]
    discrepancy: Discrepancy
    forms: Sequence[Form]
    searched: _Round | None = None

    def without(self, out: Sequence[int]) -> Explanation:
        """Return the best explanation without some blocks, at the same weights, from all that was weighed before."""
        if self.searched is None:
            raise ValueError("what was weighed for this explanation is no longer known")
        return self.searched.without(frozenset(out)).told(self.outliers)

    def block_of(self, effect: Effect) -> int:
        """Return the block of the best combination that is this effect, in whatever setting."""
        return next(b for b in self.best.blocks if self.linear.blocks[b].effect.name == effect.name)

    def held(self, block: int) -> Array:
        """(P,) prior standard deviation of a block's parameters, SI; one that is held at zero has next to none."""
        item = self.linear.blocks[block]
        return item.sizes * self.best.scales[block] * item.kept(self.values[block][0])

    def far(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(N,) True for those of the given rows whose residual is larger than noise allows."""
        beyond = self.whitening.sigma() * self.best.noise * np.hypot(1.0, self.discrepancy.tau)
        distance2 = ((self.remainder / beyond) ** 2).sum(axis=1)
        return np.asarray(rows & (distance2 > distance_limit(self.linear.measures, len(rows))))

    def probability(self, blocks: Sequence[int]) -> float:
        """Posterior probability that any of the blocks is at work."""
        held = [bool(set(c.blocks) & set(blocks)) for c in self.combinations]
        return min(float(self.probabilities[held].sum()), 1.0)


def explain(
    linear: Linear,
    noise: Noise,
    *,
    rows: NDArray[np.bool_] | None = None,
    families: Sequence[str] = (),
    starts: Sequence[Sequence[int]] = (),
    outliers: NDArray[np.bool_] | None = None,
    before: Explanation | None = None,
    forms: Sequence[Form] = (),
    log_prior: Sequence[float] | None = None,
) -> Explanation:
    """Find the most probable combination of blocks together with outliers, noise and what no block accounts for.

    Robust: rows further than noise allows are set aside, those in the tail weigh less (Huber). Rows not in ``rows``
    (N,) bear on nothing. Blocks of one family are settings that exclude each other and share its prior probability.
    ``starts`` and ``outliers`` are where the search starts. Where a problem like it was explained ``before``, its
    weights and noise are kept, and of the forms those that it left in question; where the first of the starts comes out
    again beside the same form, that is the answer. ``log_prior`` is by default that of the blocks' effects.
    """
    samples = len(linear.gap)
    use = np.ones(samples, dtype=bool) if rows is None else rows
    outliers = before.outliers if before and outliers is None else outliers
    aside = np.zeros(samples, dtype=bool) if outliers is None else outliers & use
    families = families or [str(k) for k in range(len(linear.blocks))]
    log_prior = log_priors([b.effect for b in linear.blocks]) if log_prior is None else log_prior
    asked = _Asked(linear, families, log_prior, settings_of_one(families), len(forms), Stack.of(linear.columns))
    seeds = [tuple(sorted(start)) for start in starts]
    first, beside, history = before is None, list[Form](), list[tuple[object, ...]]()
    if before is None:
        # effects that are far off, and gross errors, are settled first, beside a noise that is free
        whitening = replace(first_whitening(linear, noise, use & ~aside), held=0.0)
    else:
        whitening, alive = replace(before.whitening, smooth=None), {form.name for form in before.forms}
        beside, form = [form for form in forms if form.name in alive], before.discrepancy.form
        history += [(seed, form and form.words, np.packbits(whitening.weights > 0).tobytes()) for seed in seeds[:1]]
    while True:
        found = _Round.of(asked, whitening, beside, seeds)
        used = np.packbits(whitening.weights > 0).tobytes()
        if history and ((*found.state, used) in history or len(history) >= settings.FIRST_ROUNDS):
            found = found.without(frozenset())  # weights stay: only now is it worth to look for what steps miss
            if (*found.state, used) in history or len(history) >= settings.FIRST_ROUNDS:
                return found.told(aside)
        history.append((*found.state, used))
        whitening, aside = reweigh(found.rough, noise, use, found.leverage, linear.measures)
        seeds = [found.best.blocks]
        beside = [*(forms if first else found.ladder.in_question(found.best))]
        first = False
        del found  # before the next one takes as much memory


@dataclass(frozen=True, eq=False)
class _Asked:
    """What stays the same in all rounds."""

    linear: Linear
    families: Sequence[str]
    log_prior: Sequence[float]
    rivals: frozenset[frozenset[int]]
    forms: int
    stack: Stack


@dataclass(frozen=True, eq=False)
class _Round:
    """One search with given weights: the best combination, the discrepancy beside it, and what both leave."""

    asked: _Asked
    ladder: Ladder
    rung: Rung
    best: Combination
    remainder: Array
    smooth: Array

    @classmethod
    def of(
        cls, asked: _Asked, whitening: Whitening, beside: Sequence[Form], seeds: Sequence[tuple[int, ...]]
    ) -> _Round:
        ladder = Ladder(asked.linear, whitening, list(beside), asked.log_prior, asked.rivals, asked.forms, asked.stack)
        return cls._on(asked, ladder, seeds, detours=False)

    def without(self, out: frozenset[int]) -> _Round:
        """Return the round without some blocks, started from the best of what was weighed without them."""
        return self._on(self.asked, self.ladder.without(out), [tuple(b for b in self.best.blocks if b not in out)])

    @classmethod
    def _on(cls, asked: _Asked, ladder: Ladder, seeds: Sequence[tuple[int, ...]], *, detours: bool = True) -> _Round:
        ladder.run(seeds, detours=detours)
        rung, best = ladder.consensus(asked.families)
        white = ladder.whitened_at(rung)
        remainder = left_of(asked.linear, white, parameter_values(asked.linear, ladder.beside(rung).gram, best))
        return cls(asked, ladder, rung, best, remainder, discrepancy_mean(white, remainder))

    @property
    def form(self) -> Form | None:
        return self.ladder.forms[self.rung[0]] if self.rung[0] >= 0 else None

    @property
    def state(self) -> tuple[object, ...]:
        return self.best.blocks, self.form and self.form.words

    @property
    def rough(self) -> Array:
        """(N, m) what neither effects nor a smooth discrepancy follow; one that is anew hides no gross error."""
        return self.remainder if self.form is None or self.form.anew else self.remainder - self.smooth

    @property
    def leverage(self) -> float:
        """Share of the equations that effects, frames and a smooth discrepancy take up."""
        flat, smooth = self.asked.linear.frames.shape[2], self.ladder.whitened_at(self.rung).smooth
        followed = self.best.effective + flat
        if smooth is not None and self.form is not None and not self.form.anew:
            followed += smooth.degrees
        equations = self.ladder.beside(self.rung).gram.equations + flat
        return float(min(followed / max(equations, 1), settings.MOST_LEVERAGE))

    def told(self, aside: NDArray[np.bool_]) -> Explanation:
        """Return the explanation.

        Settings and values are those that correct best: beside a smooth discrepancy, which is no part of the
        correction, the effects are fitted as if there were none, at a noise that holds it.
        """
        linear, ladder = self.asked.linear, self.ladder
        rung = self.rung if self.form is None or self.form.anew else PLAIN
        search, white = ladder.beside(rung), ladder.whitened_at(rung)
        best = (
            search.evaluate(self.best.blocks)
            if rung == self.rung
            else search.set_best(self.best.blocks, self.asked.families)
        )
        values = parameter_values(linear, search.gram, best)
        ladder.weigh_pairs(self.rung, self.best)
        compared, probabilities = ladder.probabilities()
        odds = ladder.forms_in_question()
        return Explanation(
            linear,
            white,
            search.gram,
            best,
            [replace(c, values=NOTHING, covariance=NOTHING) for c in compared],
            probabilities,
            values,
            left_of(linear, white, values),
            self.smooth,
            aside,
            Discrepancy(self.form, self.rung[1], 1.0 - odds.get("", 0.0), odds, self.best.noise),
            ladder.in_question(self.best),
            self,
        )


def log_odds() -> float:
    """Return the log prior odds of one effect."""
    return float(np.log(settings.PRIOR_PROBABILITY / (1.0 - settings.PRIOR_PROBABILITY)))


def settings_of_one(families: Sequence[str]) -> frozenset[frozenset[int]]:
    """Return the pairs of blocks that are settings of one effect: they exclude each other."""
    pairs = combinations(range(len(families)), 2)
    return frozenset(frozenset((a, b)) for a, b in pairs if families[a] == families[b])


def log_priors(effects: Sequence[Effect]) -> list[float]:
    """Return the log prior odds of each setting of an effect: it has its share of those of its name.

    An effect is as likely in all its places as in one of them, in two half as likely, in three half of that; places are
    alike, and settings of the same places share by their weight. What is listed beside a setting in other places does
    not change its share.
    """
    single: dict[str, set[str]] = {effect.name: set() for effect in effects}
    for effect in effects:
        single[effect.name].update(effect.places if len(effect.places) == 1 else ())
    kin = [(e.name, frozenset(e.places if single[e.name] else ())) for e in effects]
    # a constant that stands apart is as rare as an effect
    own = [effect.weight * float(np.exp(log_odds() * effect.apart)) for effect in effects]
    alike: dict[tuple[str, frozenset[str]], float] = {}
    for key, weight in zip(kin, own, strict=True):
        alike[key] = alike.get(key, 0.0) + weight
    shares = [
        share_of_places(len(key[1]), len(single[key[0]])) * weight / alike[key]
        if effect.share is None
        else effect.share
        for effect, key, weight in zip(effects, kin, own, strict=True)
    ]
    return [log_odds() + float(np.log(share)) for share in shares]


def share_of_places(count: int, among: int) -> float:
    """Prior probability that an effect acts in exactly so many given places, in all where 0; 1 where it has none."""
    return settings.IN_ALL * settings.ONE_MORE ** max(count - 1, 0) / comb(max(among, count), count) if among else 1.0


def left_of(linear: Linear, whitening: Whitening, values: dict[int, tuple[Array, Array]]) -> Array:
    """(N, m) gap less effects and frames."""
    moved = (linear.contribution(b, mean) for b, (mean, _) in values.items())
    left = linear.gap - sum(moved, np.zeros_like(linear.gap))
    return np.asarray(left - linear.frames @ frame_step(linear, whitening, left))
