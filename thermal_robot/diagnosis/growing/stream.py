"""A diagnosis and the rows that came after it: what is held, the fit to all, and whether the choice still stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import gammaln

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.campaign import read_alike
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.read import build_campaign
from thermal_robot.campaign.table import table_from_frame
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Judge, Point, together, without_columns
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.settled import Begin, Single
from thermal_robot.diagnosis.growing.sums import Seen, carried, products
from thermal_robot.diagnosis.growing.watched import Agreement, Watch, scatter_of
from thermal_robot.effects import gate, library
from thermal_robot.errors import CampaignError, EstimationError, require
from thermal_robot.inference.columns import block
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.explain import log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, Whitening, normal_equations
from thermal_robot.inference.robust import distance_limit, tail_weight
from thermal_robot.inference.rows import blocks, each
from thermal_robot.observations import observe
from thermal_robot.prediction import Spread
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


WHERE = "update(), rows"


def received(old: Campaign, rows: Campaign | pd.DataFrame, needs: tuple[str, ...]) -> Campaign:
    """Return new rows, a campaign or a table of the old one's columns and units, as a campaign that can be put to it.

    Raises :class:`CampaignError` if they are of another robot or kind, or lack a column that the chosen effects read
    (``needs``).
    """
    if not isinstance(rows, Campaign):
        import pandas as pd

        require(WHERE, rows, (pd.DataFrame,), "a campaign of the same robot, or a pandas DataFrame of its columns")
        rows = build_campaign(table_from_frame(rows, "<rows>"), old.settings, old.robot, name="rows")
    _same_robot(old.robot, rows.robot, rows.name)
    for what, mine, theirs in _kinds(old, rows):
        if mine != theirs:
            raise CampaignError(rows.name, f"another {what}", found=str(theirs), expected=f"{mine}, as of {old.name}")
    if old.targets is not None or rows.targets is not None:
        expected = "rows of one target; diagnose all rows together"
        raise CampaignError(rows.name, "several targets of each pose, whose places all rows tell", expected=expected)
    rows = read_alike(rows, old.robot, old.turned)
    for column in needs:
        if column not in rows.covariates:
            raise CampaignError(rows.name, "lacks what the chosen effects read", column=column, expected="this column")
    return rows


def weighed(choice: Choice, rows: Campaign) -> Single:
    """Return rows with the weights with which they come: in full where each fit weighs them, else by the diagnosis."""
    count, judge = rows.samples, choice.judge
    if judge is None or not count:
        return Single(rows, np.ones(count), np.zeros(count, dtype=bool))
    gap = Seen.at(rows, judge.point, replace(choice, rivals=())).alike[:, :, -1]
    distance2 = ((gap / judge.sigma) ** 2).sum(axis=1)
    aside = distance2 > distance_limit(choice.measures, judge.rows)
    return Single(rows, np.where(aside, 0.0, tail_weight(distance2, choice.measures)), aside)


def _kinds(old: Campaign, rows: Campaign) -> list[tuple[str, object, object]]:
    """Return what must be the same in both: its name, the old one's and the new one's."""
    return [
        ("kind of measurement", old.measures, rows.measures),
        ("base frame", _word(old.base_known), _word(rows.base_known)),
        ("tool frame", _word(old.tool_known), _word(rows.tool_known)),
        ("target", old.target.tolist(), rows.target.tolist()),
        ("noise of positions", _noise(old), _noise(rows)),
        ("noise of orientations", old.noise_orientation, rows.noise_orientation),
        ("reference temperature", old.reference_temperature, rows.reference_temperature),
        ("prediction", _simulated(old), _simulated(rows)),
    ]


def _word(known: bool) -> str:
    return "known" if known else "unknown"


def _simulated(campaign: Campaign) -> str:
    return "of the URDF" if campaign.simulated_position is None else "of the user's simulator"


def _noise(campaign: Campaign) -> object:
    """Return the stated noise; where each row has its own, that it has."""
    return campaign.noise_position if campaign.noise_of_rows is None else "of each row"


def _same_robot(old: Robot, new: Robot, name: str) -> None:
    """Refuse rows of another chain: other joints, or the same joints put the tool frame elsewhere."""
    if new is old:
        return
    if new.joint_names != old.joint_names:
        found, expected = ", ".join(new.joint_names), ", ".join(old.joint_names)
        raise CampaignError(name, "another robot: its joints differ", found=found, expected=expected)
    q = np.array([np.zeros(old.n), *np.eye(old.n), np.ones(old.n)])
    if np.abs(new.forward(q) - old.forward(q)).max() > settings.SAME_PLACE:
        raise CampaignError(name, "another nominal model", expected="the same URDF and tool frame")


def chosen(fit: Fit) -> Choice:
    """Return what a diagnosis chose: the effects of its fit in their settings, and those that came near.

    Where a discrepancy was found beside them, rows keep the weight that they had: it took part in weighing them, and is
    told from all rows together.
    """
    e, campaign = fit.explanation, fit.campaign
    blocks = tuple(
        without_columns(e.linear.blocks[b], gate.delivered(effect, fit.nominal), e.linear.measures)
        for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True)
    )
    further = sorted({b for rival in rivals(fit) for b in rival} - {*e.best.blocks})
    listed = ((e.linear.blocks[b], e.linear.blocks[b].effect) for b in further)
    beyond = e.whitening.noise * e.best.noise
    return Choice(
        blocks,
        tuple(without_columns(item, gate.delivered(own, fit.nominal), e.linear.measures) for item, own in listed),
        e.linear.measures,
        campaign.noise_position,
        campaign.noise_orientation,
        None if e.discrepancy.form is None else Judge(_point(fit), beyond, campaign.samples),
    )


def can_grow(fit: Fit) -> bool:
    """Tell whether rows count by themselves: whether nothing of what remains is drawn anew in every pose or visit."""
    return fit.explanation.whitening.smooth is None


def rivals(fit: Fit) -> list[tuple[int, ...]]:
    """Return the combinations of blocks that came nearest to the chosen one, most probable first."""
    e = fit.explanation
    own = max(
        (p for c, p in zip(e.combinations, e.probabilities, strict=True) if c.blocks == e.best.blocks), default=1.0
    )
    found = [
        c.blocks
        for c, p in zip(e.combinations, e.probabilities, strict=True)
        if c.blocks != e.best.blocks and settings.LEAST_RIVAL * own <= p
    ]
    return list(dict.fromkeys(found))[: settings.RIVALS]


def begun(fit: Fit) -> Grown:
    """Return the fit of a diagnosis at rest, ready to take in more rows."""
    e = fit.explanation
    flat = e.linear.frames.shape[2]
    equations = e.problem.equations + flat
    begin = Begin(
        _point(fit),
        np.zeros(flat + sum(len(values) for _, values in fit.effects)),
        e.whitening.noise,
        e.whitening.held,
        (e.best.effective + flat) / max(equations, 1),
    )
    rows = Single(fit.campaign, e.whitening.weights, e.outliers)
    return Grown.of(chosen(fit), (rows,), begin)


def _point(fit: Fit) -> Point:
    return Point(fit.corrected.frames, together([values for _, values in fit.effects]))


@dataclass(frozen=True)
class Runner:
    """A combination that may come first: blocks of a :class:`Choice`, log prior odds less the chosen one's, names."""

    blocks: tuple[int, ...]
    log_prior: float
    names: tuple[str, ...]


def runners(fit: Fit) -> tuple[Runner, ...]:
    """Return the combinations of a diagnosis that came near the chosen one."""
    e, found = fit.explanation, rivals(fit)
    prior = log_priors([item.effect for item in e.linear.blocks])
    further = sorted({b for rival in found for b in rival} - {*e.best.blocks})
    place = {b: k for k, b in enumerate((*e.best.blocks, *further))}
    own = sum(prior[b] for b in e.best.blocks)
    return tuple(
        Runner(
            tuple(sorted(place[b] for b in blocks)),
            sum(prior[b] for b in blocks) - own,
            tuple(dict.fromkeys(fit.families[b] for b in blocks)),
        )
        for blocks in found
    )


def ahead(grown: Grown, listed: Sequence[Runner]) -> Array:
    """(R,) log evidence of each combination over that of the chosen one, by all rows so far."""
    choice, fitted = grown.choice, grown.fitted
    blocks = (*choice.blocks, *choice.rivals)
    seen = Seen.at(grown.single.campaign, fitted.point, choice, rivals=True)
    flat = len(seen.names)
    whole = carried(grown.sums.weighed, fitted.step) + products(seen.alike, grown.single.weights)
    white = np.einsum("g,gij->ij", fitted.sigma[::3] ** -2.0, whole)
    full = carried(white, np.concatenate([np.zeros(flat), -fitted.point.values]))
    linear = Linear(np.zeros((0, choice.measures)), np.zeros((0, choice.measures, flat)), blocks)
    used = grown.sums.used + int((grown.single.weights > 0).sum())
    whitening = Whitening(grown.single.weights, fitted.sigma, fitted.held)
    gram = normal_equations(linear, whitening, full, used * choice.measures)
    own = evidence(gram, tuple(range(len(choice.blocks))), 0.0, fitted.best)
    return np.array([evidence(gram, r.blocks, r.log_prior, own).log_evidence - own.log_evidence for r in listed])


@dataclass(frozen=True, eq=False)
class Stream:
    """All rows of a diagnosis and since.

    ``fit`` is the diagnosis's, ``grown`` that of its choice to all rows, ``watch`` what new rows are compared with,
    ``agreement`` that of the last rows. ``rival`` is the best combination of ``runners`` by all rows so far, ``lead``
    its log odds against the chosen one, −∞ for none. ``fallen``: what new rows said against the choice, one sentence a
    reason; it stays.
    """

    fit: Fit
    grown: Grown
    watch: Watch
    runners: tuple[Runner, ...]
    agreement: Agreement
    rival: tuple[str, ...] = ()
    lead: float = -np.inf
    fallen: tuple[str, ...] = ()

    @classmethod
    def of(cls, fit: Fit) -> Stream:
        """Begin with a diagnosis; :class:`EstimationError` if rows of a pose share what is drawn anew."""
        if not can_grow(fit):
            raise EstimationError(
                f"{fit.campaign.name}: what remains is drawn anew in every pose or visit, and how rows count depends "
                "on all of them; diagnose old and new rows together"
            )
        grown = begun(fit)
        return cls(fit, grown, _watch(fit), _behind(grown, runners(fit)), Agreement())

    def plus(self, rows: Campaign, spread: Spread | None) -> Stream:
        """Return the same with further rows; ``spread`` says where the model was measured."""
        new, before = weighed(self.grown.choice, rows), sum(one.campaign.samples for one in self.grown.batches)
        agreement = self.watch.look(self.grown, new, self.agreement) if rows.samples else self.agreement
        after = replace(self, grown=self.grown.plus(new), agreement=agreement)
        if not rows.samples:
            return after
        after = after._weighed()
        found = [*after._misfits(), *_beyond(spread, rows, before), *after._testable()]
        if not after.grown.fitted.steady:
            found.append("The fit of the chosen effects to all rows does not come to rest.")
        return replace(after, fallen=tuple(dict.fromkeys((*self.fallen, *found))))

    def _misfits(self) -> Iterator[str]:
        """Yield what is unlikely where the robot and its noise are as they were."""
        a, level = self.agreement, settings.LEVEL / settings.TESTS
        if a.p_batch < level:
            yield (
                f"The new rows leave {a.chi2 / a.figures:.3g} times the mean square that noise and the parameters' "
                f"deviations allow (p = {a.p_batch:.1g})."
            )
        elif a.p_whole < level:
            yield (
                f"The rows since the diagnosis leave {a.whole / a.whole_figures:.3g} times the mean square that noise "
                f"and the parameters' deviations allow (p = {a.p_whole:.1g})."
            )
        if a.p_change < level:
            effect, parameter = a.changed
            yield (
                f"Something begins with the new rows that {effect} would explain, most of it in {parameter} "
                f"(p = {a.p_change:.1g})."
            )
        if a.p_aside < level:
            yield f"{a.aside} of {a.rows} rows since the diagnosis are gross errors (p = {a.p_aside:.1g})."

    def _testable(self) -> Iterator[str]:
        """Yield the effects that could not be tested, and can be with what the new rows recorded."""
        known = library()
        asked = [(name, needs) for name, needs in self.fit.needs.items() if name in known]
        if not asked:
            return
        both = observe(self.grown.fitted.single.campaign, self.grown.fitted.point.frames)
        for name, needs in asked:
            if not gate.missing(known[name], both):
                yield f"{name} could not be tested without {', '.join(needs)}, and now can be."

    def _weighed(self) -> Stream:
        """Return the same with the best of the combinations that may come first."""
        if not self.runners:
            return self
        gain = ahead(self.grown, self.runners)
        best = int(np.argmax(gain))
        return replace(self, rival=self.runners[best].names, lead=float(gain[best]))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the choice is to be made anew, one sentence each; empty while it stands."""
        return (*self.fallen, *self._overtaken())

    def _overtaken(self) -> Iterator[str]:
        """Yield the combination that explains all rows better now."""
        if self.lead > settings.LEAD:
            own = dict.fromkeys(effect.name for effect in self.grown.choice.effects)
            told, before = (" and ".join(some) or "no effect" for some in (self.rival, own))
            same = set(self.rival) == set(own)
            rest = "in other settings or places than chosen" if same else f"rather than {before}"
            odds = np.exp(min(self.lead, settings.MOST_LEAD))
            yield f"All rows together speak for {told}, {rest} (odds {odds:.2g} : 1)."


def _behind(grown: Grown, listed: tuple[Runner, ...]) -> tuple[Runner, ...]:
    """Return the combinations behind the chosen one by the diagnosis's rows: what was preferred stays preferred."""
    if not listed:
        return ()
    return tuple(runner for runner, gain in zip(listed, ahead(grown, listed), strict=True) if gain < 0.0)


def _watch(fit: Fit) -> Watch:
    e, campaign = fit.explanation, fit.campaign
    kept = ~e.outliers
    left = (fit.corrected.gap / (e.whitening.sigma() * e.best.noise))[kept]
    first = [own[0] for own in fit.variants.values() if own]
    tested = [without_columns(block(fit.nominal, f), gate.delivered(f, fit.nominal), left.shape[1]) for f in first]
    apart = [own[kept] for own in each(blocks(campaign)) if own[kept].any()]
    return Watch(
        tuple(item for item in tested if len(item.sizes)),
        scatter_of(left, apart),
        int(e.outliers.sum()),
        campaign.samples,
    )


def _beyond(spread: Spread | None, rows: Campaign, before: int) -> Iterator[str]:
    """Yield that many of the new rows leave what was measured by ``before`` rows, and not by chance.

    Of rows in no particular order, the k of n new ones that are the outermost of all N + n, at either end, have the
    chance (k + 1) · n!/(n − k)! · (N + n − k)!/(N + n)!.
    """
    known = () if spread is None else spread.outside(rows)
    outside = [[name for name in names if name not in CLOCK] for names in known]  # time goes on
    count, n = sum(bool(names) for names in outside), rows.samples
    if spread is None or count < max(settings.FEWEST_OUTSIDE, settings.OUTSIDE * n):
        return
    for name in dict.fromkeys(name for own in outside for name in own):
        k = sum(name in own for own in outside)
        chance = np.log(k + 1.0) + gammaln([n + 1.0, before + n - k + 1.0]).sum()
        chance -= gammaln([n - k + 1.0, before + n + 1.0]).sum()
        if chance + np.log(len(spread.ranges)) < np.log(settings.LEVEL / settings.TESTS):
            yield f"{k} of {n} new rows lie outside of what was measured, in {name}."


def expected_sizes(stream: Stream) -> Array:
    """(P,) prior standard deviation of every parameter, SI."""
    scales = stream.grown.fitted.best.scales
    return together([item.sizes * scales[k] for k, item in enumerate(stream.grown.choice.blocks)])
