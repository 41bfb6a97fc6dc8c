"""Causes of any period, with a memory, of a new zero now and then, or that nobody records. Frozen as the others are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality import gears
from thermal_robot.blind.reality.fault import Fault, joints, milli, one, part
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]

SLOW = (1.0, 2.5)
"""Orders a turn: of what comes round hardly more often than the joint, but no whole number of times."""
ELEMENTS = 4
_SLIPS = (0.05, 0.6)  # of a joint's range: how far it goes before an element slips
_LASTS = (0.5, 3.0)  # rows: how long what nobody records stays as it is
_SEEDS = 2**31
_SESSIONS = 3  # at most


def _seed(setting: Setting, j: int, rng: np.random.Generator) -> float:
    return float(rng.integers(_SEEDS))


def _winding(body: Body, setting: Setting, values: Array) -> None:
    """Friction elements in series with springs (Jenkin), side by side: each follows the joint until it slips.

    What they hold depends on where the joint turned round, and not only on its last direction.
    """
    for j in np.flatnonzero(values[:, 0]):
        slips, weights = values[j, 1 : 1 + ELEMENTS] * np.ptp(setting.q[:, j]), values[j, 1 + ELEMENTS :]
        body.joints[:, j] -= values[j, 0] * slipped(setting.q[:, j], setting.before, slips) @ (weights / weights.sum())


def slipped(q: Array, before: NDArray[np.int64], slips: Array) -> Array:
    """(N, E) how far each element is strained, as a share of what makes it slip; 0 at the start.

    Parameters
    ----------
    q
        (N,) where the joint stands.
    before
        (N,) the row that it came from, the first one's own.
    slips
        (E,) how far it goes before an element slips.
    """
    strained = np.zeros((len(q), len(slips)))
    for row, last in enumerate(before):
        if last != row:
            strained[row] = np.clip(strained[last] + q[row] - q[last], -slips, slips)
    return np.asarray(strained / slips)


def _rehomed(body: Body, setting: Setting, values: Array) -> None:
    """A joint that finds another zero at each switching on."""
    assert setting.session is not None  # the fault asks for sessions
    body.joints += values[:, setting.session].T


def _zero(setting: Setting, j: int, rng: np.random.Generator) -> float:
    return float(1e-3 * rng.normal())


def _coolant(body: Body, setting: Setting, values: Array) -> None:
    """A joint whose coolant comes and goes: what it follows is in no column."""
    for j in np.flatnonzero(values[:, 0]):
        body.joints[:, j] += values[j, 0] * wandered(setting, values[j, 1], values[j, 2])


def _crane(body: Body, setting: Setting, values: Array) -> None:
    """A hall that tilts the base as its crane passes: nobody wrote down when."""
    body.move("base", wandered(setting, values[0, 6], values[0, 7])[:, None] * values[0, :6])


def wandered(setting: Setting, lasts: float, seed: float) -> Array:
    """(N,) of size 1: a state that forgets itself within some rows' time, so that no law of time holds it."""
    chance = np.random.default_rng(int(seed)).normal(size=setting.samples)
    row = setting.time[-1] / max(int(setting.given.sum()), 1)
    kept = np.exp(-np.diff(setting.time) / (lasts * row))
    state = np.empty(setting.samples)
    state[0] = chance[0]
    for k, share in enumerate(kept):
        state[k + 1] = share * state[k] + np.sqrt(1.0 - share**2) * chance[k + 1]
    return state


def _draw_crane(setting: Setting, rng: np.random.Generator) -> Array:
    twist = 1e-4 * np.append(rng.normal(size=5), 0.0)
    return np.append(twist, [rng.uniform(*_LASTS), rng.integers(_SEEDS)])[None]


def _nothing(setting: Setting, places: object) -> tuple[str, ...]:
    """Nothing that was recorded: that is the right answer."""
    return ("none",)


ELUSIVE = (
    gears.waves("slow_wave", SLOW),
    Fault(
        "winding",
        one(milli, *[part(*_SLIPS)] * ELEMENTS, *[part(0.3, 1.0)] * ELEMENTS),
        _winding,
        joints,
        few=True,
        quantities=lambda s, places: [q for _, joint in places for q in (f"since_turn.{joint}", joint)],
        fixed=tuple((column, (1.0,)) for column in range(1, 1 + 2 * ELEMENTS)),
    ),
    Fault(
        "rehomed",
        one(*[_zero] * _SESSIONS),
        _rehomed,
        joints,
        few=True,
        wants=("sessions",),
        quantities=lambda s, places: ["session", "time", "order"],
    ),
    Fault(
        "coolant",
        one(milli, part(*_LASTS), _seed),
        _coolant,
        joints,
        few=True,
        quantities=_nothing,
        fixed=((1, (1.0,)), (2, (0.0,))),
    ),
    Fault(
        "crane",
        _draw_crane,
        _crane,
        lambda s: [("base", "base")],
        quantities=_nothing,
        fixed=((6, (1.0,)), (7, (0.0,))),
    ),
)
"""Free periods, memory, new zeros, and what nobody records."""
