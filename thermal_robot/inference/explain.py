"""From the linear problem to an explanation: effects, outliers and noise, found together until they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects import Effect
from thermal_robot.inference import settings
from thermal_robot.inference.discrepancy import Form
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.ladder import Ladder
from thermal_robot.inference.problem import Linear, Whitening, discrepancy_mean, frame_step, parameter_values
from thermal_robot.inference.robust import Noise, distance_limit, first_whitening, reweigh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Discrepancy:
    """What no effect accounts for.

    Attributes
    ----------
    form, tau
        Beside the best combination: which, and its rms over the noise; ``None`` and 0 where there is none.
    probability
        That there is any.
    forms
        Probability of each form by its name, those of the forms that are not in question left out.
    """

    form: Form | None
    tau: float
    probability: float
    forms: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Explanation:
    """The most probable combination of effects, with its outliers and noise, and the probability of each rival.

    Attributes
    ----------
    linear, whitening, problem
        The linear problem, and the final weights and noise; ``problem`` is its Gram matrix.
    best
        The most probable combination.
    combinations, probabilities
        All that were compared, most probable first.
    values
        Per block of the best combination: mean and covariance of its parameters.
    remainder
        (N, m) residual: gap less effects and frames, for all rows, used or not.
    smooth
        (N, m) posterior mean of the discrepancy, a part of the residual.
    outliers
        (N,) True for rows set aside.
    discrepancy
        What no effect accounts for.
    forms
        Of the discrepancy that were considered.
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

    def far(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(N,) True for those of the given rows whose residual is larger than noise allows."""
        beyond = self.whitening.noise * self.best.noise * np.hypot(1.0, self.discrepancy.tau)
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
    forms: Sequence[Form] = (),
    log_prior: Sequence[float] | None = None,
) -> Explanation:
    """Find the most probable combination of blocks together with outliers, noise and what no block accounts for.

    Parameters
    ----------
    linear
        The problem.
    noise
        As the campaign states it.
    rows
        (N,) rows to use; all where absent. The others are held out: they bear on nothing.
    families
        Name of the effect that each block belongs to: blocks of one effect are settings that exclude each other and
        share its prior probability.
    starts, outliers
        Where the search starts: combinations of blocks, and rows set aside.
    forms
        Of the discrepancy that is considered; none where nothing but noise may remain.
    log_prior
        Log prior odds of each block; see :func:`log_priors`, by which those of the blocks' effects are taken if absent.

    Returns
    -------
    Explanation
        Robust: rows further than noise allows from the explanation are set aside, and rows in the tail weigh less
        (Huber).
    """
    measures, samples = linear.measures, len(linear.gap)
    use = np.ones(samples, dtype=bool) if rows is None else rows
    aside = np.zeros(samples, dtype=bool) if outliers is None else outliers & use
    families = families or [str(k) for k in range(len(linear.blocks))]
    log_prior = log_priors([b.effect for b in linear.blocks]) if log_prior is None else log_prior
    rivals = settings_of_one(families)
    whitening = first_whitening(linear, noise, use & ~aside)
    history: list[tuple[object, ...]] = []
    # a smooth discrepancy would follow gross errors, and a noise that is far off: those are settled first
    beside: Sequence[Form] = ()
    seeds = [tuple(start) for start in starts]
    while True:
        ladder = Ladder(linear, whitening, beside, log_prior, rivals)
        ladder.run(seeds)
        rung, best = ladder.consensus(families)
        white = ladder.whitened_at(rung)
        values = parameter_values(linear, ladder.at(rung).gram, best)
        remainder = _remainder(linear, values)
        step = frame_step(linear, white, remainder)
        remainder = remainder - linear.frames @ step
        smooth = discrepancy_mean(white, remainder)
        form = ladder.forms[rung[0]] if rung[0] >= 0 else None
        state = (best.blocks, form and form.name, rung[1], np.packbits(whitening.weights > 0).tobytes())
        if history and (state in history or len(history) >= settings.FIRST_ROUNDS):
            break
        history.append(state)
        # what a pose brings of its own hides no gross error
        close = white.smooth if form and not form.anew else None
        followed = best.effective + linear.frames.shape[2] + (close.degrees if close else 0.0)
        leverage = followed / max(ladder.at(rung).gram.equations + linear.frames.shape[2], 1)
        whitening, aside = reweigh(
            remainder - smooth if close else remainder, noise, use, min(leverage, settings.MOST_LEVERAGE), measures
        )
        seeds, beside = [best.blocks], ladder.in_question(best) if len(history) > 1 else forms
    compared, probabilities = ladder.probabilities()
    odds = ladder.forms_in_question()
    return Explanation(
        linear,
        white,
        ladder.at(rung).gram,
        best,
        compared,
        probabilities,
        values,
        remainder,
        smooth,
        aside,
        Discrepancy(form, rung[1], 1.0 - odds.get("", 0.0), odds),
        ladder.forms,
    )


def log_odds() -> float:
    """Return the log prior odds of one effect."""
    return float(np.log(settings.PRIOR_PROBABILITY / (1.0 - settings.PRIOR_PROBABILITY)))


def settings_of_one(families: Sequence[str]) -> frozenset[frozenset[int]]:
    """Return the pairs of blocks that are settings of one effect: they exclude each other."""
    pairs = combinations(range(len(families)), 2)
    return frozenset(frozenset((a, b)) for a, b in pairs if families[a] == families[b])


def log_priors(effects: Sequence[Effect]) -> list[float]:
    """Return the log prior odds of each setting of an effect: it has its share of those of its name."""
    names = [effect.name for effect in effects]
    shares = [1.0 / names.count(e.name) if e.share is None else e.share for e in effects]
    return [log_odds() + float(np.log(share)) for share in shares]


def _remainder(linear: Linear, values: dict[int, tuple[Array, Array]]) -> Array:
    moved = (linear.contribution(b, mean) for b, (mean, _) in values.items())
    return linear.gap - sum(moved, np.zeros_like(linear.gap))
