"""The parts of a diagnosis: plain frozen values that findings hand to a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.effect import in_words

Array = NDArray[np.float64]
Status = Literal["found", "not_found", "not_testable", "confounded"]


@dataclass(frozen=True)
class Location:
    """A place and its share of the gap's mean square (or, for a remainder, its probability)."""

    kind: str
    name: str
    share: float

    @property
    def words(self) -> str:
        """The place with its kind, unless its name says it already."""
        return in_words(self.kind, self.name)


@dataclass(frozen=True)
class Estimate:
    """A parameter: SI value with its standard deviation, both ``None`` where the data do not determine it."""

    name: str
    value: float | None
    std: float | None
    unit: str
    identified: bool


@dataclass(frozen=True)
class Finding:
    """What the data say of one effect.

    Attributes
    ----------
    name
        The effect's name.
    status
        ``found``, ``not_found``, ``not_testable`` or ``confounded``.
    probability
        Posterior probability that it is at work; ``None`` where it is not testable.
    shrinkage, shrinkage_ci95
        Its share of the gap's mean square, on data not used for the fit: Shapley value over the explanation for an
        effect that belongs to it; what adding it brings for another; ``None`` where it is not testable.
    needs
        What would make it testable.
    confounded_with
        Effects that the data cannot tell it from.
    locations
        Where it sits, largest share first.
    parameters
        Its estimates; empty where it does not belong to the explanation.
    quantity, shape, describes
        Of a law that was discovered: what it follows, how, and a sentence about it; ``None`` otherwise.
    title
        The effect in plain words.
    random
        Whether it scatters, so that no correction takes it away.
    """

    name: str
    status: Status
    probability: float | None = None
    shrinkage: float | None = None
    shrinkage_ci95: tuple[float, float] | None = None
    needs: tuple[str, ...] = ()
    confounded_with: tuple[str, ...] = ()
    locations: tuple[Location, ...] = ()
    parameters: tuple[Estimate, ...] = ()
    quantity: str | None = None
    shape: str | None = None
    describes: str | None = None
    title: str = ""
    random: bool = False


def is_frame(found: Sequence[Finding], name: str) -> bool:
    """Tell whether an effect displaces a frame that is unknown; such an effect may be confounded and no candidate."""
    needs = next((f.needs for f in found if f.name == name), ("frames.",))
    return any(need.startswith("frames.") for need in needs)


@dataclass(frozen=True)
class HeldOut:
    """How far the gap shrinks on rows that were not used for the fit: rms distances in m, shares 0..1."""

    scheme: str
    folds: int
    rms_before: float
    rms_after: float
    shrinkage: float
    shrinkage_ci95: tuple[float, float]


@dataclass(frozen=True)
class FoldScheme:
    """How far the gap shrinks when rows are held out in one way.

    Attributes
    ----------
    name
        ``time``, ``session``, ``temperature``, ``region`` or ``reach``.
    held_out
        What is held out at a time, in plain words.
    folds, rows
        How many folds could be fitted, and how many rows were held out in them.
    rms_before, rms_after
        Rms distances of these rows, m: frames alone, and the explanation.
    shrinkage
        1 − (rms_after / rms_before)².
    uncertainty
        Standard error of rms_after, m: what chance alone makes of it.
    """

    name: str
    held_out: str
    folds: int
    rows: int
    rms_before: float
    rms_after: float
    shrinkage: float
    uncertainty: float


@dataclass(frozen=True)
class Gap:
    """Rms distances in m (orientation: rad) over the rows that are not outliers; ``None`` without orientation."""

    rms_before: float
    rms_after: float
    noise_floor: float
    noise_source: str
    held_out: HeldOut
    orientation_before: float | None = None
    orientation_after: float | None = None
    schemes: tuple[FoldScheme, ...] = ()


@dataclass(frozen=True)
class Where:
    """Shares 0..1 of the gap's mean square: by axis of the root frame, joint, link, and recorded quantity.

    Axes sum to one. Joints and links share what the explanation explains. A quantity's share is what a smooth law of
    it alone would explain, so these overlap.
    """

    axes: Mapping[str, float]
    joints: Mapping[str, float]
    links: Mapping[str, float]
    covariates: Mapping[str, float]


@dataclass(frozen=True)
class Dependence:
    """A recorded quantity that the remainder follows.

    Attributes
    ----------
    covariate
        Its name.
    p_value
        Of an F test, after counting every quantity that was tried; where a discovered law follows it, exp(−gain), the
        odds that the data give against that law.
    """

    covariate: str
    p_value: float


@dataclass(frozen=True)
class Unexplained:
    """What the explanation leaves beyond the noise.

    Attributes
    ----------
    flagged
        Whether it is larger or more structured than the noise allows.
    rms
        Its rms distance, m: noise subtracted where a stated noise or repeats tell it, all of it where nothing does; 0
        where nothing is left.
    p_value
        Of the most telling test, after counting all of them.
    reasons
        Plain sentences: which test says so.
    locations
        Where it most probably enters.
    depends_on
        The quantities that it follows, most telling first.
    """

    flagged: bool
    rms: float
    p_value: float
    reasons: tuple[str, ...] = ()
    locations: tuple[Location, ...] = ()
    depends_on: tuple[Dependence, ...] = ()


@dataclass(frozen=True, eq=False)
class Rows:
    """What the figures show, one row a measurement, N rows.

    Attributes
    ----------
    rows
        (N,) row numbers in the file.
    gap, remainder
        (N, m) before and after, root frame axes: m, and rad.
    outliers
        (N,) True where set aside.
    position
        (N, 3) predicted position of the target in the root frame, m.
    q
        (N, n) commanded joint positions.
    covariates
        Recorded quantities by name, (N,).
    held_out_before, held_out_after
        (N,) distance in m while the row was held out; NaN where it was set aside.
    units
        SI unit of every covariate and of every joint's position, by name; empty where it has none.
    """

    rows: NDArray[np.int64]
    gap: Array
    remainder: Array
    outliers: NDArray[np.bool_]
    position: Array
    q: Array
    covariates: Mapping[str, Array]
    held_out_before: Array
    held_out_after: Array
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Sensitivity:
    """Posterior probability of the verdict's effects were every prior size a third, or three times, what is stated."""

    smaller: float
    larger: float


@dataclass(frozen=True, eq=False)
class Place:
    """One place where an effect is at work, n rows.

    Attributes
    ----------
    kind, name
        ``joint`` and its name, and so on.
    share
        Part of what the effect does that it does here, 0..1.
    quantity, quantity_unit
        What drives the effect here.
    values
        (n,) of that quantity, SI.
    levels
        Whether it takes a few values only.
    unit
        Of the error: ``rad`` or ``m`` at the place; ``m at the tool`` where the error both shifts and turns.
    before, after, spread
        (n,) the error with the effect left in, without it, and one sigma of the noise in either.
    line
        (2, k) the fitted law: quantity and error.
    """

    kind: str
    name: str
    share: float
    quantity: str
    quantity_unit: str
    values: Array
    levels: bool
    unit: str
    before: Array
    after: Array
    spread: Array
    line: Array

    @property
    def words(self) -> str:
        """The place with its kind, unless its name says it already."""
        return in_words(self.kind, self.name)


@dataclass(frozen=True, eq=False)
class Explained:
    """What one effect explains.

    Attributes
    ----------
    effect
        Its name.
    places
        Those with a material share, largest first.
    left_out
        How many more there are.
    """

    effect: str
    places: tuple[Place, ...]
    left_out: int
