"""A campaign: commands, measurements and conditions, in SI units and without gaps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import description, names
from thermal_robot.campaign.checked import (
    check_covariate,
    check_joints,
    check_quaternions,
    checked_array,
    checked_mapping,
    refuse,
)
from thermal_robot.campaign.settings import FIELDS, SMALLEST, STANDARD_TEMPERATURE, Settings, as_vector, given
from thermal_robot.campaign.targets import Targets, relative_sigmas, sigma_of_all
from thermal_robot.campaign.turning import clock_of, since_turns
from thermal_robot.campaign.units import Units, scale_of
from thermal_robot.errors import CampaignError, require
from thermal_robot.kinematics import tool_poses
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import Kind, MisfitError, boolean, listed, mapping, number

if TYPE_CHECKING:
    import pandas as pd

TextArray: TypeAlias = NDArray[np.str_]


def _instance(kind: Any, expected: str) -> Kind:
    """Return a validator that accepts instances of a type only; others raise a MisfitError with ``expected``."""

    def take(value: Any, path: str) -> Any:
        if not isinstance(value, kind):
            raise MisfitError(path, value, expected)
        return value

    return take


_STATED = ("moves", "noise_position", "noise_orientation", "priors", "gears", "reference_temperature", "about")
_TEXTS = listed(_instance(str, "a tuple of texts"), expected="a tuple of texts")
_KINDS: dict[str, Kind] = {
    "robot": _instance(Robot, "a robot, from load_robot"),
    "units": _instance(Units, "Units"),
    "targets": _instance((Targets, type(None)), "Targets, as read from columns x.1 …, or None"),
    **dict.fromkeys(("extra", "derived", "turned", "warnings"), _TEXTS),
    **dict.fromkeys(("base_known", "tool_known"), boolean),
    **{key: own.kind for key, own in FIELDS.items() if key in _STATED},
    "noise_of_kinds": mapping(number(above=0.0, expected="a ratio above 0")),
}
"""What each part may be that is no array."""
_WIDE = {"q": 0, **{key: len(group) for key, group in names.POSES.items()}}
"""Figures in a row of each (N, k) array; of the commands as many as the chain has joints."""
_PER_SAMPLE = (*_WIDE, "noise_of_rows", "rows")
_BY_NAME = {"covariates": np.float64, "labels": np.str_, "missing": np.bool_, "travelled": np.float64}
_BY_NAME |= {"readings": np.float64}
"""Arrays (N,) by name, and their types."""


@dataclass(frozen=True, eq=False, repr=False)
class Campaign:
    """N measurements of one robot, SI units, arrays read-only.

    Made by :func:`read_campaign`, :func:`read_samples` or :func:`campaign_from_table`, which validate. The
    constructor checks shapes and that all figures are finite, so that a program can put a campaign together from
    arrays.

    Attributes
    ----------
    name
        Name of the campaign's directory, or the file's stem.
    robot
        The robot with its chain of n movable joints.
    q
        (N, n) commanded joint positions, rad (m for a prismatic joint), in the chain's order.
    position
        (N, 3) measured positions of the target, m, measurement frame; ``None`` for samples to predict.
    orientation
        (N, 4) measured orientations, unit quaternions wxyz that turn vectors of the target's frame into the
        measurement frame, either sign; ``None`` when not measured.
    covariates
        (N,) per name as in the table (``"time"``, ``"temperature.<link>"`` …), SI, no NaN: gaps were filled.
    extra
        Names of those covariates that the format does not define; in the unit of the file.
    derived
        Names of those covariates that were not recorded but follow from the order of the rows.
    turned
        Quantities whose columns were read with the other sign (:func:`turned_round`).
    labels
        (N,) text for ``"session"``, ``"pose"`` and ``"path"`` where the table has them; ``""`` where a cell is empty.
    simulated_position, simulated_orientation
        (N, 3) m and (N, 4) wxyz in the root frame: what the user's own simulator predicts; ``None`` if not given.
    base_known, tool_known
        Whether the measurements are in the root frame, and whether the target is where ``target`` says.
    target
        (3,) the measured point in the tool frame, m; a start value unless ``tool_known``.
    noise_position, noise_orientation
        One sigma per axis of the instrument, m and rad; ``None`` when not given.
    noise_of_rows
        (N,) one sigma of a point in each row, m, whose root mean square is ``noise_position`` if that is not given;
        ``None`` where one sigma holds for all rows.
    noise_of_kinds
        By kind of measurement, one sigma of its rows over that of all, where a fit estimated it; else empty.
    targets
        Several targets of each pose, whose common frame ``position`` and ``orientation`` are; ``None`` for one.
    payload_com
        (3,) centre of mass of the payload in the tool frame, m.
    moves
        Whether the robot goes straight from pose to pose: ``"direct"`` or ``"unknown"``.
    reference_temperature
        °C at which the URDF's lengths hold.
    priors, gears
        Expected sizes by effect; transmission ratios by joint.
    units
        Units of the files this campaign came from and is written to.
    rows
        (N,) row numbers as a text editor counts them, the header being row 1.
    warnings
        Plain sentences about what is doubtful but was accepted.
    missing
        (N,) bool per covariate that had empty cells: true where the value was filled in.
    urdf
        The robot's reference as written in the campaign file.
    travelled
        :attr:`since_turn` of rows in the larger campaign that they were taken from; set by :meth:`take`, not by users.
    readings
        (N,) per column of measurements of other kinds, where :attr:`kinds` are not position or pose alone, SI; 0 in
        rows of another kind. Their labels stand in ``labels``, the kind of each row in ``labels["kind"]``.
    facts
        What is known of the cameras and the like that such rows share, by kind, SI.
    about
        Whose measurements they are, for reports: serial numbers, operator, date, whatever the user wants there.

    Raises
    ------
    CampaignError
        Arrays whose shapes do not fit together, figures that are not finite, values of another kind.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> campaign.samples, campaign.measures, campaign.settings.tool_frame, campaign.pose_labels, campaign.relative_noise
    (120, 'position', 'tool0', None, None)
    >>> campaign.kinds, campaign.measured, campaign.numbered
    (('position',), True, {})
    >>> campaign.clock.shape, campaign.since_turn["joint_2"].shape, campaign.reach > 1.0
    ((120,), (120,), True)
    """

    name: str
    robot: Robot
    q: Array
    position: Array | None = None
    orientation: Array | None = None
    covariates: Mapping[str, Array] = field(default_factory=dict)
    extra: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()
    labels: Mapping[str, TextArray] = field(default_factory=dict)
    simulated_position: Array | None = None
    simulated_orientation: Array | None = None
    base_known: bool = False
    tool_known: bool = False
    target: Array = field(default_factory=lambda: np.zeros(3))
    noise_position: float | None = None
    noise_orientation: float | None = None
    noise_of_rows: Array | None = None
    noise_of_kinds: Mapping[str, float] = field(default_factory=dict)
    targets: Targets | None = None
    payload_com: Array = field(default_factory=lambda: np.zeros(3))
    moves: str = "direct"
    reference_temperature: float = STANDARD_TEMPERATURE
    priors: Mapping[str, float] = field(default_factory=dict)
    gears: Mapping[str, float] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    warnings: tuple[str, ...] = ()
    missing: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    urdf: str = ""
    travelled: Mapping[str, Array] = field(default_factory=dict)
    turned: tuple[str, ...] = ()
    readings: Mapping[str, Array] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        file = f"<{self.name}>"
        for key, kind in _KINDS.items():
            self._set(key, given(file, key, getattr(self, key), kind))
        samples = len(self.q) if hasattr(self.q, "__len__") else 0
        if np.size(self.rows) == 0 and samples:
            self._set("rows", np.arange(2, samples + 2))
        for key, wide in _WIDE.items():
            if key == "q" or getattr(self, key) is not None:
                self._hold(key, (samples, wide or self.robot.n))
        for key in ("target", "payload_com"):
            self._hold(key, (3,))
        self._hold("rows", (samples,), np.int64)
        for key, kind in _BY_NAME.items():
            held = checked_mapping(file, key, getattr(self, key)).items()
            self._set(key, {name: checked_array(file, name, value, (samples,), kind) for name, value in held})
        self._weigh_rows(file, samples)
        for name, values in self.covariates.items():
            check_covariate(file, name, values)
        for key in ("orientation", "simulated_orientation"):
            if getattr(self, key) is not None:
                check_quaternions(file, key, getattr(self, key))
        check_joints(file, "gears", self.gears, self.robot.joint_names)

    def _set(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)

    def _hold(self, key: str, shape: tuple[int, ...], kind: Any = np.float64) -> None:
        self._set(key, checked_array(f"<{self.name}>", key, getattr(self, key), shape, kind))

    def _weigh_rows(self, file: str, samples: int) -> None:
        """Validate ``targets`` and ``noise_of_rows``, whose root mean square is the noise of all rows if not given."""
        if self.targets is not None and len(self.targets.points) != samples:
            raise CampaignError(file, "other rows than the commands", column="targets", expected=f"{samples} rows")
        if self.noise_of_rows is None:
            return
        self._hold("noise_of_rows", (samples,))
        own, problem = self.noise_of_rows, "no standard deviation"
        refuse(file, "noise_of_rows", own < SMALLEST, problem, "a number above 0", lambda row: f"{own[row]:.15g}")
        if self.noise_position is None and samples:
            place, turn = sigma_of_all(self.noise_of_rows, self.targets)
            self._set("noise_position", place)
            self._set("noise_orientation", turn or self.noise_orientation)

    def __repr__(self) -> str:
        """Summary in one line: name, samples, kind of measurement, numbers of joints and covariates."""
        what = f"of {self.measures}" if self.measured else "to predict"
        return (
            f"<Campaign {self.name!r}: {self.samples} samples {what}, {self.robot.n} joints, "
            f"{len(self.covariates)} covariate{'' if len(self.covariates) == 1 else 's'}>"
        )

    def _repr_html_(self) -> str:
        return description.html(self)

    def to_frame(self) -> pd.DataFrame:
        """Convert the table to a pandas data frame in the units of the file; :func:`campaign_from_table` reads it.

        Returns
        -------
        DataFrame
            The columns of the file that :func:`write_campaign` would write, filled gaps and derived directions
            included; the index ``row`` counts as a text editor does, ``attrs`` hold the units.

        Examples
        --------
        >>> import thermal_robot as tr
        >>> table = tr.demo_campaign().to_frame()
        >>> list(table.columns[:6]), len(table)
        (['joint_1', 'joint_2', 'joint_3', 'joint_4', 'joint_5', 'x'], 120)
        """
        import pandas as pd

        robot, units, several = self.robot, self.units, self.targets
        held: Mapping[str, Array] = dict(zip(robot.joint_names, self.q.T, strict=True))
        if several is not None:
            for number, points in zip(several.numbers, several.points.transpose(1, 2, 0), strict=True):
                held = {**held, **dict(zip(names.axes_of(number), points, strict=True))}
        for key, group in names.POSES.items():
            values = getattr(self, key)
            # several targets tell a pose, which was not measured
            if values is not None and (several is None or group not in (names.POSITION, names.ORIENTATION)):
                held = {**held, **dict(zip(group, values.T, strict=True))}
        columns = {name: values / scale_of(name, robot, units) for name, values in held.items()}
        length = units.length_scale
        columns |= {name: values / names.reading_scale(name, length) for name, values in self.readings.items()}
        held = self.covariates if self.noise_of_rows is None else {names.NOISE: self.noise_of_rows, **self.covariates}
        columns |= {name: values / scale_of(name, robot, units) for name, values in held.items()}
        labels = {name: labels.astype(object) for name, labels in self.labels.items()}
        shown = pd.DataFrame({**columns, **labels}, index=pd.Index(self.rows, name="row"))
        shown.attrs = {"angle_unit": self.units.angle, "length_unit": self.units.length}
        return shown

    @property
    def samples(self) -> int:
        """Number of rows N."""
        return len(self.q)

    @property
    def measures(self) -> str:
        """Kind of measurement of all rows (``"position"``, ``"pose"`` …); ``"mixed"`` where there are several."""
        return self.kinds[0] if len(self.kinds) == 1 else "mixed"

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of measurement of the rows, sorted; see :mod:`thermal_robot.observables`."""
        if "kind" in self.labels:
            return tuple(np.unique(self.labels["kind"]).tolist())
        return ("position",) if self.orientation is None else ("pose",)

    @cached_property
    def numbered(self) -> Mapping[str, tuple[tuple[str, ...], NDArray[np.int64]]]:
        """Labels of other kinds of measurement (``"stand"``, ``"plane"`` …) as categories, by label.

        Each is its distinct values, sorted, and the number (N,) of each row's value among them.
        """
        found = {}
        for name in (name for name in names.OF_KINDS if name in self.labels):
            values, number = np.unique(self.labels[name], return_inverse=True)
            found[name] = tuple(values.tolist()), number.ravel()
        return found

    @property
    def measured(self) -> bool:
        """Whether the rows hold measurements, of positions or of another kind; false for rows to be predicted."""
        return self.position is not None or "kind" in self.labels

    @cached_property
    def reach(self) -> float:
        """Diagonal of the bounding box of measured positions, or without any of nominal tool positions and root, m.

        In sockets of one stand the tool hardly moves, however the arm does.
        """
        if self.position is not None:
            return float(np.linalg.norm(np.ptp(self.position, axis=0)))
        led = np.vstack([tool_poses(self.robot, self.q)[:, :3, 3], np.zeros(3)])
        return float(np.linalg.norm(np.ptp(led, axis=0)))

    @cached_property
    def relative_noise(self) -> Array | None:
        """Standard deviations (N, m) of the m figures of each row over those of all rows; ``None`` where all are 1."""
        turned = "pose" in self.kinds or "controller" in self.kinds
        sigmas, whole = self.noise_of_rows, self.noise_position
        if self.noise_of_kinds:
            sigmas, whole = np.array([self.noise_of_kinds.get(kind, 1.0) for kind in self.labels["kind"]]), 1.0
        return relative_sigmas(sigmas, whole, self.targets, turned)

    @property
    def clock(self) -> Array | None:
        """Clock (N,): ``time`` in s, or ``order`` where there is no time; ``None`` without either."""
        return clock_of(self.covariates)

    @cached_property
    def pose_labels(self) -> TextArray | None:
        """Label (N,) of the commanded pose that each row repeats, ``""`` for none; ``None`` without a column of them.

        Labels of poses count within their path: point 3 of one path is not that of another.
        """
        pose, path = self.labels.get("pose"), self.labels.get("path")
        if pose is None or path is None:
            return pose
        of_path = np.char.add(np.char.add(path, " / "), pose)
        return _read_only(np.where((pose != "") & (path != ""), of_path, pose))

    @cached_property
    def since_turn(self) -> Mapping[str, Array]:
        """Signed distance (N,) of each joint since its last reversal, rad or m, by name; empty if rows have no order.

        It follows from the order of all rows of the whole campaign; a subset keeps these values. Strains of stop
        operators are included, see :func:`~thermal_robot.campaign.turning.since_turns`.
        """
        if self.travelled and self.clock is not None:
            return self.travelled
        return since_turns(self.q, self.robot.joint_names, self.covariates, self.labels.get("session"))

    @property
    def settings(self) -> Settings:
        """Settings of the campaign: all that its table does not hold; root frame and gravity are the robot's."""
        own: dict[str, Any] = {each.name: getattr(self, each.name, None) for each in fields(Settings)}
        own |= {key: as_vector(own[key]) for key in ("target", "payload_com")}
        own |= {key: getattr(self.robot, key) for key in ("tool_frame", "root_frame")}
        return Settings(**{**own, "kind": "", "gravity": as_vector(self.robot.gravity)})

    def take(self, rows: ArrayLike) -> Campaign:
        """Return the campaign of some rows only; plausibility checks are not repeated.

        Parameters
        ----------
        rows
            (N,) booleans, or indices in any order, repeats allowed.

        Examples
        --------
        >>> campaign = tr.demo_campaign()
        >>> warm = campaign.take(campaign.covariates["temperature"] > 25.0)
        >>> 0 < warm.samples < campaign.samples
        True
        """
        index = np.asarray(rows)
        if index.size == 0:
            index = index.astype(np.int64)
        whole = index.dtype.kind in "iu" and np.all((index >= -self.samples) & (index < self.samples))
        if index.ndim != 1 or not (whole or (index.dtype == bool and len(index) == self.samples)):
            expected = f"row numbers from 0 to {self.samples - 1}, or {self.samples} booleans"
            raise CampaignError(f"<{self.name}>", "has no such rows", found=repr(rows), expected=expected)
        changes: dict[str, Any] = {}
        for key in _PER_SAMPLE:
            value = getattr(self, key)
            if value is not None:
                changes[key] = _read_only(value[index])
        for key in _BY_NAME:
            held = self.since_turn if key == "travelled" else getattr(self, key)
            changes[key] = {name: _read_only(value[index]) for name, value in held.items()}
        if self.targets is not None:
            changes["targets"] = self.targets.take(index)
        return replace(self, **changes)

    def drop_covariate(self, name: str) -> Campaign:
        """Return a copy of the campaign without one covariate or label column.

        Raises
        ------
        CampaignError
            The campaign has no such column.

        Examples
        --------
        >>> "payload" in tr.demo_campaign().drop_covariate("payload").covariates
        False
        """
        if name not in self.covariates and name not in self.labels:
            present = ", ".join([*self.covariates, *self.labels]) or "none"
            raise CampaignError(f"<{self.name}>", "no such covariate", column=name, expected=f"one of {present}")
        changes: dict[str, Any] = {
            key: {other: value for other, value in getattr(self, key).items() if other != name} for key in _BY_NAME
        }
        for key in ("extra", "derived"):
            changes[key] = tuple(other for other in getattr(self, key) if other != name)
        return replace(self, **changes)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only in place, so that the constructor of a campaign need not copy it."""
    array.flags.writeable = False
    return array


def describe(campaign: Campaign) -> str:
    """Describe a campaign to the person who measured it, in the units of the file.

    Returns
    -------
    str
        Plain text of several lines: robot, what was measured, frames, noise, joints against their limits,
        covariates with their ranges and gaps, repeats, sessions, warnings.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> print(tr.describe(tr.demo_campaign()))
    Campaign demo
      robot   rv_m2, chain from base_link to tool0, 5 movable joints
    ...
    """
    require("describe()", campaign, (Campaign,), "a campaign")
    return description.text(campaign)


GRAVITY = "gravity"  # The quantity that no column holds: the robot has it


def turned_round(campaign: Campaign, quantity: str) -> Campaign:
    """Return a copy of a campaign with the sign of one quantity reversed, which ``turned`` records.

    ``torque`` or ``approach`` stands for its columns of all joints; temperatures are mirrored about
    ``reference_temperature``; ``gravity`` is the robot's vector.
    """
    if quantity == GRAVITY:
        robot = campaign.robot
        up = load_robot(robot.urdf, robot.tool_frame, root_frame=robot.root_frame, gravity=-robot.gravity)
        return replace(campaign, robot=up)
    about = 2.0 * campaign.reference_temperature if quantity == "temperature" else 0.0
    own = {name: about - values for name, values in campaign.covariates.items() if name.split(".")[0] == quantity}
    names = {*campaign.turned} ^ {quantity}
    return replace(campaign, covariates={**campaign.covariates, **own}, turned=tuple(sorted(names)))


def read_alike(campaign: Campaign, robot: Robot, turned: Iterable[str]) -> Campaign:
    """Reverse signs so that exactly the quantities ``turned`` are reversed; take ``robot`` if its gravity differs."""
    for quantity in {*campaign.turned} ^ {*turned}:
        campaign = turned_round(campaign, quantity)
    return campaign if (campaign.robot.gravity == robot.gravity).all() else replace(campaign, robot=robot)


def appended(campaigns: Sequence[Campaign]) -> Campaign:
    """Concatenate campaigns of one robot and the same joints, with the declarations of the first.

    Covariates and labels that not all have are left out. Each row keeps its number, its direction of approach, and the
    distances of its joints since their last reversals: the motion between two campaigns is unknown.

    Raises
    ------
    CampaignError
        If one has columns of measurements that another has not, or several targets of each pose, whose places on the
        tool are found from all rows together.
    """
    first = campaigns[0]
    if len(campaigns) == 1:
        return first
    changes: dict[str, Any] = {}
    for key in _PER_SAMPLE:
        values = [getattr(one, key) for one in campaigns]
        held = [value is not None for value in values]
        if any(held) and not all(held):
            expected = f"the same columns as in {first.name}"
            raise CampaignError(campaigns[held.index(not held[0])].name, f"differs in {key}", expected=expected)
        if held[0]:
            changes[key] = np.concatenate(values)
    if any(one.targets is not None for one in campaigns):
        raise CampaignError(first.name, "has several targets of each pose: rows of another file cannot be put to them")
    for key in ("covariates", "labels", "readings", "since_turn"):
        by_name = [getattr(one, key) for one in campaigns]
        common = [name for name in by_name[0] if all(name in other for other in by_name)]
        changes[key] = {name: np.concatenate([own[name] for own in by_name]) for name in common}
    changes["travelled"] = changes.pop("since_turn")
    known = changes["covariates"]
    filled = dict.fromkeys(name for one in campaigns for name in one.missing if name in known)
    changes["missing"] = {
        name: np.concatenate([one.missing.get(name, np.zeros(one.samples, dtype=bool)) for one in campaigns])
        for name in filled
    }
    changes |= {key: tuple(name for name in getattr(first, key) if name in known) for key in ("extra", "derived")}
    return replace(first, **changes)
