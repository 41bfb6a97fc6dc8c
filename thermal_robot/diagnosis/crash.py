"""Bayesian model comparison after a crash: which joint's zero moved, or which link is not where the URDF has it.

One campaign after the crash is enough. Ordinary errors of all zeros and placements, up to a few times those of an
uncalibrated arm, stand in the model as the background; beside them a single joint may have another zero, or a single
link another place, or two of these. Every such set is compared by its evidence (Gaussian, prior sizes and noise at
their most probable values, as everywhere: :mod:`.inference.evidence`), with the odds that one of all n moved;
probabilities are normalised over the sets. The zero is that of the most probable set, beside its background.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import softmax
from threadpoolctl import threadpool_limits

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.data_checks import usable, with_corrected_signs
from thermal_robot.diagnosis.data_faults.misfit import mismatch
from thermal_robot.diagnosis.diagnose import solvable
from thermal_robot.diagnosis.values import Misfit, jsonable
from thermal_robot.effects import Geometric, JointOffset, gate
from thermal_robot.errors import require
from thermal_robot.inference.algebra import rms, total_probability
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.fit import Fit, fit_named
from thermal_robot.inference.problem import Linear, gram, parameter_values
from thermal_robot.renderer import registered_renderer


@dataclass(frozen=True)
class Moved:
    """A joint whose zero may have moved, or a link that may stand elsewhere.

    Attributes
    ----------
    kind, name
        ``joint``, or ``link``: what it carries, the next joint or the tool, sits elsewhere on it.
    probability
        That it moved.
    values, stds, units
        Of a joint its zero; of a link three shifts and three turns of what it carries: as the most probable set with it
        says. SI.
    """

    kind: str
    name: str
    probability: float
    values: tuple[float, ...]
    stds: tuple[float, ...]
    units: tuple[str, ...]


@dataclass(frozen=True)
class Crash:
    """Result of :func:`after_crash`: posterior probabilities that each joint's zero or link moved.

    Attributes
    ----------
    campaign, samples
        Its name and number of rows.
    verdict
        ``zero``, ``link``, ``both``, ``nothing``: of what kind the sets are that are most probable together; or
        ``misfit``: robot and table do not belong together.
    probability
        Of sets of this kind.
    moved
        All candidates, the most probable first.
    hidden
        Joints whose zero the unknown base or tool can take up: nothing can be said of them.
    rms_before, rms_after
        Rms distance, m, of the rows that are not outliers: with the nominal robot and the frames fitted, and with what
        moved and ordinary errors of all placements.
    reach
        Diagonal of the measured volume, m.
    misfit
        Why nothing can be said of the robot, or ``None``.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> off = {"joint_offset": {"joint_3": 4e-3}}
    >>> campaign = tr.simulate("builtin:rv_m2", off, tool_frame="tool0", rows=40, noise=5e-5)
    >>> found = tr.after_crash(campaign)
    >>> found.verdict, found.moved[0].name
    ('zero', 'joint_3')
    """

    campaign: str
    samples: int
    verdict: str
    probability: float = 1.0
    moved: tuple[Moved, ...] = ()
    hidden: tuple[str, ...] = ()
    rms_before: float = 0.0
    rms_after: float = 0.0
    reach: float = float("inf")
    misfit: Misfit | None = None

    @property
    def named(self) -> tuple[Moved, ...]:
        """Joints and links that more probably moved than not."""
        return tuple(one for one in self.moved if one.probability > settings.LIKELY)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, SI, ready for JSON."""
        moved = [vars(one) for one in self.moved]
        plain = {name: value for name, value in vars(self).items() if name not in ("moved", "misfit")}
        return dict(jsonable({**plain, "summary": registered_renderer().crash_headline(self), "moved": moved}))

    def __str__(self) -> str:
        return registered_renderer().crash_text(self)


def after_crash(campaign: Campaign | str | Path, *, progress: Callable[[str], None] = lambda _: None) -> Crash:
    """Find which joint's zero moved in a crash, or which link is not where the URDF has it.

    Parameters
    ----------
    campaign
        A campaign measured after it, or the path of one: forty poses, without a load and in one hall
        (``thermal-robot plan --after-crash``). Where base or tool are unknown, the first or the last joint's zero
        cannot be told.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Crash
        With the probability of each joint and link.

    Raises
    ------
    CampaignError, RobotError
        If the campaign cannot be used.
    EstimationError
        If there are too few measurements for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> bent = {"geometric": {"translation y of joint_3, upper_arm": 8e-3}}
    >>> campaign = tr.simulate("builtin:rv_m2", bent, tool_frame="tool0", rows=40, noise=5e-5)
    >>> tr.after_crash(campaign).verdict
    'link'
    """
    require("after_crash()", campaign, (Campaign, str, os.PathLike), "a campaign, or the path of one")
    if not isinstance(campaign, Campaign):
        progress("reading the campaign")
        campaign = read_campaign(campaign)
    campaign, _ = usable(campaign)
    with threadpool_limits(1), solvable(campaign):
        misfit = mismatch(campaign, progress)
        if misfit is not None:
            return Crash(campaign.name, campaign.samples, "misfit", reach=campaign.reach, misfit=misfit)
        return _weighed(fit_named(with_corrected_signs(campaign), [Geometric(), JointOffset()], progress))


def _weighed(fit: Fit) -> Crash:
    """Compare by their evidence all sets of at most two moved joints and links, beside ordinary errors."""
    e, seen = fit.explanation, fit.corrected
    kinds = (JointOffset(), Geometric())
    ordinary = [
        replace(block(seen, kind).held, largest_scale=most) for kind, most in zip(kinds, settings.ORDINARY, strict=True)
    ]
    single = [one for kind in kinds for one in gate.alone(kind, seen)]
    linear = Linear(e.linear.gap, e.linear.frames, (*ordinary, *(block(seen, one).held for one in single)))
    problem = gram(linear, e.whitening)
    first = len(ordinary)
    told = [b for b in range(first, len(linear.blocks)) if problem.ranks[b]]
    bare, unlikely = evidence(problem, tuple(range(first)), 0.0, None), -float(np.log(len(single)))
    # from where a crash lies: at ordinary scales the background would take it up
    start = replace(bare, scales={**dict.fromkeys(range(first), settings.CALM), **dict.fromkeys(told, settings.STRUCK)})
    sets = list(chain.from_iterable(combinations(told, size) for size in range(settings.MOST_MOVED + 1)))
    weighed = [evidence(problem, (*range(first), *own), unlikely * len(own), start if own else None) for own in sets]
    probabilities = softmax([each.log_evidence for each in weighed])
    found = []
    for b in told:
        own = [k for k, blocks in enumerate(sets) if b in blocks]
        best = weighed[max(own, key=lambda k: probabilities[k])]
        values, covariance = parameter_values(linear, problem, best)[b]
        std = np.sqrt(np.maximum(covariance.diagonal(), 0.0))
        kind = "joint" if _zero(linear.blocks[b]) else "link"
        name = linear.blocks[b].effect.places[0]
        units = tuple(p.unit for p in linear.blocks[b].bare)
        found.append(Moved(kind, name, total_probability(probabilities[own]), tuple(values), tuple(std), units))
    hidden = tuple(b.effect.places[0] for k, b in enumerate(linear.blocks) if k >= first and k not in told and _zero(b))
    kept = ~e.outliers
    before, after = (rms(each.gap[kept, :3]) for each in (fit.nominal, fit.corrected))
    moved = tuple(sorted(found, key=lambda one: -one.probability))
    of_sets = np.array([_KINDS[frozenset(_zero(linear.blocks[b]) for b in own)] for own in sets])
    told_as = {kind: total_probability(probabilities[of_sets == kind]) for kind in _KINDS.values()}
    verdict = max(told_as, key=lambda kind: told_as[kind])
    name, rows = fit.campaign.name, fit.campaign.samples
    return Crash(name, rows, verdict, told_as[verdict], moved, hidden, before, after, fit.campaign.reach)


_KINDS = {
    frozenset[bool](): "nothing",
    frozenset({True}): "zero",
    frozenset({False}): "link",
    frozenset({True, False}): "both",
}
"""Verdict for a set of moved joints and links, by whether its members are zeros of joints (True) or links (False)."""


def _zero(item: Block) -> bool:
    return isinstance(item.effect, JointOffset)
