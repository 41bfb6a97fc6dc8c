"""Update of a diagnosis with new rows: the model stays while tests accept it, its parameters are estimated anew.

The residual r of new rows under the model of all rows before has the covariance V = 1 + J C Jᵀ, in units of the noise,
with C that of the parameters. Each test has its share of one stated chance.

* F test of the predictive χ² rᵀV⁻¹r over its number of figures, of this batch and of all since the diagnosis together,
  whose parts are independent.
* Score test of a change that begins with the new rows, an effect in them alone: with its columns X, uᵀI⁻¹u with
  u = XᵀV⁻¹r and I = XᵀV⁻¹X, of all effects that can be tested, by Bonferroni.
* Gross errors among them are as frequent as before: negative binomial, with Jeffreys' prior.
* Order statistics: rows outside of what was measured are as many as chance puts there.

Autocorrelated residuals make sums of squares of blocks overdispersed; the first two tests are corrected for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, fdtrc, gammaln
from threadpoolctl import threadpool_limits

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.read import more_rows
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis import settings as own_settings
from thermal_robot.diagnosis.sequential import (
    Choice,
    Fitted,
    Judge,
    Point,
    Sequential,
    State,
    Sums,
    WeightedRows,
    joined,
    linearised,
    normal,
)
from thermal_robot.diagnosis.values import Unexplained
from thermal_robot.effects import Effect, gate, library
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, whitener
from thermal_robot.inference.columns import Block, block, unknown_frames
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.explain import log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import blocks, each
from thermal_robot.inference.inside import identified
from thermal_robot.inference.weights import Noise, distance_limit
from thermal_robot.observables import seen_components
from thermal_robot.observations import observe
from thermal_robot.prediction import Spread, moves

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Agreement:
    """Goodness of fit of new rows under the model that was fitted without them.

    Attributes
    ----------
    chi2, figures
        rᵀV⁻¹r of the new rows, and of how many figures.
    whole, whole_figures
        As ``chi2`` and ``figures``, for all rows since the diagnosis.
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
    """Reference for tests of new rows; ``tested`` are effects, without columns, of which a change is looked for.

    ``scatter``, at least 1: overdispersion of the mean squares of blocks of diagnosed rows, their variance over that of
    χ²; ``aside`` of the diagnosed ``rows`` were gross errors.
    """

    tested: tuple[Block, ...]
    scatter: float
    aside: int
    rows: int

    def look(self, before: Sequential, new: WeightedRows, last: Agreement) -> Agreement:
        """Test new rows, and all since the diagnosis, against the posterior predictive of the rows before them."""
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
        """Score test for the largest change among all tested effects: its p-value, effect and parameter."""
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
        return min(best * max(len(self.tested), 1), 1.0), where


def scatter_of(left: Array, blocks: Sequence[NDArray[np.bool_]]) -> float:
    """Overdispersion factor, at least 1: variance of sums of squares over blocks (N,) of rows over that of χ²."""
    if len(blocks) < 2:
        return 1.0
    squares = (left**2).sum(axis=1)
    squares = squares * left.size / max(float(squares.sum()), settings.TINY)
    figures = np.array([own.sum() * left.shape[1] for own in blocks])
    apart = np.array([squares[own].sum() for own in blocks]) - figures
    return max(float((apart**2 / (2.0 * figures)).sum()) / (len(blocks) - 1), 1.0)


def misfits(a: Agreement) -> Iterator[str]:
    """Yield a sentence for each test that rejects an unchanged robot and noise."""
    rest = "times the mean square that noise and the parameters' deviations allow"
    if a.p_batch < own_settings.FALLS:
        yield f"The new rows leave {a.chi2 / a.figures:.3g} {rest} (p = {a.p_batch:.1g})."
    elif a.p_whole < own_settings.FALLS:
        yield f"The rows since the diagnosis leave {a.whole / a.whole_figures:.3g} {rest} (p = {a.p_whole:.1g})."
    if a.p_change < own_settings.FALLS:
        what = "{} would explain, most of it in {}".format(*a.changed)
        yield f"Something begins with the new rows that {what} (p = {a.p_change:.1g})."
    if a.p_aside < own_settings.FALLS:
        yield f"{a.aside} of {a.rows} rows since the diagnosis are gross errors (p = {a.p_aside:.1g})."


def beyond(spread: Spread | None, rows: Campaign, before: int) -> Iterator[str]:
    """Test for extrapolation: yield a sentence for each quantity in which too many new rows leave the measured range.

    Of rows in no particular order, the k of n new ones that are the outermost of all N + n, at either end, have the
    chance (k + 1) · n!/(n − k)! · (N + n − k)!/(N + n)!.
    """
    known = () if spread is None else spread.outside(rows)
    outside = [[name for name in names if name not in CLOCK] for names in known]  # time goes on
    count, n = sum(bool(names) for names in outside), rows.samples
    if spread is None or count < max(own_settings.FEWEST_OUTSIDE, own_settings.OUTSIDE * n):
        return
    for name in dict.fromkeys(name for own in outside for name in own):
        k = sum(name in own for own in outside)
        chance = np.log(k + 1.0) + gammaln([n + 1.0, before + n - k + 1.0]).sum()
        chance -= gammaln([n - k + 1.0, before + n + 1.0]).sum()
        if chance + np.log(len(spread.ranges)) < np.log(own_settings.FALLS):
            yield f"{k} of {n} new rows lie outside of what was measured, in {name}."


class Runner(NamedTuple):
    """Alternative combination: blocks of a :class:`Choice`, log prior odds against the chosen one, names."""

    blocks: tuple[int, ...]
    log_prior: float
    names: tuple[str, ...]


def runners_up(fit: Fit) -> list[tuple[int, ...]]:
    """Most probable alternative combinations, at most ``RUNNERS``, each of ``LEAST_RIVAL`` times the chosen one's."""
    e = fit.explanation
    known = [(c.blocks, p) for c, p in zip(e.combinations, e.probabilities, strict=True)]
    own = max((p for blocks, p in known if blocks == e.best.blocks), default=1.0)
    found = [blocks for blocks, p in known if blocks != e.best.blocks and own_settings.LEAST_RIVAL * own <= p]
    return list(dict.fromkeys(found))[: own_settings.RUNNERS]


def chosen(fit: Fit) -> tuple[Choice, list[Runner]]:
    """Choice of a diagnosis with its effects in their settings, and the alternative combinations.

    With a discrepancy in the model, rows keep their weights, which depend on it.
    """
    e, near, prior = (
        fit.explanation,
        runners_up(fit),
        log_priors([item.effect for item in fit.explanation.linear.blocks]),
    )
    further = sorted({b for found in near for b in found} - {*e.best.blocks})
    place = {b: k for k, b in enumerate((*e.best.blocks, *further))}
    odds = [sum(prior[b] for b in found) - sum(prior[b] for b in e.best.blocks) for found in near]
    runners = [
        Runner(tuple(sorted(place[b] for b in found)), own, tuple(dict.fromkeys(fit.families[b] for b in found)))
        for found, own in zip(near, odds, strict=True)
    ]
    pairs = zip(e.best.blocks, (effect for effect, _ in fit.effects), strict=True)
    judge = Judge(_point(fit), e.whitening.noise * e.best.noise, fit.campaign.samples)
    choice = Choice(
        tuple(_without_columns(fit, e.linear.blocks[b], effect) for b, effect in pairs),
        tuple(_without_columns(fit, e.linear.blocks[b], e.linear.blocks[b].effect) for b in further),
        e.linear.measures,
        Noise(fit.campaign.noise_position, fit.campaign.noise_orientation),
        None if e.discrepancy.kernel is None else judge,
    )
    return choice, runners


def log_odds(estimate: Sequential, listed: Sequence[Runner]) -> Array:
    """Log posterior odds (R,) of each alternative combination against the chosen one, by all rows so far."""
    choice, fitted = estimate.choice, estimate.fitted
    stack = linearised(fitted.rows.campaign, fitted.point, choice, rivals=True)
    total = estimate.sums.after(fitted.step, stack.shape[2]).plus(Sums.of(stack, fitted.rows))
    gram = normal(choice, total, fitted, rivals=True)[2]
    own = evidence(gram, tuple(range(len(choice.blocks))), 0.0, fitted.best)
    return np.array([evidence(gram, r.blocks, r.log_prior, own).log_evidence - own.log_evidence for r in listed])


def _without_columns(fit: Fit, item: Block, effect: Effect) -> Block:
    """Copy of a block with no rows, for the effect with its constants as a saved model holds it."""
    nothing = np.zeros((0, fit.explanation.linear.measures, len(item.sizes)))
    return replace(item, effect=gate.delivered(effect, fit.nominal), source=nothing)


def _point(fit: Fit) -> Point:
    return Point(fit.corrected.frames, joined([values for _, values in fit.effects]))


def fixed_point(fit: Fit) -> Sequential:
    """Sequential estimate of a diagnosis's choice from its rows, started at its fit and iterated to the fixed point."""
    e, point, flat = fit.explanation, _point(fit), len(unknown_frames(fit.campaign))
    leverage = (e.best.effective + flat) / max(e.problem.equations + flat, 1)
    rows = WeightedRows(fit.campaign, e.whitening.weights, e.outliers)
    step = np.zeros(flat + len(point.values))
    begin = State(point, step, rows, e.whitening.noise, e.whitening.held, leverage)
    return Sequential.of(chosen(fit)[0], (rows,), begin)


def watch(fit: Fit) -> Watch:
    """Return the reference for tests of new rows: a diagnosis's overdispersion, outlier count and candidate effects."""
    e, kept = fit.explanation, ~fit.explanation.outliers
    left = (fit.corrected.gap / (e.whitening.sigma() * e.best.noise))[kept]
    first = [own[0] for own in fit.variants.values() if own]
    tested = [_without_columns(fit, block(fit.nominal, effect), effect) for effect in first]
    apart = [own[kept] for own in each(blocks(fit.campaign)) if own[kept].any()]
    scatter, aside = scatter_of(left, apart), int(e.outliers.sum())
    return Watch(tuple(item for item in tested if len(item.sizes)), scatter, aside, fit.campaign.samples)


def in_common(fit: Fit) -> str:
    """Say what rows have in common beside frames and parameters, so that sums cannot stand for them; else empty."""
    if fit.explanation.whitening.smooth is not None:
        return "what remains is drawn anew in every pose or visit"
    if fit.corrected.frames.artefacts or seen_components(fit.campaign) is not None:
        return "rows share planes, stands, anchors or cameras whose places are not known"
    return ""


class Diagnosed(Protocol):
    """Protocol of a :class:`~thermal_robot.Diagnosis` to which rows can be added."""

    @property
    def campaign(self) -> str: ...  # noqa: D102
    @property
    def samples(self) -> int: ...  # noqa: D102
    @property
    def usable(self) -> bool: ...  # noqa: D102
    @property
    def reason(self) -> str: ...  # noqa: D102
    @property
    def model(self) -> CorrectedModel: ...  # noqa: D102
    @property
    def fit(self) -> Fit | None: ...  # noqa: D102
    @property
    def unexplained(self) -> Unexplained: ...  # noqa: D102
    @property
    def remaining(self) -> Unexplained | None: ...  # noqa: D102


_BEGUN: WeakKeyDictionary[Fit, tuple[Sequential, Watch, tuple[Runner, ...]]] = WeakKeyDictionary()


def start(fit: Fit) -> tuple[Sequential, Watch, tuple[Runner, ...]]:
    """Return the initial state of updates to a diagnosis; passes over its rows once.

    Only alternatives that are less probable than the choice are followed.
    """
    if why := in_common(fit):
        raise EstimationError(
            f"{fit.campaign.name}: {why}, and how rows count depends on all of them; diagnose old and new rows together"
        )
    if fit not in _BEGUN:
        estimate, runners = fixed_point(fit), chosen(fit)[1]
        gains = log_odds(estimate, runners) if runners else ()
        behind = tuple(runner for runner, gain in zip(runners, gains, strict=True) if gain < 0.0)
        _BEGUN[fit] = estimate, watch(fit), behind
    return _BEGUN[fit]


def prepare(found: Diagnosed) -> None:
    """Sum the rows of a large diagnosis beforehand, so that updates need no pass over them."""
    if found.usable and found.fit is not None and found.samples > 2 * own_settings.KEPT and not in_common(found.fit):
        start(found.fit)


@dataclass(frozen=True, eq=False, repr=False)
class Updated:
    """Diagnosis with new rows: parameters, noise and corrected model by all rows, effects unchanged.

    Attributes
    ----------
    diagnosis
        Initial diagnosis, whose effects stay.
    outliers
        Row numbers of the last new rows that are set aside, as their table counts them.
    model
        The corrected model by all rows.
    agreement
        Tests of the last new rows under the model fitted without them.
    estimate, watch
        The fit to all rows; what new rows are compared with.
    wider
        Factors (P,) by which the diagnosis inflated each standard deviation for an unexplained residual.
    runners, rival, lead
        Alternative combinations; the best of them by all rows so far, and its log odds against the chosen one.
    fallen
        Reasons against the selected effects, one sentence for each failed test; they are permanent.

    Examples
    --------
    >>> import numpy as np
    >>> import thermal_robot as tr
    >>> campaign, new = tr.demo_campaign(), np.arange(120) % 6 == 0
    >>> found = tr.diagnose(campaign.take(~new))
    >>> updated = found.update(campaign.take(new))
    >>> updated.samples, updated.choice_stands, updated.reason
    (120, True, '')
    >>> updated.parameters.shape == found.parameters.shape
    True
    """

    diagnosis: Diagnosed
    fit: Fit
    estimate: Sequential
    watch: Watch
    runners: tuple[Runner, ...]
    wider: Array
    model: CorrectedModel
    agreement: Agreement
    outliers: tuple[int, ...] = ()
    rival: tuple[str, ...] = ()
    lead: float = -np.inf
    fallen: tuple[str, ...] = ()

    def update(self, rows: Campaign | pd.DataFrame) -> Updated:
        """Add more rows; see :meth:`Diagnosis.update <thermal_robot.Diagnosis.update>`."""
        rows = more_rows(self.fit.campaign, rows, self.model.needs)
        with threadpool_limits(1):  # as in a diagnosis: matrices are small
            new = WeightedRows.weighed(self.estimate.choice, rows)
            after = replace(self, estimate=self.estimate.plus(new))
            if rows.samples:
                after = self._compared(after.estimate, new)
        return replace(after, model=after._model(rows), outliers=tuple(rows.rows[after.estimate.aside].tolist()))

    def _compared(self, estimate: Sequential, new: WeightedRows) -> Updated:
        """Return the result for all rows, with the tests of the new ones."""
        agreement, rival, lead = self.watch.look(self.estimate, new, self.agreement), self.rival, self.lead
        if self.runners:
            gains = log_odds(estimate, self.runners)
            rival, lead = self.runners[int(np.argmax(gains))].names, float(gains.max())
        outside = beyond(self.model.spread, new.campaign, self.estimate.samples)
        found = [*misfits(agreement), *outside, *self._testable(new)]
        if not estimate.fitted.steady:
            found.append("The fit of the chosen effects to all rows does not come to rest.")
        fallen = tuple(dict.fromkeys((*self.fallen, *found)))
        return replace(self, estimate=estimate, agreement=agreement, rival=rival, lead=lead, fallen=fallen)

    def _testable(self, new: WeightedRows) -> Iterator[str]:
        """Yield a sentence for each effect that the diagnosis could not test and that the new rows make testable."""
        known = library()
        if asked := {name: needs for name, needs in self.fit.needs.items() if name in known}:
            old = self.estimate.fitted
            both = observe(WeightedRows.joined(old.rows, new).campaign, old.point.frames)
            for name, needs in asked.items():
                if not gate.missing(known[name], both):
                    yield f"{name} could not be tested without {', '.join(needs)}, and now can be."

    def _model(self, new: Campaign) -> CorrectedModel:
        """Corrected model by all rows, with the range of both old and new rows."""
        fitted, choice, known = self.estimate.fitted, self.estimate.choice, self.model.spread
        model = replace(self.model, frames=fitted.point.frames, effects=tuple(choice.split(fitted.point.values)))
        if known is None:
            return model
        values = {**new.covariates, **dict(zip(new.robot.joint_names, new.q.T, strict=True))}
        ranges = {
            name: (
                float(np.min(values.get(name, low), initial=low)),
                float(np.max(values.get(name, high), initial=high)),
            )
            for name, (low, high) in known.ranges.items()
        }
        covariance = _covariance(fitted, choice, unknown_frames(self.fit.campaign))
        spread = replace(known, covariance=covariance, prior=fitted.expected(choice), ranges=ranges)
        return replace(model, spread=spread, files=())  # held out were the old rows alone

    @property
    def samples(self) -> int:
        """Number of rows, those of the diagnosis included."""
        return self.estimate.samples

    @property
    def choice_stands(self) -> bool:
        """Whether all tests accept the effects, settings and places of the diagnosis.

        A failed test is permanent; the comparison with other effects may change with more rows.
        """
        return not self.reason

    @property
    def reason(self) -> str:
        """Why the model must be selected again, in plain words; empty while it stands."""
        if self.lead <= 0.0:  # a fresh diagnosis takes the more probable combination, however little it is ahead
            return " ".join(self.fallen)
        own = dict.fromkeys(item.effect.name for item in self.estimate.choice.blocks)
        told, before = (" and ".join(some) or "no effect" for some in (self.rival, own))
        rest = f"rather than {before}" if {*self.rival} != {*own} else "in other settings or places than chosen"
        odds = np.exp(min(self.lead, own_settings.MOST_LEAD))
        return " ".join((*self.fallen, f"All rows together speak for {told}, {rest} (odds {odds:.2g} : 1)."))

    @property
    def noise(self) -> float:
        """Residual standard deviation per axis, m."""
        return float(self.estimate.fitted.noise[0])

    @property
    def noise_orientation(self) -> float | None:
        """Residual standard deviation per axis of orientations, rad; ``None`` without them."""
        return float(self.estimate.fitted.noise[3]) if self.estimate.choice.measures == 6 else None

    @property
    def rms_after(self) -> float:
        """Root mean square residual over the rows that are not set aside, m."""
        return float(self.estimate.fitted.rms[0])

    @property
    def rms_after_orientation(self) -> float | None:
        """Root mean square residual of orientations, rad; ``None`` without them."""
        return float(self.estimate.fitted.rms[1]) if self.estimate.choice.measures == 6 else None

    @property
    def anew(self) -> bool:
        """Whether old rows were revisited because the parameters left the trust region of their sums."""
        return self.estimate.anew

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of the effects as a data frame, as the model has them, SI.

        Index (effect, parameter); columns ``value``, ``std`` (one sigma), ``unit`` and ``identified``. Where the
        diagnosis widened deviations for what it could not explain, they are wider by the same factor.
        """
        import pandas as pd

        choice, fitted = self.estimate.choice, self.estimate.fitted
        listed = [(item.effect.name, p) for item in choice.blocks for p in item.bare]
        std = fitted.deviations * self.wider
        return pd.DataFrame(
            {
                "value": fitted.point.values,
                "std": std,
                "unit": [p.unit for _, p in listed],
                "identified": identified(std, fitted.expected(choice)),
            },
            index=pd.MultiIndex.from_tuples([(name, p.name) for name, p in listed], names=("effect", "parameter")),
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON object of the format ``thermal-robot/updated/1``, SI."""
        names = ("samples", "choice_stands", "reason", "noise", "noise_orientation", "rms_after")
        told = {name: getattr(self, name) for name in (*names, "rms_after_orientation")}
        table = self.parameters.reset_index().rename(columns={"parameter": "name"})
        return {
            "schema": "thermal-robot/updated/1",
            "campaign": self.diagnosis.campaign,
            **told,
            "outliers": list(self.outliers),
            "parameters": table.to_dict("records"),
        }

    def __repr__(self) -> str:
        names = ", ".join(effect.name for effect, _ in self.model.effects) or "no effect"
        state = "the choice stands" if self.choice_stands else "to be diagnosed anew"
        return f"Updated({self.diagnosis.campaign!r}: {names}; {self.samples} rows; {state})"

    def __str__(self) -> str:
        return "\n\n".join([repr(self), *([self.reason] if self.reason else []), str(self.parameters)])


def update(found: Diagnosed, rows: Campaign | pd.DataFrame) -> Updated:
    """Add rows to a diagnosis; see :meth:`Diagnosis.update <thermal_robot.Diagnosis.update>`.

    Raises :class:`EstimationError` if it says nothing of the robot, or was made without its fit.
    """
    if not found.usable:
        raise EstimationError(f"{found.campaign}: nothing is known of the robot that rows could add to. {found.reason}")
    if found.fit is None:
        raise EstimationError(f"{found.campaign}: this diagnosis was made without its fit; diagnose the rows")
    with threadpool_limits(1):
        estimate, watched, runners = start(found.fit)
    wider = _widened(found, found.fit, estimate.fitted.deviations)
    return Updated(found, found.fit, estimate, watched, runners, wider, found.model, Agreement()).update(rows)


def _widened(found: Diagnosed, fit: Fit, own: Array) -> Array:
    """Factors (P,), at least 1: each deviation as inflated by the diagnosis over that of the converged fit, ``own``."""
    left, e = found.unexplained if found.remaining is None else found.remaining, fit.explanation
    if not left.flagged:
        return np.ones_like(own)
    told = joined([np.sqrt(np.maximum(np.diag(e.values[b][1]), 0.0)) for b in e.best.blocks])
    return np.maximum(told / np.maximum(own, settings.TINY), 1.0)


def _covariance(fitted: Fitted, choice: Choice, names: tuple[str, ...]) -> Array:
    """Posterior covariance (K, K) of frames and parameters that move the target; rotations alone are left out."""
    precision = fitted.precision(np.maximum(fitted.expected(choice), settings.TINY), frames=own_settings.LOOSE)
    unit = precision.diagonal() ** -0.5
    inner = np.linalg.inv(precision * np.outer(unit, unit))
    moving = np.r_[moves(names), np.ones(len(fitted.point.values), dtype=bool)]
    return np.asarray((np.outer(unit, unit) * (inner + inner.T) / 2.0)[np.ix_(moving, moving)])
