"""Whether new rows are of the robot that was diagnosed: what they leave of the model that did not know them.

The residual r of new rows under the model of all rows before has the covariance V = 1 + J C Jᵀ, in units of the noise,
with C that of the parameters. Three questions are asked of it, each at its share of one stated chance.

* rᵀV⁻¹r over its number of figures is the larger, the worse they agree: by the F distribution, of this batch and of all
  since the diagnosis together, whose parts are independent.
* A change that begins with the new rows is one of an effect in them alone: the score test of its columns X,
  uᵀI⁻¹u with u = XᵀV⁻¹r and I = XᵀV⁻¹X, of all effects that can be tested, by Bonferroni.
* Gross errors among them are as frequent as before.

Where what remains is more alike in neighbouring rows than noise is, its mean square scatters more between blocks of
rows than chi-square says; all tests allow as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, fdtrc

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.growing.choice import together
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.settled import Single
from thermal_robot.diagnosis.growing.sums import Seen
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.algebra import equations_of, whitener
from thermal_robot.inference.columns import Block
from thermal_robot.inference.robust import distance_limit


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

    ``scatter`` is times the variance of chi-square by which the mean square of blocks of the diagnosed rows scatters,
    at least 1; ``aside`` of the diagnosed ``rows`` were gross errors.
    """

    tested: tuple[Block, ...]
    scatter: float
    aside: int
    rows: int

    def look(self, before: Grown, new: Single, last: Agreement) -> Agreement:
        """Compare new rows with the model of all before, and with what was seen since the diagnosis."""
        white, k = self._innovation(before, new), len(before.fitted.step)
        total = before.sums.rows + before.single.campaign.samples + len(white)
        near = (white[:, :, -1] ** 2).sum(axis=1) <= distance_limit(before.choice.measures, total)
        flat = equations_of(white[near])
        own, left = flat[:, :k], flat[:, k:]
        root = whitener(self._precision(before) + own.T @ own)
        along = root.T @ (own.T @ left)
        inside = left.T @ left - along.T @ along
        freedom = max(before.fitted.gram.equations + before.fitted.held - before.fitted.best.effective, 1.0)
        found = replace(
            last,
            chi2=float(inside[-1, -1]),
            figures=len(flat),
            whole=last.whole + float(inside[-1, -1]),
            whole_figures=last.whole_figures + len(flat),
            aside=last.aside + int((~near).sum()),
            rows=last.rows + len(white),
        )
        p_change, changed = self._change(inside, freedom)
        return replace(
            found,
            p_batch=self._misfit(found.chi2, found.figures, freedom),
            p_whole=self._misfit(found.whole, found.whole_figures, freedom),
            p_change=p_change,
            changed=changed,
            p_aside=self._gross(found),
        )

    def _innovation(self, before: Grown, new: Single) -> Array:
        """(n, m, K + 1) columns of the chosen and the tested effects, and the residual, in units of the noise."""
        choice = replace(before.choice, rivals=self.tested)
        rows = Seen.at(new.campaign, before.fitted.point, choice, rivals=True).alike
        return np.asarray(rows / before.fitted.noise[:, None])

    @staticmethod
    def _precision(before: Grown) -> Array:
        """(k, k) inverse covariance of frames and parameters, by all rows before and the prior."""
        fitted, choice = before.fitted, before.choice
        sizes = together([b.sizes * fitted.best.scales[k] for k, b in enumerate(choice.blocks)])
        products = fitted.products[:-1, :-1] / fitted.best.noise**2
        tight = np.concatenate([np.zeros(len(products) - len(sizes)), sizes**-2.0])
        return np.asarray(products + np.diag(tight))

    def _misfit(self, chi2: float, figures: int, freedom: float) -> float:
        return float(fdtrc(figures / self.scatter, freedom / self.scatter, chi2 / figures)) if figures else 1.0

    def _gross(self, found: Agreement) -> float:
        """Chance of so many gross errors, by how many there were before (negative binomial, Jeffreys' prior)."""
        if not found.aside:
            return 1.0
        return float(betainc(found.aside, self.aside + 0.5, found.rows / (found.rows + self.rows)))

    def _change(self, inside: Array, freedom: float) -> tuple[float, tuple[str, str]]:
        """Return the chance of the largest change among all that were looked for, and what it is of."""
        best, where, start = 1.0, ("", ""), 0
        for item in self.tested:
            own = np.arange(start, start + len(item.sizes))
            start += len(item.sizes)
            size = np.outer(item.sizes, item.sizes)
            root = whitener(inside[np.ix_(own, own)] * size)
            score = root.T @ (inside[own, -1] * item.sizes)
            if not len(score):
                continue
            chance = float(fdtrc(len(score), freedom, float(score @ score) / len(score) / self.scatter))
            if chance < best:
                length = np.sqrt(np.maximum(np.diag(inside)[own], chosen.TINY))
                largest = item.bare[int(np.argmax(np.abs(inside[own, -1]) / length))]
                best, where = chance, (item.effect.name, largest.name)
        return min(best * len(self.tested), 1.0), where


def scatter_of(left: Array, blocks: Sequence[NDArray[np.bool_]]) -> float:
    """Variance of sums of squares of blocks (N,) of rows over that of chi-square, at least 1; ``left`` is (N, m)."""
    if len(blocks) < 2:
        return 1.0
    squares = (left**2).sum(axis=1)
    squares = squares * left.size / max(float(squares.sum()), chosen.TINY)
    figures = np.array([own.sum() * left.shape[1] for own in blocks])
    apart = np.array([squares[own].sum() for own in blocks]) - figures
    return max(float((apart**2 / (2.0 * figures)).sum()) / (len(blocks) - 1), 1.0)
