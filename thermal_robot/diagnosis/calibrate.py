"""One verb beside the diagnosis: effects are named, not chosen; their parameters and what they leave are told."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from threadpoolctl import ThreadpoolController

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.diagnosis.calibration import Calibration, of_fit
from thermal_robot.diagnosis.data_checks import as_counted, usable
from thermal_robot.diagnosis.diagnose import check_priors, solvable
from thermal_robot.effects import KINEMATIC, Effect, library, named
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.inference.named import fit_named


def calibrate(
    campaign: Campaign | str | Path,
    effects: str | Effect | Sequence[str | Effect] = KINEMATIC,
    *,
    progress: Callable[[str], None] = lambda _: None,
) -> Calibration:
    """Fit named effects and the unknown frames, whether or not the data speak for them.

    Nothing is chosen: for what is at work, and how sure that is, ask :func:`~thermal_robot.diagnose`, which also looks
    for faults of the table. Rows far off are set aside here, too.

    Parameters
    ----------
    campaign
        A campaign, or the path of one.
    effects
        Names, or effects of your own: by default the joints' zeros and the geometry of the links. Each parameter is
        held to its expected size, as ``[priors]`` says it, times a factor for each effect that the data tell. An effect
        that is told inside another one of them, as the zeros are inside the geometry, is not fitted twice. Of one with
        constants of another kind, such as a lag, the most probable setting is taken.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Calibration
        Prints as text; ``parameters`` is a data frame, ``model`` predicts and corrects.

    Raises
    ------
    CampaignError, RobotError
        If the campaign cannot be used.
    EffectError
        If a name is not known, named twice or that of an effect that scatters; if the campaign lacks what one needs.
    EstimationError
        If there are too few measurements for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> worn = {"backlash": {"joint_3": 3e-4}}
    >>> campaign = tr.simulate("builtin:rv_m2", worn, tool_frame="tool0", noise=20e-6, seed=1)
    >>> found = tr.calibrate(campaign, "backlash")
    >>> print(f"{1e3 * found.parameters.value['backlash', 'lost motion, joint_3']:.1f} mrad")
    0.3 mrad
    """
    expected = "a campaign, or the path of one; campaign_from_table makes one of a DataFrame"
    require("calibrate()", campaign, (Campaign, str, os.PathLike), expected)
    require("calibrate(), progress", progress, (Callable,), "a function that takes the words of a stage")
    chosen = _named(effects)
    if not isinstance(campaign, Campaign):
        progress("reading the campaign")
        campaign = read_campaign(campaign)
    if campaign.priors:
        check_priors(campaign, {*library(), *(effect.name for effect in chosen)})
    if campaign.position is None or not campaign.samples:
        raise CampaignError(campaign.name, "nothing was measured", expected="a campaign with measured positions")
    campaign, notes = usable(campaign)
    with _libraries().limit(limits=1), solvable(campaign):
        fit = fit_named(as_counted(campaign), chosen, progress)
    return of_fit(fit, tuple(effect.name for effect in chosen), (*fit.campaign.warnings, *notes))


@cache
def _libraries() -> ThreadpoolController:
    """Return what holds the threads of the libraries; to look for them takes as long as a tenth of a calibration."""
    return ThreadpoolController()


def _named(effects: str | Effect | Sequence[str | Effect]) -> tuple[Effect, ...]:
    """Return the effects that were asked for, each once."""
    what = "names of effects, or effects of your own"
    require("calibrate(), effects", effects, (str, Effect, list, tuple), what)
    given = (effects,) if isinstance(effects, (str, Effect)) else tuple(effects)
    for one in given:
        require("calibrate(), effects", one, (str, Effect), what)
    found = tuple(named(one) if isinstance(one, str) else one for one in given)
    if not found:
        raise EffectError("calibrate(), effects: names no effect, expected at least one")
    names = [effect.name for effect in found]
    for effect in found:
        if effect.random:
            raise EffectError(f"effect {effect.name!r} scatters: no calibration removes it; ask diagnose() about it")
        if names.count(effect.name) > 1:
            raise EffectError(f"calibrate(), effects: {effect.name!r} is named twice")
    return found
