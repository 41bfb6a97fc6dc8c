"""The result of a calibration: one frozen value. What is not asked for is not computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis.findings import estimates, told_inside
from thermal_robot.diagnosis.parts import Estimate
from thermal_robot.diagnosis.residual_tests import Examined, examine
from thermal_robot.diagnosis.uncertainty import as_remainder_says
from thermal_robot.inference.algebra import rms
from thermal_robot.inference.fit import Fit
from thermal_robot.teller import registered

if TYPE_CHECKING:
    import pandas as pd


class Teller(Protocol):
    """Who puts a calibration into words."""

    def calibration_text(self, calibration: Calibration) -> str:
        """Return all of it as plain text."""


@dataclass(frozen=True)
class Calibrated:
    """One effect of a calibration with its estimates; ``title`` is what it is in plain words.

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
    """What named effects are in a robot, and what they leave.

    Attributes
    ----------
    campaign, robot, tool_frame, samples, measures
        What was calibrated.
    names
        Of the effects that were asked for.
    outliers
        Row numbers in the file of the measurements set aside.
    rms_before, rms_after
        Rms distance over the other rows with the unknown frames fitted and nothing else, and by the calibrated model,
        m, on the rows that were fitted.
    turned_before, turned_after
        The same of orientations, rad; ``None`` where positions were measured.
    noise
        One sigma per axis of positions, as it was estimated beside the effects, m.
    warnings
        What a reader should know of the data.
    fit
        The fit.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> off = {"joint_offset": {"joint_2": 1e-3, "joint_3": -5e-4}}
    >>> campaign = tr.simulate("builtin:rv_m2", off, tool_frame="tool0", noise=20e-6, base_known=False, seed=1)
    >>> found = tr.calibrate(campaign)
    >>> found
    Calibration('simulated': joint_offset, geometric)
    >>> found.rms_after < 0.2 * found.rms_before, found.unexplained
    (True, False)
    >>> told = found.parameters.loc["joint_offset", "zero offset, joint_3"]
    >>> bool(abs(told["value"] + 5e-4) < 3.0 * told["std"])
    True
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
    def _examined(self) -> Examined:
        return examine(self.fit)

    @property
    def unexplained(self) -> bool:
        """Whether what is left is larger, or more structured, than noise: something else is at work."""
        return self._examined.unexplained.flagged

    @cached_property
    def effects(self) -> tuple[Calibrated, ...]:
        """The effects with their parameters: what is told inside a larger one before the rest of that.

        Where what is left is :attr:`unexplained`, deviations hold what that may do to parameters, beside the noise.
        """
        fit = as_remainder_says(self.fit) if self.unexplained else self.fit
        titles = {name: own[0].title for name, own in fit.variants.items()}
        inside, found = told_inside(fit), []
        for block, (effect, _) in zip(fit.explanation.best.blocks, fit.effects, strict=True):
            parts = {name: part for name, part in inside.items() if part.container == effect.name}
            found += [
                Calibrated(name, titles[name], part.parameters, part.unseen, effect.name)
                for name, part in parts.items()
            ]
            if effect.name not in parts:
                found.append(Calibrated(effect.name, titles[effect.name], estimates(fit, block)))
        return tuple(found)

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of all effects, SI: index (effect, parameter); ``value``, ``std``, ``unit``, ``identified``.

        NaN where the data do not identify the parameter.
        """
        from thermal_robot.diagnosis.tabled import estimates

        return estimates((effect.name, estimate) for effect in self.effects for estimate in effect.parameters)

    @cached_property
    def model(self) -> CorrectedModel:
        """The calibrated model: it predicts, corrects commands and writes the calibrated robot."""
        from thermal_robot.diagnosis.answer import model_of

        return model_of(self.fit, self._examined.floor)

    @property
    def frames(self) -> pd.DataFrame:
        """Base and target as declared or fitted, SI: see :func:`~thermal_robot.diagnosis.tabled.fitted_frames`."""
        from thermal_robot.diagnosis.tabled import fitted_frames

        return fitted_frames(self.model)

    def __repr__(self) -> str:
        return f"Calibration({self.campaign!r}: {', '.join(self.names)})"

    def __str__(self) -> str:
        teller: Teller = registered()
        return teller.calibration_text(self)


def of_fit(fit: Fit, names: tuple[str, ...], warnings: tuple[str, ...]) -> Calibration:
    """Return the calibration that a fit of named effects is."""
    campaign, e = fit.campaign, fit.explanation
    before, after = (_rms(seen.gap[~e.outliers]) for seen in (fit.nominal, fit.corrected))
    return Calibration(
        campaign.name,
        campaign.robot.name,
        campaign.robot.tool_frame,
        campaign.samples,
        campaign.measures,
        names,
        tuple(campaign.rows[e.outliers].tolist()),
        before[0],
        after[0],
        before[1],
        after[1],
        float(e.whitening.noise[0] * e.best.noise),
        warnings,
        fit,
    )


def _rms(gap: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[float, float | None]:
    """Return the rms of the lengths of positions, and of turns where there are any."""
    return rms(gap[:, :3]), rms(gap[:, 3:]) if gap.shape[1] > 3 else None
