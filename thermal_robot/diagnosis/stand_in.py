"""Effects that may stand in for an unlisted cause: a physical constant does not vary with time or place."""

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
    """How far an effect is believed to be itself (0..1), and the quantity with which its size changes."""

    belief: float
    quantity: str


def trust(shares: Mapping[str, float], doubts: Mapping[str, StandIn], unlisted: float) -> dict[str, float]:
    """Return by name what the probability of each known effect is multiplied with, at most one.

    An unlisted cause can be absorbed in part by a listed effect, the more the larger it is beside that effect. With the
    effect's share s of the gap and the share u of what is not listed, the effect is believed by s/(s + u).
    That something works on an effect, or beside it, does not say that it is not there: hence never below
    :data:`~thermal_robot.inference.settings.BESIDE_UNLISTED`.

    Parameters
    ----------
    shares
        Of the gap, on rows held out, of every effect of the explanation, laws among them.
    doubts
        See :func:`stand_ins`.
    unlisted
        Share of the gap that is left; 0 where it is noise.
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
    """Ask of every known effect of the explanation whether its size stays the same.

    An expansion, a scale or an eccentricity is what it is at any time, temperature and place. Where what an effect was
    found to do, multiplied with a smooth law of some quantity, explains part of what is left, its size changes with
    that: the effect was taken for something that it is not. The belief is 1/(1 + e^g), with g the gain in log
    evidence of the best such law (Bayes information criterion) less the logarithm of the number that were tried.

    Where a law was discovered, or a remainder is left, an unlisted cause is at work, which may enter at several places:
    then the best law that could take the effect's own place is weighed against it, too.
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
