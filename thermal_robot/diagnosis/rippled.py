"""Ripple of the gears beside the other effects: waves are looked for in what remains, and compete with all that is."""

from __future__ import annotations

from collections.abc import Callable

from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, refit
from thermal_robot.inference.ripple import alike, waves


def rippled(fit: Fit, progress: Callable[[str], None]) -> Fit:
    """Let waves of the joints join a fit, and leave it again, until they stay.

    What was fitted without them may have stood in for them, and hides others: the choice is made again beside the
    waves, and these are looked for again beside the choice.

    Parameters
    ----------
    fit
        To which waves are added; one that was not to consider ripple comes back as it is, and one of so many rows that
        each choice beside waves would take minutes. Beside very many rows it is made once.
    progress
        Called with a few words at each stage.
    """
    name = JointRipple.name
    if name not in fit.variants or fit.campaign.samples > settings.RIPPLE_ROWS:
        return fit
    many = fit.campaign.samples > settings.ENOUGH_ROWS
    for _ in range(1 if many else settings.RIPPLE_ROUNDS):
        progress("ripple of the gears")
        held = next((e for e, _ in fit.effects if isinstance(e, JointRipple)), JointRipple())
        found = waves(fit)
        if alike(found, held):
            break
        others = [effect for effect, _ in fit.effects if effect.name != name]
        fit = refit(fit, {name: (found,)}, [*others, *((found,) if found.orders else ())], progress)
    return fit
