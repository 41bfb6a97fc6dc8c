"""Effects that stand in for an unlisted cause: their parameters, which should be constant, change with a quantity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.discover import instead
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.thin import Thin

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StandIn:
    """Probability (0..1) that an effect is real and no stand-in, and the quantity with which its size changes."""

    belief: float
    quantity: str


def trust(shares: Mapping[str, float], doubts: Mapping[str, StandIn], unlisted: float) -> dict[str, float]:
    """Return by name a factor (at most 1) for the probability of each known effect.

    An effect of the library may fit part of an unlisted cause. The larger the unlisted cause is beside the effect, the
    more of the effect may be due to it. The factor is s/(s + u), with s the effect's share of the gap and u that of
    everything unlisted. An effect whose size changes gets (1 + belief)/2 if that is smaller. The factor is never below
    :data:`~thermal_robot.inference.settings.BESIDE_UNLISTED`, as an effect may well be at work beside an unlisted
    cause.

    Parameters
    ----------
    shares
        Share of the gap on held-out rows, of every effect of the fit, discovered laws included.
    doubts
        By effect, see :func:`stand_ins`.
    unlisted
        Share of the gap that stays unexplained; 0 where the residual is noise.
    """
    unlisted += sum(max(share, 0.0) for name, share in shares.items() if name.startswith(PREFIX))
    result = {}
    for name, share in shares.items():
        if name.startswith(PREFIX):
            continue
        own = max(share, 0.0)
        shadow = own / (own + unlisted) if unlisted > 0.0 else 1.0
        changing = 0.5 * (1.0 + doubts[name].belief) if name in doubts else 1.0
        result[name] = max(settings.BESIDE_UNLISTED, min(changing, shadow))
    return result


def stand_ins(fit: Fit) -> dict[str, StandIn]:
    """Test every known effect of the fit for a size that changes with a recorded quantity.

    The parameters of an effect, such as an expansion coefficient or an eccentricity, are constants. The test multiplies
    the fitted contribution of the effect with a smooth law of each quantity. If the product explains part of the
    residual, the size of the effect changes with that quantity, and the effect stands in for another cause. Its belief
    is 1/(1 + e^g), with g the gain in log evidence of the best law (Bayes information criterion) less the logarithm of
    the number of laws that were tried.

    An effect that passes is compared with the best law that could replace it, with g the log evidence of the law over
    the effect. Call this only where a law was discovered or a residual is left, as a law of one parameter may otherwise
    be preferred to an effect of many.
    """
    e, thin = fit.explanation, Thin.of(fit)
    columns = [thin.linear.blocks[b].columns for b in e.best.blocks]
    target = thin.target(e.best.blocks)
    laws = {name: smooth_columns(values) for name, values in quantities(thin.observations).items()}
    known = [
        (effect.name, block @ values)
        for (effect, values), block in zip(fit.effects, columns, strict=True)
        if not effect.name.startswith(PREFIX)
    ]
    tried = max(len(known) * len(laws), 1)
    found = {}
    for name, moved in known:
        gains = {q: target.worth(moved[:, :, None] * law[:, None, :]).gain for q, law in laws.items() if law.shape[1]}
        if gains:
            quantity = max(gains, key=lambda q: gains[q])
            gain = gains[quantity] - float(np.log(tried))
            if gain > 0.0:
                found[name] = StandIn(float(1.0 / (1.0 + np.exp(min(gain, settings.MOST_BELIEF)))), quantity)
    for name in [n for n, _ in known if n not in found][: settings.RIVALLED_EFFECTS]:
        rival = instead(fit, name)
        if rival is not None:
            law, gain = rival
            found[name] = StandIn(
                float(1.0 / (1.0 + np.exp(np.clip(gain, -settings.MOST_BELIEF, settings.MOST_BELIEF)))), law.quantity
            )
    return found
