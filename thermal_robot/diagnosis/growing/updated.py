"""What is known of a robot once new rows have joined those of its diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from threadpoolctl import threadpool_limits

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis.growing.choice import together
from thermal_robot.diagnosis.growing.stream import Stream, expected_sizes, received
from thermal_robot.diagnosis.growing.sums import frame_names
from thermal_robot.diagnosis.growing.watched import Agreement
from thermal_robot.diagnosis.settings import LOOSE
from thermal_robot.diagnosis.values import Unexplained
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import identified
from thermal_robot.prediction import Spread, moves

if TYPE_CHECKING:
    import pandas as pd


class Diagnosed(Protocol):
    """What of a :class:`~thermal_robot.Diagnosis` rows are added to."""

    @property
    def campaign(self) -> str: ...  # noqa: D102
    @property
    def usable(self) -> bool: ...  # noqa: D102
    @property
    def reason(self) -> str: ...  # noqa: D102
    @property
    def model(self) -> CorrectedModel: ...  # noqa: D102
    @property
    def fit(self) -> Fit | None: ...  # noqa: D102
    @property
    def unexplained(self) -> Unexplained: ...  # noqa: D102
    @property
    def remaining(self) -> Unexplained | None: ...  # noqa: D102


_BEGUN: WeakKeyDictionary[Diagnosed, Stream] = WeakKeyDictionary()


def ready(found: Diagnosed, fit: Fit) -> Stream:
    """Return what the updates of a diagnosis begin with; its rows are passed over once."""
    if found not in _BEGUN:
        _BEGUN[found] = Stream.of(fit)
    return _BEGUN[found]


@dataclass(frozen=True, eq=False, repr=False)
class Updated:
    """A diagnosis whose effects stand, with new rows: its parameters, noise and model by all rows.

    Attributes
    ----------
    diagnosis
        Where it began; its effects are held.
    samples
        Rows so far, those of the diagnosis included.
    choice_stands
        Whether nothing speaks against the effects, settings and places that the diagnosis chose. What new rows said
        against it stays; that other effects explain all rows better may change with more rows.
    reason
        Why the choice is to be made anew, in plain words; empty while it stands.
    noise, noise_orientation
        One sigma per axis of what remains beside the effects, m and rad; the second ``None`` without orientations.
    rms_after, rms_after_orientation
        Root mean square of the remainder, m and rad, over the rows that are not set aside.
    outliers
        Row numbers of the last new rows that are set aside, as their table counts them.
    model
        The corrected model by all rows.
    agreement
        How well the last new rows agreed with the model that did not know them.
    anew
        Whether all old rows were looked at again, since the parameters had moved too far for the sums of old rows.

    Examples
    --------
    >>> import numpy as np
    >>> import thermal_robot as tr
    >>> campaign, new = tr.demo_campaign(), np.arange(120) % 6 == 0
    >>> found = tr.diagnose(campaign.take(~new))
    >>> updated = found.update(campaign.take(new))
    >>> updated.samples, updated.choice_stands, updated.reason
    (120, True, '')
    >>> updated.parameters.shape == found.parameters.shape
    True
    """

    diagnosis: Diagnosed
    samples: int
    choice_stands: bool
    reason: str
    noise: float
    noise_orientation: float | None
    rms_after: float
    rms_after_orientation: float | None
    outliers: tuple[int, ...]
    model: CorrectedModel
    agreement: Agreement
    anew: bool
    stream: Stream
    wider: Array

    def update(self, rows: Campaign | pd.DataFrame) -> Updated:
        """Add more rows; see :meth:`Diagnosis.update <thermal_robot.Diagnosis.update>`."""
        new = received(self.stream.fit.campaign, rows, self.model.needs)
        with threadpool_limits(1):
            stream = self.stream.plus(new, self.model.spread)
        return _told(self.diagnosis, stream, self.wider, _reaching(self.model, new), new)

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of the effects that are held, as the model has them, SI.

        Index (effect, parameter); columns ``value``, ``std`` (one sigma), ``unit`` and ``identified``. Where the
        diagnosis widened deviations for what it could not explain, they are wider by the same factor.
        """
        import pandas as pd

        blocks, fitted = self.stream.grown.choice.blocks, self.stream.grown.fitted
        listed = [(item.effect.name, p) for item in blocks for p in item.bare]
        index = pd.MultiIndex.from_tuples([(name, p.name) for name, p in listed], names=("effect", "parameter"))
        spread = _deviations(self.stream)
        return pd.DataFrame(
            {
                "value": fitted.point.values,
                "std": spread * self.wider,
                "unit": [p.unit for _, p in listed],
                "identified": np.asarray(identified(spread * self.wider, expected_sizes(self.stream)), dtype=bool),
            },
            index=index,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, SI, ready for JSON: schema ``thermal-robot/updated/1``."""
        table = self.parameters
        return {
            "schema": "thermal-robot/updated/1",
            "campaign": self.diagnosis.campaign,
            "samples": self.samples,
            "choice_stands": self.choice_stands,
            "reason": self.reason,
            "noise": self.noise,
            "noise_orientation": self.noise_orientation,
            "rms_after": self.rms_after,
            "rms_after_orientation": self.rms_after_orientation,
            "outliers": list(self.outliers),
            "parameters": [
                {"effect": name[0], "name": name[1], "value": value, "std": std, "unit": unit, "identified": known}
                for name, value, std, unit, known in zip(*_columns(table), strict=True)
            ],
        }

    def __repr__(self) -> str:
        names = ", ".join(effect.name for effect, _ in self.model.effects) or "no effect"
        state = "the choice stands" if self.choice_stands else "to be diagnosed anew"
        return f"Updated({self.diagnosis.campaign!r}: {names}; {self.samples} rows; {state})"

    def __str__(self) -> str:
        return "\n\n".join([repr(self), *([self.reason] if self.reason else []), str(self.parameters)])


def update(found: Diagnosed, rows: Campaign | pd.DataFrame) -> Updated:
    """Add rows to a diagnosis; see :meth:`Diagnosis.update <thermal_robot.Diagnosis.update>`.

    Raises :class:`EstimationError` if it says nothing of the robot, or was made without its fit.
    """
    if not found.usable:
        raise EstimationError(f"{found.campaign}: nothing is known of the robot that rows could add to. {found.reason}")
    if found.fit is None:
        raise EstimationError(f"{found.campaign}: this diagnosis was made without its fit; diagnose the rows")
    new = received(found.fit.campaign, rows, found.model.needs)
    with threadpool_limits(1):  # as in a diagnosis: matrices are small
        begun = ready(found, found.fit)
        stream = begun.plus(new, found.model.spread)
    return _told(found, stream, _widened(found, begun), _reaching(found.model, new), new)


def _told(found: Diagnosed, stream: Stream, wider: Array, model: CorrectedModel, new: Campaign) -> Updated:
    fitted, choice = stream.grown.fitted, stream.grown.choice
    rms = np.sqrt(fitted.squares / max(fitted.count, 1))
    turned = choice.measures == 6
    fresh = replace(
        model,
        frames=fitted.point.frames,
        effects=tuple(choice.split(fitted.point.values)),
        spread=None if model.spread is None else _spread(stream, model.spread),
    )
    return Updated(
        diagnosis=found,
        samples=sum(one.campaign.samples for one in stream.grown.batches),
        choice_stands=not stream.reasons,
        reason=" ".join(stream.reasons),
        noise=float(fitted.noise[0]),
        noise_orientation=float(fitted.noise[3]) if turned else None,
        rms_after=float(rms[0]),
        rms_after_orientation=float(rms[1]) if turned else None,
        outliers=tuple(new.rows[stream.grown.aside].tolist()),
        model=fresh,
        agreement=stream.agreement,
        anew=stream.grown.anew,
        stream=stream,
        wider=wider,
    )


def _columns(table: pd.DataFrame) -> list[list[Any]]:
    return [table.index.tolist(), *(table[name].tolist() for name in ("value", "std", "unit", "identified"))]


def _deviations(stream: Stream) -> Array:
    """(P,) one sigma of every parameter, SI."""
    values = stream.grown.fitted.values
    return together([np.sqrt(np.maximum(np.diag(values[k][1]), 0.0)) for k in sorted(values)])


def _widened(found: Diagnosed, begun: Stream) -> Array:
    """(P,) by how much the diagnosis widened each deviation for what it could not explain."""
    own, left = _deviations(begun), found.unexplained if found.remaining is None else found.remaining
    if not left.flagged or found.fit is None:
        return np.ones_like(own)
    e = found.fit.explanation
    told = together([np.sqrt(np.maximum(np.diag(e.values[b][1]), 0.0)) for b in e.best.blocks])
    return np.maximum(told / np.maximum(own, chosen.TINY), 1.0)


def _reaching(model: CorrectedModel, new: Campaign) -> CorrectedModel:
    """Return the model with the ranges in which the new rows were measured, too."""
    if model.spread is None or not new.samples:
        return model
    joints, ranges = new.robot.joint_names, dict(model.spread.ranges)
    for name, (low, high) in ranges.items():
        values = new.q[:, joints.index(name)] if name in joints else new.covariates.get(name)
        if values is not None:
            ranges[name] = (min(low, float(values.min())), max(high, float(values.max())))
    return replace(model, spread=replace(model.spread, ranges=ranges))


def _spread(stream: Stream, known: Spread) -> Spread:
    """Return how far predictions may be off, with the covariance by all rows; what no effect tells is as diagnosed."""
    fitted, choice = stream.grown.fitted, stream.grown.choice
    names = frame_names(stream.fit.campaign)
    expected = expected_sizes(stream)
    tight = np.concatenate([np.full(len(names), LOOSE**-2.0), np.maximum(expected, chosen.TINY) ** -2.0])
    precision = fitted.products[:-1, :-1] / fitted.best.noise**2
    unit = (precision.diagonal() + tight) ** -0.5
    inner = np.linalg.inv(precision * np.outer(unit, unit) + np.diag(tight * unit**2))
    moving = np.concatenate([moves(names), np.ones(choice.count, dtype=bool)])
    covariance = (np.outer(unit, unit) * (inner + inner.T) / 2.0)[np.ix_(moving, moving)]
    return replace(known, covariance=covariance, prior=expected)
