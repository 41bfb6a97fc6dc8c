"""Steps of a diagnosis: data checks, model selection, pruning, scatter, and the answer."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.names import did_you_mean
from thermal_robot.diagnosis.answer import Conclusion, answer
from thermal_robot.diagnosis.cross_validation import held_out
from thermal_robot.diagnosis.data_checks import counted, with_corrected_signs
from thermal_robot.diagnosis.data_faults.misfit import another_motion, delivered, frames_alone, mismatch
from thermal_robot.diagnosis.prune import concluded, forward_selection, pruned, selected_with_scatter, unsupported
from thermal_robot.diagnosis.residual_tests import analyse_residual
from thermal_robot.diagnosis.result import Diagnosis, with_summary
from thermal_robot.diagnosis.uncertainty import inflated_for_structure
from thermal_robot.diagnosis.updated import prepare
from thermal_robot.effects import RANDOM, Effect, choose, library
from thermal_robot.errors import CampaignError, EstimationError, require
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, fit, require_enough
from thermal_robot.inference.scatter import random_gap
from thermal_robot.observables import of_model


def diagnose(
    campaign: Campaign | str | Path,
    *,
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Diagnose a campaign: where the gap between robot and model lies, which effects cause it, how far it shrinks.

    Parameters
    ----------
    campaign
        A campaign, or the path of one.
    only, without
        Names of effects to consider (all where it is left out), or to leave out; one name may stand by itself.
    effects
        Effects of your own, considered beside those of the library.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Diagnosis
        Prints as text, writes as JSON, shows itself in Jupyter.

    Raises
    ------
    CampaignError, RobotError
        If the campaign cannot be used, or ``only`` is empty.
    EffectError
        If an effect's name is not known.
    EstimationError
        If there are too few measurements for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.diagnose(tr.demo_campaign())
    >>> found
    Diagnosis('demo': thermal_elongation, backlash)
    >>> print(found.summary)
    The gap of 62.6 µm comes from thermal elongation of the links and lost motion in the joints (91 % sure); ...
    """
    expected = "a campaign, or the path of one; campaign_from_table makes one of a DataFrame"
    require("diagnose()", campaign, (Campaign, str, os.PathLike), expected)
    require("diagnose(), effects", effects, (list, tuple), "a list of your own effects; names go to only")
    require("diagnose(), progress", progress, (Callable,), "a function that takes the words of a stage")
    only, without = effect_names(only, without)
    if not isinstance(campaign, Campaign):
        progress("reading the campaign")
        campaign = read_campaign(campaign)
    candidates = _asked_of(campaign, choose(only, without, effects))
    # where nothing was left out the candidates are all; installed packages are looked up once
    everything = {effect.name for effect in (*effects, *candidates)}
    if only or without:
        everything |= {*library()}
    check_priors(campaign, everything)

    def asked(name: str) -> bool:
        return name not in without and (not only or name in only)

    campaign, notes = counted(campaign)
    # matrices are small: threads that wait for each other cost several times what they bring, and the last bits
    with threadpool_limits(1), solvable(campaign):
        last = _concluded(campaign, candidates, effects, progress)
        shrinkage = held_out(last.fit, progress)
        progress("places")
        found = answer(
            last,
            shrinkage,
            candidates,
            asked=asked,
            left_out=sorted(name for name in {*everything, *RANDOM} if not asked(name)),
            notes=notes,
        )
        prepare(diagnosis := with_summary(found))
        return diagnosis


def _asked_of(campaign: Campaign, effects: Sequence[Effect]) -> Sequence[Effect]:
    """Return the candidate effects; where rows are predictions of another model, only those a model can hold."""
    return [effect for effect in effects if effect.in_model] if of_model(campaign) else effects


@contextmanager
def solvable(campaign: Campaign) -> Iterator[None]:
    """Context that turns NumPy's ``LinAlgError`` into an :class:`EstimationError` about values of absurd sizes."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise EstimationError(
            f"{campaign.name}: the equations cannot be solved in floating point ({error}); look for values that are "
            "many orders of magnitude too large or too small"
        ) from error


def effect_names(only: Iterable[str] | None, without: Iterable[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Validate names of effects to consider, empty for all, and to leave out; an error where ``only`` is empty."""
    if only is not None and not (only := _names("only", only)):
        raise CampaignError("diagnose(), only", "names no effect", expected="at least one, or only left out for all")
    return tuple(only or ()), _names("without", without)


def _names(argument: str, given: Iterable[str]) -> tuple[str, ...]:
    if isinstance(given, str):
        return (given,)
    require(f"diagnose(), {argument}", given, (Iterable,), "names of effects")
    names = tuple(given)
    for name in names:
        require(f"diagnose(), {argument}", name, (str,), "names of effects")
    return names


def _concluded(
    campaign: Campaign, candidates: Sequence[Effect], own: Sequence[Effect], progress: Callable[[str], None]
) -> Conclusion:
    """Explain the gap by effects; by the frames alone where a test says that robot and table do not match."""
    misfit = mismatch(campaign, progress)
    if misfit is None:
        require_enough(campaign)  # before signs are asked, which fit frames too
        last = _explained(fit(with_corrected_signs(campaign, own), candidates, progress), progress)
        # no further query comes: what was weighed would fill memory
        last = replace(last, fit=replace(last.fit, explanation=replace(last.fit.explanation, searched=None)))
        misfit = another_motion(last.fit)
        if misfit is None:
            return delivered(last, candidates)
    return replace(frames_alone(campaign, candidates), misfit=misfit)


def _explained(fit: Fit, progress: Callable[[str], None]) -> Conclusion:
    """Forward selection of unlisted terms, backward elimination, estimation of scatter, and tests of the residual."""
    for number in range(1, 1 if of_model(fit.campaign) else settings.SELECTIONS):
        wider = forward_selection(fit, number, progress)
        if wider is None:
            break
        fit = wider
    fit, refused = pruned(fit, progress)
    while True:
        chance = random_gap(fit)
        if chance.explains_size:
            return selected_with_scatter(fit, chance, refused, progress)
        left = analyse_residual(fit, progress)
        wider = inflated_for_structure(fit) if left.unexplained.flagged else fit
        lost = unsupported(fit, wider)
        if not lost:
            return concluded(wider, left, chance, refused)
        fit, others = pruned(fit, progress, lost)
        refused |= others


def check_priors(campaign: Campaign, known: set[str]) -> None:
    """Refuse a campaign that states the prior size of an unknown effect, and suggest the name that was meant."""
    for name in campaign.priors:
        if name not in known:
            expected = "one of " + ", ".join(sorted(known))
            problem = f"no effect has this name{did_you_mean(name, known)}"
            raise CampaignError(campaign.name, problem, column=f"priors.{name}", expected=expected)
