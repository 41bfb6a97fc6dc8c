"""Which effect: status, probability, parameters of every candidate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis.result import Estimate, Finding, Location, Status
from thermal_robot.estimation.explain import Explanation
from thermal_robot.estimation.fit import Fit

Array = NDArray[np.float64]
Shares = dict[str, tuple[float, tuple[float, float]]]

_DETERMINED = 0.5  # a parameter is identified when the data leave less than half of its prior's standard deviation
_SURE = 0.75
_RIVAL = 0.2


def findings(fit: Fit, shares: Shares, locations: dict[str, tuple[Location, ...]]) -> tuple[Finding, ...]:
    """Return what is said of every candidate, in order of its held-out share; those not testable come last."""
    e = fit.explanation
    explained = {effect.name: b for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True)}
    rivals = _rivals(fit, list(explained))
    result = []
    for name in dict.fromkeys(fit.families):
        own = [b for b, f in enumerate(fit.families) if f == name]
        invisible = all(not e.problem.bases[b].shape[1] for b in own)
        status: Status = "found" if name in explained else "not_found"
        confounded = rivals.get(name, ())
        if confounded:
            status = "confounded"
        if invisible and name not in explained:
            # every column lies within the unknown frames
            status, confounded = "confounded", ("base_frame", "tool_frame")
        share, interval = shares.get(name, (0.0, (0.0, 0.0)))
        result.append(
            Finding(
                name,
                status,
                probability=e.probability(own),
                shrinkage=share,
                shrinkage_ci95=interval,
                confounded_with=confounded,
                locations=locations.get(name, ()),
                parameters=_estimates(fit, explained[name]) if name in explained else (),
            )
        )
    result.sort(key=lambda f: (f.name not in explained, -(f.shrinkage or 0.0), -(f.probability or 0.0)))
    result += [Finding(name, "not_testable", needs=needs) for name, needs in fit.needs.items()]
    return tuple(result)


def _rivals(fit: Fit, explained: list[str]) -> dict[str, tuple[str, ...]]:
    """Effects of the explanation that another could take the place of, and those others.

    An effect is confounded with one outside the explanation when it is itself uncertain, and where it is absent that
    other is present.
    """
    e: Explanation = fit.explanation
    held = [{fit.families[b] for b in c.blocks} for c in e.combinations]
    rivals: dict[str, set[str]] = {}
    for name in explained:
        absent = np.array([name not in h for h in held])
        mass = float(e.probabilities[absent].sum())
        if mass < 1.0 - _SURE:
            continue
        for other in dict.fromkeys(fit.families):
            if other in explained:
                continue
            both = np.array([other in h for h in held])
            if float(e.probabilities[absent & both].sum()) > max(_RIVAL, 0.8 * mass):
                rivals.setdefault(name, set()).add(other)
                rivals.setdefault(other, set()).add(name)
    return {name: tuple(sorted(others)) for name, others in rivals.items()}


def _estimates(fit: Fit, block: int) -> tuple[Estimate, ...]:
    e = fit.explanation
    item = e.linear.blocks[block]
    values = dict(zip(e.best.blocks, (v for _, v in fit.effects), strict=True))[block]
    spread = np.sqrt(np.maximum(np.diag(e.values[block][1]), 0.0))
    prior = item.sizes * e.best.scales[block]
    result = []
    for parameter, value, std, size in zip(item.parameters, values, spread, prior, strict=True):
        known = bool(std < _DETERMINED * size)
        result.append(
            Estimate(
                parameter.name, float(value) if known else None, float(std) if known else None, parameter.unit, known
            )
        )
    return tuple(result)
