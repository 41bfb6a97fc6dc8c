"""Places × quantities: which law, entering where, a remainder speaks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, quantities, unit
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.explain import robust_noise
from thermal_robot.observations import Observations

Array = NDArray[np.float64]

_REFINED = ("slide", "hinge", "bump")
CLOCK = ("time", "order")


@dataclass(frozen=True, eq=False)
class Scanned:
    """One candidate: the law, and what log evidence it gains over noise by the Bayes information criterion."""

    law: Discovered
    gain: float


def laws(observations: Observations, kinds: Sequence[str], names: Iterable[str] | None = None) -> list[Discovered]:
    """Return a smooth law of every quantity at every place of some kinds; at a segment also a constant one.

    Parameters
    ----------
    observations
        Where quantities are read from.
    kinds
        ``joint``, ``base``, ``tool``, ``link``.
    names
        Of the quantities; all where absent.
    """
    turns = observations.campaign.measures == "pose"
    robot = observations.robot
    places = {
        "joint": robot.joint_names,
        "base": ("base",),
        "tool": ("tool",),
        # before the first joint a segment is the base, behind the last one the tool
        "link": tuple(s.name for s in robot.segments[1:] if s.movable),
    }
    known = quantities(observations)
    found = []
    for kind in kinds:
        for place in places[kind]:
            plain = Discovered(kind=kind, place=place, turns=turns)
            if kind == "link":
                found.append(replace(plain, shape="constant", quantity="none"))
            for name in known if names is None else names:
                law = replace(plain, quantity=name, unit=unit(robot, name), labels=_labels(observations, name))
                law = of_quantity(law, known[name])
                found.append(law)
                if kind == "joint" and name == place and law.shape == "smooth":
                    # five knots do not follow a wheel that turns more than once
                    found += [replace(law, shape="harmonic", marks=(k,)) for k in harmonics(observations, place)]
    return found


def harmonics(observations: Observations, joint: str) -> tuple[float, ...]:
    """Return the orders that are looked for in a joint: a few a turn, and the motor's where its ratio is stated."""
    ratio = observations.campaign.gears.get(joint)
    return settings.HARMONICS if ratio is None else (*settings.HARMONICS, float(ratio), 2.0 * float(ratio))


def _labels(observations: Observations, name: str) -> tuple[str, ...]:
    own = observations.campaign.labels.get(name)
    recorded = own is not None and name not in observations.covariates
    return tuple(np.unique(own).tolist()) if own is not None and recorded else ()


def of_quantity(law: Discovered, values: Array, knots: int = settings.KNOTS) -> Discovered:
    """Return the law with knots at the quantity's quantiles, or with its levels where it has few values."""
    levels = np.unique(values)
    low, high = float(values.min()), float(values.max())
    if len(levels) <= settings.FEW_LEVELS:
        return replace(law, shape="levels", marks=tuple(levels.tolist()), origin=low, span=high - low)
    marks = np.quantile(values, np.linspace(settings.OUTER_KNOTS, 1.0 - settings.OUTER_KNOTS, knots))
    if np.diff(marks).min() < settings.NARROW_KNOTS * (high - low) / knots:
        # most values lie in one spot: a spline between knots there would be free to do anything
        marks = np.linspace(low, high, knots)
    return replace(law, shape="smooth", marks=tuple(marks.tolist()), origin=low, span=high - low)


@dataclass(eq=False)
class Target:
    """A remainder to be explained: what is left of the gap after everything in ``design``.

    Attributes
    ----------
    white
        (N·m,) remainder, weighted and over the noise.
    root
        (N, m) what columns are multiplied with.
    basis
        (N·m, r) orthonormal: the design.
    """

    white: Array
    root: Array
    basis: Array

    @classmethod
    def of(cls, gap: Array, design: Array, trusted: NDArray[np.bool_] | None = None) -> Target:
        """Project a design (N, m, K) out of a gap (N, m), robustly: rows far from the rest weigh little (Cauchy).

        ``trusted`` (N,) rows weigh fully in what is left, however far they are.
        """
        measures = gap.shape[1]
        noise = np.repeat(robust_noise(gap), 3)
        weight = np.ones(len(gap))
        for _ in range(settings.CAUCHY_ROUNDS):
            root = np.sqrt(weight)[:, None] / noise
            flat = (design * root[:, :, None]).reshape(root.size, design.shape[2])
            basis = _basis(flat)
            white = (gap * root).ravel()
            white = white - basis @ (basis.T @ white)
            left = white.reshape(gap.shape) / root
            noise = np.repeat(robust_noise(left), 3)
            weight = 1.0 / (1.0 + ((left / noise) ** 2).sum(axis=1) / (3.0 * measures))
        if trusted is not None and trusted.any():
            root = np.where(trusted[:, None], 1.0 / noise, root)
            basis = _basis((design * root[:, :, None]).reshape(root.size, design.shape[2]))
            white = (gap * root).ravel()
            white = white - basis @ (basis.T @ white)
        return cls(white, root, basis)

    def gain(self, columns: Array) -> float:
        """Return the gain in log evidence of (N, m, K) further columns: ½ ν ln(S₀/S₁) − ½ k ln ν."""
        flat = (columns * self.root[:, :, None]).reshape(len(self.white), -1)
        flat = flat - self.basis @ (self.basis.T @ flat)
        flat = flat / (np.linalg.norm(flat, axis=0) + settings.TINY)
        value, vector = np.linalg.eigh(flat.T @ flat)
        seen = value > settings.LAW_FLOOR * max(value.max(initial=0.0), settings.TINY)
        k, freedom = int(seen.sum()), len(self.white) - self.basis.shape[1]
        if not k or freedom - k < settings.FEWEST_LEFT:
            return -np.inf
        projected = (vector[:, seen].T @ (flat.T @ self.white)) / np.sqrt(value[seen])
        total, explained = float(self.white @ self.white), float(projected @ projected)
        rest = max(total - explained, settings.TINY)
        return float(0.5 * freedom * np.log(total / rest) - 0.5 * k * np.log(freedom))


def _basis(flat: Array) -> Array:
    flat = flat / (np.linalg.norm(flat, axis=0) + settings.TINY)
    value, vector = np.linalg.eigh(flat.T @ flat) if flat.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    return np.linalg.qr(flat @ vector[:, value > settings.DESIGN_FLOOR * value.max(initial=1.0)])[0]


def scan(observations: Observations, targets: Sequence[Target]) -> tuple[list[list[Scanned]], int]:
    """Return, for every target, all candidates, best first; and how many were tried.

    Segments have six components, so that only the quantities that speak elsewhere are tried there.
    """
    found: list[list[Scanned]] = [[] for _ in targets]
    first = laws(observations, ("joint", "base", "tool"))
    _measure(observations, first, targets, found)
    telling: dict[str, float] = {}
    for own in found:
        for item in own:
            telling[item.law.quantity] = max(telling.get(item.law.quantity, -np.inf), item.gain)
    names = sorted(telling, key=lambda name: -telling[name])[: settings.LINK_QUANTITIES]
    second = laws(observations, ("link",), names)
    _measure(observations, second, targets, found)
    for own in found:
        own.sort(key=lambda item: -item.gain)
    return found, len(first) + len(second)


def shapes(
    law: Discovered, values: Array, jumps: bool = True, orders: Sequence[float] = settings.HARMONICS
) -> list[Discovered]:
    """Return simple shapes that might do instead of a smooth law, and that law.

    Hinges at the quantity's quantiles, straight and quadratic laws; steps and bumps of what a robot does or what passes
    (positions, gravity, the clock), as nothing jumps at a temperature; three harmonics of a joint's position.
    """
    if law.shape in ("constant", "levels"):
        return [law, replace(law, shape="ramp", marks=())] if law.shape == "levels" and len(law.marks) > 2 else [law]
    found = [law, replace(law, shape="ramp", marks=()), replace(law, shape="quadratic", marks=())]
    middle = np.quantile(values, np.linspace(settings.INNER_MARKS, 1.0 - settings.INNER_MARKS, settings.MARKS))
    if jumps:
        found += [replace(law, shape="step", marks=(float(m),)) for m in middle]
        found += [replace(law, shape="slide", marks=(float(m), settings.SLIDE_WIDTH * law.span)) for m in middle[::2]]
    found += [replace(law, shape="hinge", marks=(float(m), side)) for m in middle[2:-2:2] for side in (1.0, -1.0)]
    if jumps:
        found += [
            replace(law, shape="bump", marks=(float(m), w * law.span))
            for m in middle[1:-1:2]
            for w in settings.BUMP_WIDTHS
        ]
    if law.quantity.startswith("velocity."):
        found.append(replace(law, shape="drag", marks=()))
    if law.quantity == law.place and law.kind == "joint":
        found += [replace(law, shape="harmonic", marks=(k,)) for k in orders]
    return found


def shaped(observations: Observations, target: Target, law: Discovered) -> Scanned:
    """Return a law in the shape that gains most."""
    values = quantities(observations).get(law.quantity)
    jumps = law.quantity in (*CLOCK, *GRAVITY, *observations.robot.joint_names)
    orders = harmonics(observations, law.place) if law.kind == "joint" else settings.HARMONICS
    candidates = [law] if values is None else shapes(law, values, jumps, orders)

    def measured(candidate: Discovered) -> Scanned:
        return Scanned(candidate, target.gain(block(observations, candidate).columns))

    best = max(map(measured, candidates), key=lambda item: item.gain)
    return best if best.law.shape not in _REFINED else _refined(best, measured)


def _refined(best: Scanned, measured: Callable[[Discovered], Scanned]) -> Scanned:
    """Move marks and widths in ever smaller steps while that gains."""
    step, law = settings.MARK_STEP, best.law
    for _ in range(settings.MARK_ROUNDS):
        law, (mark, *width) = best.law, best.law.marks
        near = [replace(law, marks=(mark + s * step * law.span, *width)) for s in (1, -1)]
        if law.shape in ("slide", "bump"):
            near += [
                replace(law, marks=(mark, width[0] * f))
                for f in (1.0 + settings.WIDTH_STEP * step, 1.0 / (1.0 + settings.WIDTH_STEP * step))
            ]
        better = max(map(measured, near), key=lambda item: item.gain)
        if better.gain > best.gain:
            best = better
        else:
            step /= 2.0
    return best


def _measure(
    observations: Observations,
    candidates: Sequence[Discovered],
    targets: Sequence[Target],
    found: list[list[Scanned]],
) -> None:
    for law in candidates:
        columns = block(observations, law).columns
        for target, own in zip(targets, found, strict=True):
            own.append(Scanned(law, target.gain(columns)))
