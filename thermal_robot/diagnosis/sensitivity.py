"""How far the verdict depends on the prior sizes of the effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.parts import Sensitivity
from thermal_robot.inference.explain import log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.search import Search


def prior_sensitivity(fit: Fit) -> Sensitivity:
    """Recompute the probability of the verdict with all prior sizes divided and multiplied by ``PRIOR_FACTOR``.

    The scale of each effect is learnt from the data, with a prior about the stated size that is as wide as its size is
    unknown (:attr:`~thermal_robot.effects.Effect.size_spread`). The verdict should therefore depend little on the
    stated sizes; where it does, the data do not decide. The leading combinations alone are compared.
    """
    e = fit.explanation
    problem = e.problem
    prior = log_priors([b.effect for b in e.linear.blocks])
    chosen = {effect.name for effect, _ in fit.effects}
    found = []
    for factor in (1.0 / settings.PRIOR_FACTOR, settings.PRIOR_FACTOR):
        scaled = replace(problem, matrix=problem.matrix * factor**2, vector=problem.vector * factor)
        search = Search(scaled, prior)
        log, same = [], []
        for combination in e.combinations[: settings.COMPARED]:
            log.append(search.evaluate(combination.blocks).log_evidence)
            same.append(fit.names_of(combination) == chosen)
        weight = np.exp(np.array(log) - max(log))
        found.append(float(weight[np.array(same)].sum() / weight.sum()))
    return Sensitivity(*found)
