"""Calibration: fit of effects that the user names, without model selection."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from threadpoolctl import ThreadpoolController

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis.answer import model_of
from thermal_robot.diagnosis.data_checks import usable, with_corrected_signs
from thermal_robot.diagnosis.diagnose import check_priors, solvable
from thermal_robot.diagnosis.findings import divided_effects, estimates
from thermal_robot.diagnosis.residual_tests import ResidualAnalysis, analyse_residual
from thermal_robot.diagnosis.uncertainty import inflated_for_structure
from thermal_robot.diagnosis.values import Estimate
from thermal_robot.effects import KINEMATIC, Effect, library, named
from thermal_robot.errors import EffectError, require
from thermal_robot.inference.algebra import rms
from thermal_robot.inference.fit import Fit, fit_named
from thermal_robot.observables import components
from thermal_robot.renderer import registered_renderer

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Calibrated:
    """One effect of a calibration with its estimates; ``title`` is its name in plain words.

    ``unseen`` are parameters that the data do not tell from those before them, or from the frames; ``inside`` is the
    larger effect that was fitted, of which this is a part or the rest.
    """

    name: str
    title: str
    parameters: tuple[Estimate, ...]
    unseen: tuple[str, ...] = ()
    inside: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """Result of a calibration: parameters of named effects of a robot, and the residual.

    Attributes
    ----------
    campaign, robot, tool_frame, samples, measures
        Names of campaign, robot and tool frame, number of rows, and kind of measurement.
    names
        Names of the calibrated effects.
    outliers
        Row numbers in the file of the measurements set aside.
    rms_before, rms_after, turned_before, turned_after
        Rms of positions, m, and of orientations, rad (``None`` without), over the other rows, which were fitted: with
        the unknown frames fitted and nothing else, and by the calibrated model.
    noise
        One sigma per axis of positions, as it was estimated beside the effects, m.
    warnings, fit
        Warnings on the data, one sentence each; the fit behind the result.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> off = {"joint_offset": {"joint_2": 1e-3, "joint_3": -5e-4}}
    >>> campaign = tr.simulate("builtin:rv_m2", off, tool_frame="tool0", noise=20e-6, base_known=False, seed=1)
    >>> found = tr.calibrate(campaign)
    >>> found
    Calibration('simulated': joint_offset, geometric)
    >>> told = found.parameters.loc["joint_offset", "zero offset, joint_3"]
    >>> found.rms_after < 0.2 * found.rms_before, found.unexplained, bool(abs(told["value"] + 5e-4) < 3 * told["std"])
    (True, False, True)
    >>> [effect.name for effect in found.effects], found.frames.shape, found.model.measures
    (['joint_offset', 'geometric'], (2, 6), 'position')
    """

    campaign: str
    robot: str
    tool_frame: str
    samples: int
    measures: str
    names: tuple[str, ...]
    outliers: tuple[int, ...]
    rms_before: float
    rms_after: float
    turned_before: float | None
    turned_after: float | None
    noise: float
    warnings: tuple[str, ...]
    fit: Fit

    @cached_property
    def _examined(self) -> ResidualAnalysis:
        return analyse_residual(self.fit)

    @property
    def unexplained(self) -> bool:
        """Whether the residual is significantly larger, or more structured, than noise: the tests of a diagnosis."""
        return self._examined.unexplained.flagged

    @cached_property
    def effects(self) -> tuple[Calibrated, ...]:
        """Effects with their parameters; an effect contained in a larger one comes before the rest of that.

        With an :attr:`unexplained` residual, the standard deviations are inflated for it.
        """
        fit = inflated_for_structure(self.fit) if self.unexplained else self.fit
        titles = {name: own[0].title for name, own in fit.variants.items()}
        inside, found = divided_effects(fit), []
        for block, (effect, _) in zip(fit.explanation.best.blocks, fit.effects, strict=True):
            for name, part in inside.items():
                if part.container == effect.name:
                    found.append(Calibrated(name, titles[name], part.parameters, part.unseen, effect.name))
            if effect.name not in inside:
                found.append(Calibrated(effect.name, titles[effect.name], estimates(fit, block)))
        return tuple(found)

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of all effects, SI: index (effect, parameter); ``value``, ``std``, ``unit``, ``identified``.

        NaN where the data do not identify the parameter.
        """
        from thermal_robot.diagnosis.result import estimate_table

        return estimate_table((effect.name, estimate) for effect in self.effects for estimate in effect.parameters)

    @cached_property
    def model(self) -> CorrectedModel:
        """The calibrated model: it predicts, corrects commands and writes the calibrated robot."""
        return model_of(self.fit, self._examined.floor)

    @property
    def frames(self) -> pd.DataFrame:
        """Base and target as declared or fitted, SI: see :func:`~thermal_robot.diagnosis.result.frame_table`."""
        from thermal_robot.diagnosis.result import frame_table

        return frame_table(self.model)

    def __repr__(self) -> str:
        return f"Calibration({self.campaign!r}: {', '.join(self.names)})"

    def __str__(self) -> str:
        return registered_renderer().calibration_text(self)


def calibrate(
    campaign: Campaign | str | Path,
    effects: str | Effect | Sequence[str | Effect] = KINEMATIC,
    *,
    progress: Callable[[str], None] = lambda _: None,
) -> Calibration:
    """Fit named effects and the unknown frames without model selection; outlying rows are set aside.

    Model selection, probabilities and tests of the table are those of :func:`~thermal_robot.diagnose`.

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
    campaign, notes = usable(campaign)
    with _libraries().limit(limits=1), solvable(campaign):
        fit = fit_named(with_corrected_signs(campaign), chosen, progress)
    campaign, e = fit.campaign, fit.explanation
    before, after = (seen.gap[~e.outliers] for seen in (fit.nominal, fit.corrected))
    poses = components(campaign) == 6
    return Calibration(
        campaign=campaign.name,
        robot=campaign.robot.name,
        tool_frame=campaign.robot.tool_frame,
        samples=campaign.samples,
        measures=campaign.measures,
        names=tuple(effect.name for effect in chosen),
        outliers=tuple(campaign.rows[e.outliers].tolist()),
        rms_before=rms(before[:, :3]),
        rms_after=rms(after[:, :3]),
        turned_before=rms(before[:, 3:]) if poses else None,
        turned_after=rms(after[:, 3:]) if poses else None,
        noise=float(e.whitening.noise[0] * e.best.noise),
        warnings=(*campaign.warnings, *notes),
        fit=fit,
    )


_libraries = cache(ThreadpoolController)
"""Cached controller of the libraries' threads; to find them takes a tenth of the time of a calibration."""


def _named(effects: str | Effect | Sequence[str | Effect]) -> tuple[Effect, ...]:
    """Look up the effects to calibrate by name; :class:`EffectError` for none, random ones and duplicates."""
    where, what = "calibrate(), effects", "names of effects, or effects of your own"
    require(where, effects, (str, Effect, list, tuple), what)
    given = (effects,) if isinstance(effects, (str, Effect)) else tuple(effects)
    for one in given:
        require(where, one, (str, Effect), what)
    found = tuple(named(one) if isinstance(one, str) else one for one in given)
    if not found:
        raise EffectError(f"{where}: names no effect, expected at least one")
    names = [effect.name for effect in found]
    for effect in found:
        if effect.random:
            raise EffectError(f"effect {effect.name!r} scatters: no calibration removes it; ask diagnose() about it")
        if names.count(effect.name) > 1:
            raise EffectError(f"{where}: {effect.name!r} is named twice")
    return found
