"""Values of a diagnosis: frozen dataclasses, SI; distances in m."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.plausible import in_another_unit
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.law_words import Size

UNIT = 30.0
"""Factor on all link lengths, up or down, from which the URDF's unit is wrong, not its robot: inches read as m are 39,
cm a hundred, mm a thousand; sisters differ by three."""

Status = Literal["found", "not_found", "not_testable", "confounded", "contained"]


@dataclass(frozen=True)
class Location:
    """Place with its share of the gap's mean square; for an unexplained residual, with its probability."""

    kind: str
    name: str
    share: float

    @property
    def words(self) -> str:
        """Name of the place with its kind, unless the name contains it."""
        return in_words(self.kind, self.name)


@dataclass(frozen=True)
class Estimate:
    """A parameter: SI value and standard deviation; both are ``None`` if the data do not identify it."""

    name: str
    value: float | None
    std: float | None
    unit: str
    identified: bool


@dataclass(frozen=True)
class RobotFile:
    """Expected gap, m, with one kind of robot file alone: rows held out, base and tool registered anew.

    Attributes
    ----------
    files
        Files of this kind, as the options of ``thermal-robot correct`` name them: ``urdf``, ``offsets``, ….
    holds
        What they hold: ``placements``, ``zeros`` or ``ticks``.
    min_sigma
        Standard deviations from zero below which parameters are left out; ``None`` for a file with all.
    alone
        Whether it is fitted anew, to be used without the rest of the model.
    rms_before, rms_after
        With the nominal robot and with the file.
    shrinkage, shrinkage_ci95
        Share of the gap's mean square that the file removes, and the 95 % interval for other rows of the same kind.
    """

    files: tuple[str, ...]
    holds: str
    min_sigma: float | None
    alone: bool
    rms_before: float
    rms_after: float
    shrinkage: float
    shrinkage_ci95: tuple[float, float]


@dataclass(frozen=True)
class Finding:
    """Result for one effect: status, probability, estimates, places and held-out share.

    Attributes
    ----------
    name, title
        The effect's name, and the same in plain words; of a discovered law a short name.
    status
        ``found``, ``not_found``, ``not_testable``, ``confounded``, or ``contained``: a part of a larger effect that was
        found, in ``confounded_with``.
    probability
        Posterior probability that it is at work; of a discovered law, that one of this quantity is at work at this
        place; of one contained, that the larger one is. ``None`` where it is not testable.
    shrinkage, shrinkage_ci95
        Its share of the gap's mean square on held-out rows, noise included, and the 95 % interval. For an effect of the
        fit it is the Shapley value, and these sum to the overall shrinkage; for another the gain from adding it.
        Of a log of motion it is the gain from leaving the effect in, all others refitted; these do not sum to a whole.
        ``None`` where it is not testable.
    needs
        Columns or frames that would make it testable.
    confounded_with
        Effects that the data cannot tell it from.
    locations
        Places where it acts, largest share first.
    parameters, unseen
        Its estimates, empty if it is neither part of the fit nor contained; names of parameters that the data do not
        determine.
    size
        Range over the measured rows of a discovered law, or of an effect that is a curve of each joint.
    quantity, shape, describes, usually
        Only of a discovered law: the quantity that it follows, its shape, a sentence about it, and what one of that
        place and quantity usually is; ``None`` where nobody can say.
    of
        Only of a discovered law that is a known effect whose size follows the quantity: that effect's name.
    random
        Whether it is random, so that no correction can remove it.
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
    unseen: tuple[str, ...] = ()
    quantity: str | None = None
    shape: str | None = None
    describes: str | None = None
    size: tuple[Size, ...] = ()
    usually: str | None = None
    of: str | None = None
    title: str = ""
    random: bool = False


def is_frame(found: Sequence[Finding], name: str) -> bool:
    """Whether an effect is the displacement of an unknown frame.

    True for a name without a finding, too: only an unknown frame is confounded with effects without being a candidate.
    """
    needs = next((f.needs for f in found if f.name == name), ("frames.",))
    return any(need.startswith("frames.") for need in needs)


@dataclass(frozen=True)
class Refused:
    """Effect removed by cross-validation: its probability and its held-out share.

    The share is ``None`` where scatter of joints imitated the effect, it stayed uncertain, or the data did not
    determine it.
    """

    probability: float
    share: float | None = None


@dataclass(frozen=True)
class DataFault:
    """Fault of the table that explains the gap without a fault of the robot.

    ``kinds`` are those that the data cannot tell apart; ``what`` and ``remedy`` are plain words without a full stop.
    ``rms_before``, ``rms_after``: rms distance over the rows struck with frames registered, as they stand and mended;
    turns count in it where orientations are measured. ``rows``: numbers in the file, empty where it struck all.
    """

    kinds: tuple[str, ...]
    what: str
    remedy: str
    rms_before: float
    rms_after: float
    rows: tuple[int, ...] = ()


@dataclass(frozen=True)
class AnotherModel:
    """Robot that was measured, as far as the table distinguishes it from the URDF's.

    Its links are ``factor`` times as long, if all alike; ``joint`` is ``off`` m from its place in the URDF, the
    farthest. A shipped robot that ``fits``, as :func:`~thermal_robot.load_robot` takes it, leaves the median distance
    ``remains``, m.
    """

    factor: float | None = None
    joint: str = ""
    off: float = 0.0
    fits: str | None = None
    remains: float = 0.0

    @property
    def in_another_unit(self) -> bool:
        """Whether the URDF's lengths are not in m."""
        return self.factor is not None and not 1.0 / UNIT < self.factor < UNIT

    @property
    def unit(self) -> str:
        """Unit of the URDF's lengths, in words; empty where it is m."""
        return in_another_unit(self.factor) if self.factor is not None and self.in_another_unit else ""


@dataclass(frozen=True)
class Misfit:
    """Mismatch of robot and table, so that nothing can be said of the robot.

    ``fault`` of the table that would mend it, or ``model``, another robot; where neither, ``away`` and ``turned``: rms
    distance, m, or turn, rad, that the best explanation leaves, ``None`` for what fits.
    """

    fault: DataFault | None = None
    away: float | None = None
    turned: float | None = None
    model: AnotherModel | None = None


@dataclass(frozen=True)
class HeldOut:
    """Cross-validation: rms distances, m, and shrinkage of the gap on held-out rows, the noise of the rows included.

    Frames and parameters are fitted anew without each fold. Candidates, the choice among them, the place and quantity
    of a law, refined constants, prior scales and outliers are those of all rows.

    ``rms_before`` is with the frames alone, ``rms_after`` with the effects, outliers left out; ``…_with_aside`` with
    the rows set aside, ``None`` where not asked. ``shrinkage`` is 1 − (rms_after / rms_before)², the sum of the shares
    of the model's effects, with the interval in which it lies on fresh rows of the same kind with the saved model.
    """

    scheme: str
    folds: int
    rms_before: float
    rms_after: float
    shrinkage: float
    shrinkage_ci95: tuple[float, float]
    rms_before_with_aside: float | None = None
    rms_after_with_aside: float | None = None


@dataclass(frozen=True)
class FoldScheme:
    """Cross-validation under one scheme: ``time``, ``session``, ``temperature``, ``region``, ``reach``, ``range``.

    ``held_out`` says what is held out at a time; ``folds`` could be fitted, ``rows`` were held out in them. Rms
    distances of these rows with the frames alone and with the effects, and the standard ``uncertainty`` of the latter;
    ``shrinkage`` is 1 − (rms_after / rms_before)².
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
class KindGap:
    """Rms gaps of the rows of one ``kind`` that are not outliers, in the ``unit`` in which it is read: m or px.

    ``noise_floor`` is what noise alone would leave of these rows.
    """

    kind: str
    unit: str
    rows: int
    rms_before: float
    rms_after: float
    noise_floor: float


@dataclass(frozen=True)
class Gap:
    """Rms distances, m, over the rows that are not outliers; of orientation in rad, ``None`` if not measured.

    ``kinds`` tell them apart by kind of measurement where there are several, or one that is not read in metres: the
    other figures are then taken over all rows alike, in metres across what each sees.


    ``schemes`` are other ways of holding rows out, the hardest first; ``hardest`` is the first of them where it leaves
    clearly more than ``held_out`` does, ``worse`` that by session or region where the correction harms; else ``None``.
    """

    rms_before: float
    rms_after: float
    noise_floor: float
    noise_source: str
    held_out: HeldOut
    orientation_before: float | None = None
    orientation_after: float | None = None
    schemes: tuple[FoldScheme, ...] = ()
    hardest: FoldScheme | None = None
    worse: FoldScheme | None = None
    kinds: tuple[KindGap, ...] = ()

    @property
    def noise_known(self) -> bool:
        """Whether the noise is known independently of the residual: stated, or measured by repeated commands."""
        return self.noise_source != "remainder"


@dataclass(frozen=True)
class Where:
    """Shares 0..1 of the gap's mean square: by axis of the root frame, joint, link, and recorded quantity.

    Axes sum to one. Joints, links, and what lies beyond them (``base``, ``tool``, ``instrument``) share the part that
    the fit explains. The share of a quantity is what a smooth law of it alone would explain; these shares overlap.
    """

    axes: Mapping[str, float]
    joints: Mapping[str, float]
    links: Mapping[str, float]
    covariates: Mapping[str, float]
    beyond: Mapping[str, float] = field(default_factory=dict)

    @property
    def places(self) -> dict[tuple[str, str], float]:
        """Shares of all places, by kind and name, largest first; their sum is the explained share."""
        shares = {(kind, name): s for kind in ("joint", "link") for name, s in getattr(self, f"{kind}s").items()}
        shares |= {(kind, kind): share for kind, share in self.beyond.items()}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class Dependence:
    """Recorded quantity that the residual follows, with the Bonferroni-corrected p-value of its F test.

    Where a discovered law follows it: the posterior probability that it follows another one.
    """

    covariate: str
    p_value: float


@dataclass(frozen=True)
class Unexplained:
    """The residual beyond the noise; ``flagged`` where it is significantly larger or more structured than noise.

    ``rms`` distance, m, less the noise if that is stated or known from repeats, 0 if not flagged. ``p_value`` is the
    smallest of all tests, with Bonferroni correction; where laws were found, at most the posterior probability that
    there is none. ``reasons``: a sentence for each failed test; ``locations``: where it most probably enters;
    ``depends_on``: what it follows, most significant first.
    """

    flagged: bool
    rms: float
    p_value: float
    reasons: tuple[str, ...] = ()
    locations: tuple[Location, ...] = ()
    depends_on: tuple[Dependence, ...] = ()


@dataclass(frozen=True)
class Wanted:
    """Most useful next measurement: a column, a pose, repeats, a frame or a wider range.

    ``kind`` is ``column``: to be recorded; ``frame``: to be measured and declared known; ``pose``: to be measured;
    ``range``: poses over the whole range of every joint; ``repeats``: poses repeated on another day. ``name`` is that
    of the column (of repeats: that labels them) or frame. It tells effects ``apart``; ``untested`` could then be
    tested, ``whether`` is the cause that a column would show or rule out. ``place`` and ``follows``, of a remainder
    that a column would tell of, where known. ``position`` and ``conditions`` of a pose: by name, rad or m, and further
    columns, SI; ``labels``: to what it goes, by column.
    """

    kind: Literal["column", "frame", "pose", "range", "repeats"]
    name: str = ""
    apart: tuple[str, ...] = ()
    untested: tuple[str, ...] = ()
    whether: str = ""
    place: str = ""
    follows: str = ""
    position: Mapping[str, float] = field(default_factory=dict)
    conditions: Mapping[str, float] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rows:
    """Row-wise data for the figures, N rows.

    ``rows`` (N,) are numbers in the file, ``outliers`` (N,) is True for outliers. ``gap`` and ``remainder`` (N, m):
    residual with the frames alone and with the effects, in root frame axes, m, then rad. ``position`` (N, 3) of the
    target as predicted, root frame, m; ``q`` (N, n) as commanded; ``covariates`` (N,) by name. ``held_out_before`` and
    ``held_out_after`` (N,): distance, m, of the row when held out, NaN where it was left out as an outlier. ``units``:
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
    """Posterior probability of the verdict with all prior sizes a third (smaller) or three times (larger) as stated."""

    smaller: float
    larger: float


@dataclass(frozen=True, eq=False)
class Place(Location):
    """Component-plus-residual plot of one place: the error in n rows against the ``quantity`` that drives it.

    ``share`` 0..1 of the effect's contribution enters here. ``values`` (n,) are the quantity's, SI, a few only where it
    is ``levels``. ``before``, ``after`` and ``spread`` (n,): error with the effect left in, without it, and one sigma
    of noise of both, in ``unit``: rad or m at the place, ``m at the tool`` where it both shifts and turns. ``line``
    (2, k) is the fitted law. ``centred``: told less the mean, which unknown frames take up as well.
    """

    quantity: str
    quantity_unit: str
    values: Array
    levels: bool
    unit: str
    before: Array
    after: Array
    spread: Array
    line: Array
    centred: bool = False


@dataclass(frozen=True, eq=False)
class Explained:
    """Partial residuals of one effect at its largest places, and the number of places left out."""

    effect: str
    places: tuple[Place, ...]
    left_out: int


def jsonable(value: Any) -> Any:
    """Convert to plain JSON values: tuples to lists, NumPy numbers to Python's, infinite ones to ``None``."""
    if isinstance(value, Mapping):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [jsonable(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value
