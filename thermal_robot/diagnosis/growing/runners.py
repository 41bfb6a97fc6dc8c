"""Combinations that came near the chosen one, weighed again with all rows so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.growing.begun import rivals
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.linearised import Seen, carried, products
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.explain import log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, Whitening, normal_equations


@dataclass(frozen=True)
class Runner:
    """A combination of effects that may come first, its log prior odds less those of the chosen one.

    ``blocks`` are numbers among the chosen effects and the rivals of a
    :class:`~thermal_robot.diagnosis.growing.choice.Choice`.
    """

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
