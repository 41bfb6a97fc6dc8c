"""Tests of new rows against the model that did not know them: whether a diagnosis's choice of effects still stands.

The residual r of new rows under the model of all rows before has the covariance V = 1 + J C Jᵀ, in units of the noise,
with C that of the parameters. Each test has its share of one stated chance.

* F test of the predictive χ² rᵀV⁻¹r over its number of figures, of this batch and of all since the diagnosis together,
  whose parts are independent.
* Score test of a change that begins with the new rows, an effect in them alone: with its columns X, uᵀI⁻¹u with
  u = XᵀV⁻¹r and I = XᵀV⁻¹X, of all effects that can be tested, by Bonferroni.
* Gross errors among them are as frequent as before: negative binomial, with Jeffreys' prior.
* Order statistics: rows outside of what was measured are as many as chance puts there.

Where the residual is more alike in neighbouring rows than noise is, its mean square scatters more between blocks of
rows than χ² says; the first two allow as much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, fdtrc, gammaln

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import CLOCK
from thermal_robot.diagnosis.sequential import Sequential
from thermal_robot.diagnosis.sufficient import Rows, linearised
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, whitener
from thermal_robot.inference.columns import Block
from thermal_robot.inference.robust import distance_limit
from thermal_robot.prediction import Spread

LEVEL = 1e-3 / 5.0
"""p-value of one test below which the choice falls: new rows of the same robot and the same noise make it fall once in
a thousand updates, a chance that five tests share."""
FEWEST_OUTSIDE, OUTSIDE = 3, 0.05
"""Rows, and share of the new rows, beyond what was measured from which on the choice is to be made anew: a model of
effects that were told apart inside says little of those that show outside alone."""


@dataclass(frozen=True)
class Agreement:
    """How well new rows agree with the model that did not know them.

    Attributes
    ----------
    chi2, figures
        rᵀV⁻¹r of the new rows, and of how many figures.
    whole, whole_figures
        The same of all rows since the diagnosis.
    aside, rows
        Gross errors since the diagnosis, and of how many rows.
    p_batch, p_whole, p_change, p_aside
        Chance of so large a figure where nothing changed: of the misfit of these rows and of all since the diagnosis,
        of the largest change, and of so many gross errors.
    changed
        Effect and parameter that a change would be of.
    """

    chi2: float = 0.0
    figures: int = 0
    whole: float = 0.0
    whole_figures: int = 0
    aside: int = 0
    rows: int = 0
    p_batch: float = 1.0
    p_whole: float = 1.0
    p_change: float = 1.0
    p_aside: float = 1.0
    changed: tuple[str, str] = ("", "")


@dataclass(frozen=True, eq=False)
class Watch:
    """What new rows are compared with: ``tested`` are the effects of which a change is looked for, without columns.

    ``scatter`` is times the variance of χ² by which the mean square of blocks of the diagnosed rows scatters, at least
    1; ``aside`` of the diagnosed ``rows`` were gross errors.
    """

    tested: tuple[Block, ...]
    scatter: float
    aside: int
    rows: int

    def look(self, before: Sequential, new: Rows, last: Agreement) -> Agreement:
        """Compare new rows with the model of all before, and with what was seen since the diagnosis."""
        fitted, choice = before.fitted, replace(before.choice, rivals=self.tested)
        white = linearised(new.campaign, fitted.point, choice, rivals=True) / fitted.noise[:, None]
        near = (white[:, :, -1] ** 2).sum(axis=1) <= distance_limit(choice.measures, before.samples + len(white))
        flat, k = equations_of(white[near]), len(fitted.step)
        own, left = flat[:, :k], flat[:, k:]
        root = whitener(fitted.precision(fitted.expected(choice), frames=np.inf) + own.T @ own)
        along = root.T @ (own.T @ left)
        inside = left.T @ left - along.T @ along  # Woodbury: (X, r)ᵀ V⁻¹ (X, r)
        freedom = max(fitted.gram.equations + fitted.held - fitted.best.effective, 1.0)
        chi2, figures, rows = float(inside[-1, -1]), len(flat), last.rows + len(white)
        whole, whole_figures = last.whole + chi2, last.whole_figures + figures
        aside = last.aside + int((~near).sum())
        p_change, changed = self._change(inside, freedom)
        return Agreement(
            *(chi2, figures, whole, whole_figures, aside, rows),
            p_batch=self._misfit(chi2, figures, freedom),
            p_whole=self._misfit(whole, whole_figures, freedom),
            p_change=p_change,
            p_aside=float(betainc(aside, self.aside + 0.5, rows / (rows + self.rows))) if aside else 1.0,
            changed=changed,
        )

    def _misfit(self, chi2: float, figures: int, freedom: float) -> float:
        return float(fdtrc(figures / self.scatter, freedom / self.scatter, chi2 / figures)) if figures else 1.0

    def _change(self, inside: Array, freedom: float) -> tuple[float, tuple[str, str]]:
        """Score test: the chance of the largest change among all that were looked for, and what it is of."""
        best, where, end = 1.0, ("", ""), 0
        for item in self.tested:
            own = slice(end, end := end + len(item.sizes))
            root = whitener(inside[own, own] * np.outer(item.sizes, item.sizes))
            score = root.T @ (inside[own, -1] * item.sizes)
            if not len(score):
                continue
            chance = float(fdtrc(len(score), freedom, float(score @ score) / len(score) / self.scatter))
            if chance < best:
                length = np.sqrt(np.maximum(np.diag(inside)[own], settings.TINY))
                largest = item.bare[int(np.argmax(np.abs(inside[own, -1]) / length))]
                best, where = chance, (item.effect.name, largest.name)
        return min(best * len(self.tested), 1.0), where


def scatter_of(left: Array, blocks: Sequence[NDArray[np.bool_]]) -> float:
    """Variance of sums of squares of blocks (N,) of rows over that of χ², at least 1; ``left`` is (N, m)."""
    if len(blocks) < 2:
        return 1.0
    squares = (left**2).sum(axis=1)
    squares = squares * left.size / max(float(squares.sum()), settings.TINY)
    figures = np.array([own.sum() * left.shape[1] for own in blocks])
    apart = np.array([squares[own].sum() for own in blocks]) - figures
    return max(float((apart**2 / (2.0 * figures)).sum()) / (len(blocks) - 1), 1.0)


def misfits(a: Agreement) -> Iterator[str]:
    """Yield a sentence for each test that is unlikely where the robot and its noise are as they were."""
    rest = "times the mean square that noise and the parameters' deviations allow"
    if a.p_batch < LEVEL:
        yield f"The new rows leave {a.chi2 / a.figures:.3g} {rest} (p = {a.p_batch:.1g})."
    elif a.p_whole < LEVEL:
        yield f"The rows since the diagnosis leave {a.whole / a.whole_figures:.3g} {rest} (p = {a.p_whole:.1g})."
    if a.p_change < LEVEL:
        what = "{} would explain, most of it in {}".format(*a.changed)
        yield f"Something begins with the new rows that {what} (p = {a.p_change:.1g})."
    if a.p_aside < LEVEL:
        yield f"{a.aside} of {a.rows} rows since the diagnosis are gross errors (p = {a.p_aside:.1g})."


def beyond(spread: Spread | None, rows: Campaign, before: int) -> Iterator[str]:
    """Yield that many of the new rows leave what was measured by ``before`` rows, and not by chance.

    Of rows in no particular order, the k of n new ones that are the outermost of all N + n, at either end, have the
    chance (k + 1) · n!/(n − k)! · (N + n − k)!/(N + n)!.
    """
    known = () if spread is None else spread.outside(rows)
    outside = [[name for name in names if name not in CLOCK] for names in known]  # time goes on
    count, n = sum(bool(names) for names in outside), rows.samples
    if spread is None or count < max(FEWEST_OUTSIDE, OUTSIDE * n):
        return
    for name in dict.fromkeys(name for own in outside for name in own):
        k = sum(name in own for own in outside)
        chance = np.log(k + 1.0) + gammaln([n + 1.0, before + n - k + 1.0]).sum()
        chance -= gammaln([n - k + 1.0, before + n + 1.0]).sum()
        if chance + np.log(len(spread.ranges)) < np.log(LEVEL):
            yield f"{k} of {n} new rows lie outside of what was measured, in {name}."
