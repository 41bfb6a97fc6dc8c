"""Rows of section 5: capability, its loss with temperature, and the clearance that makes up for it (Eqs 21–22)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability import UniformSpread, capability, failing_probability, required_clearance
from thermal_robot.paper import printed
from thermal_robot.paper.entry import ERRATUM, NOT_REPRODUCIBLE, Entry, floats, judge, numbers, rounds_to
from thermal_robot.paper.inputs import PaperInputs

Model = Literal["covariance", "uniform", "mean shift"]

_HALF = 0.5e-6
# m, half of the last digit of σ in Table 1 and of the displacements in Table 2.


@dataclass(frozen=True)
class Warmed:
    """What a thermal error does at the clearance where the process had the required capability.

    Parameters
    ----------
    clearance
        m, where the capability without temperature is the required one.
    capability
        There, with temperature.
    loss
        Share of the required capability that is lost.
    growth
        Share by which the clearance must grow to have it back.
    """

    clearance: float
    capability: float
    loss: float
    growth: float

    @property
    def compared(self) -> tuple[float, float, float]:
        """The three figures that the paper prints."""
        return self.capability, self.loss, self.growth


def capability_at(covariance: Array, clearance: float) -> float:
    """Return C_p by Eq 22 over the disc of diameter L and P = 2Φ(3 C_p) − 1."""
    return float(capability(failing=failing_probability(covariance, clearance)))


@lru_cache(maxsize=256)
def warmed(sigma: tuple[float, float], shift: tuple[float, float], required: float, model: Model) -> Warmed:
    """Compute the effect of a thermal error of ±shift along x and y, m.

    Parameters
    ----------
    sigma
        Standard deviations of the kinematic error along x and y, m.
    shift
        Bounds of the thermal error along x and y, m.
    required
        C_p.
    model
        ``"covariance"``: shift²/3 is added to the variances, the paper's Λη. ``"uniform"``: the axes are uniform and
        independent, not replaced by normal ones. ``"mean shift"``: the whole shift stands.
    """
    cold = np.diag(np.square(sigma))
    warm = cold + np.diag(np.square(shift)) / 3.0 if model == "covariance" else cold
    thermal = {"covariance": None, "uniform": UniformSpread.box(shift), "mean shift": np.array(shift)}[model]
    before = float(required_clearance(cold, capability=required))
    after = float(required_clearance(warm, capability=required, thermal=thermal))
    left = float(capability(failing=failing_probability(warm, before, thermal=thermal)))
    return Warmed(before, left, 1.0 - left / required, after / before - 1.0)


def capability_row(row: int, inputs: PaperInputs) -> Entry:
    """Compute C_p at the clearance of section 5."""
    at, low, high = _capabilities(row, inputs)
    return Entry(
        f"C_p at L = 0.145 mm, row {row + 1}",
        "section 5, Eq 22",
        printed.CAPABILITY[row].text,
        f"{at:.2f} ({low:.2f}–{high:.2f} over σ's rounding)",
        floats(at, low, high),
        judge(printed.CAPABILITY[row], at, low=low, high=high, otherwise=NOT_REPRODUCIBLE),
        f"At L = {_length(inputs.clearance)}, experimental σ without correlation, P over the disc of diameter L, P = "
        "2Φ(3 C_p) − 1: the paper does not print its convention, this one gives both rows.",
    )


def lower_in_row_2(inputs: PaperInputs) -> Entry:
    """Compute by how much the capability of row 2 is lower than that of row 1, at one clearance."""
    first, second = _capabilities(0, inputs), _capabilities(1, inputs)
    low, high = 1.0 - second[2] / first[1], 1.0 - second[1] / first[2]
    at = 1.0 - second[0] / first[0]
    return Entry(
        "C_p of row 2 below that of row 1",
        "section 5",
        printed.LOWER.text,
        f"{_percent(at)} ({_percent(low)}–{_percent(high)} over σ's rounding)",
        floats(at, low, high),
        judge(printed.LOWER, at, low=low, high=high, otherwise=NOT_REPRODUCIBLE),
        f"At L = {_length(inputs.clearance)}. The figure is (1.33 − 1.00)/1.33, from capabilities that σ in whole µm "
        "determines to ±3 %: its four digits are two at most.",
    )


def warmed_row(row: int, inputs: PaperInputs) -> Entry:
    """Compute C_p, loss and clearance with a thermal error of ± the measured shift."""
    sigma, shift = _plane(inputs.experimental_sigma[row]), _plane(inputs.sample_means[row])
    by, uniform, moved = (warmed(sigma, shift, inputs.capability, m) for m in ("covariance", "uniform", "mean shift"))
    figures = printed.WARMED[row]
    simple: tuple[Model, Model] = ("covariance", "mean shift")
    ranges = {m: _range(row, m, inputs) for m in simple}
    fits = {m: rounds_to(figures, *bounds) for m, bounds in ranges.items()}
    other = {m: rounds_to(printed.WARMED[1 - row], *_range(1 - row, m, inputs)) for m in ranges}
    low, high = ranges["covariance"]
    verdict = judge(figures, by.compared, low=low, high=high, otherwise=NOT_REPRODUCIBLE)
    as_shift = "reproduces" if fits["mean shift"] else "does not reproduce"
    neither = not any(fits[m] and other[m] for m in ranges)
    return Entry(
        f"C_p row {row + 1} with ±3 °C",
        "section 5, Fig 10",
        figures.text,
        f"{_said(by)} (covariance Λη); {_said(moved)} (mean shift); {_said(uniform)} (uniform, exact)",
        floats(by.clearance, by.compared, moved.compared, uniform.compared),
        verdict,
        f"C_p, loss, clearance, at L = {numbers(by.clearance, 3, factor=1e3)} mm where C_p = {inputs.capability:g}, "
        "with Table 2's measured shifts. Over the rounding of σ and shift Λη, the paper's wording, gives "
        f"{_percent(low[1])}–{_percent(high[1])} and +{_percent(low[2])}–{_percent(high[2])}; the full shift of the "
        f"mean {as_shift} the printed figures{'; neither gives both rows' if neither else ''}. The fact sheet calls "
        "the first model uniform: it is the normal law of the same variance; the uniform law itself loses less.",
    )


def loss_from_printed(which: int, inputs: PaperInputs) -> Entry:
    """Compute a printed loss from the printed capabilities: arithmetic alone."""
    before, after, loss = printed.LOSSES[which]
    start, end, half = before.values[0], after.values[0], 0.5 * np.max(after.digits)
    found, low, high = (1.0 - (end + change) / start for change in (0.0, half, -half))
    verdict = judge(loss, found, low=low, high=high, otherwise=ERRATUM)
    exact = rounds_to(loss, found)
    why = (
        "From the printed C_p."
        if exact
        else (
            f"With {after.text} exact it is a slip, as the fact sheet has it. But {after.text} is printed to one "
            f"decimal, and {loss.text} belongs to C_p = {start * (1.0 - loss.values[0]):.3f}, which rounds to it; "
            "compare the full shift of the mean in row 1 with ±3 °C."
        )
    )
    said = "" if exact else f" ({_percent(low)}–{_percent(high)} over the rounding of {after.text})"
    return Entry(
        f"({before.text} − {after.text})/{before.text}",
        "section 5",
        loss.text,
        f"{100 * found:.2f} %{said}",
        floats(found, low, high),
        verdict,
        why,
    )


def _capabilities(row: int, inputs: PaperInputs) -> tuple[float, float, float]:
    """C_p, and its least and largest value over the rounding of σ: it falls with either."""
    sigma = np.array(_plane(inputs.experimental_sigma[row]))
    at, high, low = (capability_at(np.diag((sigma + change) ** 2), inputs.clearance) for change in (0.0, -_HALF, _HALF))
    return at, low, high


def _range(row: int, model: Model, inputs: PaperInputs) -> tuple[Array, Array]:
    """Least and largest C_p, loss and growth over the corners of what the rounding of σ and shift leaves open."""
    middle = np.array([*_plane(inputs.experimental_sigma[row]), *_plane(inputs.sample_means[row])])
    found = []
    for change in product((-_HALF, _HALF), repeat=4):
        a, b, c, d = (float(v) for v in middle + np.array(change))
        found.append(warmed((a, b), (c, d), inputs.capability, model).compared)
    return np.min(found, axis=0), np.max(found, axis=0)


def _plane(vector: ArrayLike) -> tuple[float, float]:
    x, y = (float(v) for v in np.asarray(vector, dtype=float)[:2])
    return x, y


def _said(case: Warmed) -> str:
    return f"{case.capability:.2f}, {_percent(case.loss)}, +{_percent(case.growth)}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %".replace("-", "−")


def _length(clearance: float) -> str:
    return f"{1e3 * clearance:g} mm"


ROWS = (
    partial(capability_row, 0),
    partial(capability_row, 1),
    lower_in_row_2,
    partial(warmed_row, 0),
    partial(warmed_row, 1),
    partial(loss_from_printed, 0),
    partial(loss_from_printed, 1),
    partial(loss_from_printed, 2),
)
"""Functions of the inputs, in the paper's order."""
