"""How far the gap shrinks, on rows that were not used for the fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.one_walk import Model, Squares, Walk, share
from thermal_robot.diagnosis.parts import HeldOut
from thermal_robot.errors import EstimationError
from thermal_robot.inference.columns import block as columns
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import blocks, each

Labels = NDArray[np.int64]
Share = tuple[float, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """Held-out shrinkage of the gap, overall and per effect; all with the noise of the held-out rows in it.

    Attributes
    ----------
    overall
        Rms before and after on held-out rows; :func:`held_out` says what is fitted anew in each fold.
    before, after
        (N,) distance of each row while it was held out, m; NaN where it was set aside.
    with_aside
        Rms before and after, m, over all held-out rows: those set aside count, too.
    shares
        By effect: share of the gap's mean square with its 95 % interval. For an effect of the fit it is the Shapley
        value, and these sum to the overall shrinkage; for another the gain from adding it to the fit.
    left
        (N, m) what the model left of each row while it was held out, root frame, m and rad; those set aside, too. NaN
        where a row never was held out.
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
    :func:`~thermal_robot.diagnosis.earned.earned` asks for more than that.

    The intervals are of what fresh rows of the same kind would say of the saved model, noise included: for the whole of
    the mean squares after and before, for an effect of its Shapley value.

    Raises
    ------
    EstimationError
        If all rows repeat one pose, so that there is only one fold.
    """
    block = blocks(fit.campaign)
    count = int(block.max()) + 1
    if count < 2:
        raise EstimationError("all rows repeat one pose: nothing can be held out, and nothing told about the robot")
    progress(f"held out: {count} blocks, one at a time")
    before = replace(fit.before, blocks=tuple(columns(fit.nominal, effect) for effect, _ in fit.effects))
    return shrinkage(fit.explanation, before, fit.families, block)


def shrinkage(explanation: Explanation, before: Linear, families: Sequence[str], block: Labels) -> Shrinkage:
    """Cross-validate an explanation; see :func:`held_out`.

    Parameters
    ----------
    explanation
        Linearised at the corrected model.
    before
        The problem at the nominal robot with the blocks of the explanation's best combination, in their order.
    families
        Name of the effect that each block of the explanation belongs to.
    block
        (N,) label 0..B−1 of each row: which are held out together.
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

    Attributes
    ----------
    before, after
        The walks: of the nominal robot with a part of the model's effects, and of the model with every effect that is
        asked about.
    numbers
        Per effect of the walk: its block in the explanation.
    players
        Those that are in the model.
    seen
        Sums of squares by the effects that are in.
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
