"""Tell whether the residual is noise: tests with Bonferroni correction; where it enters and what it follows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc, ndtr, pdtr

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.parts import Dependence, Location, Unexplained
from thermal_robot.diagnosis.remainder import Remainder, Repeats, nearest, remainder, repeats
from thermal_robot.diagnosis.set_aside import alike, too_many
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import harmonics, smooth_columns
from thermal_robot.inference.rows import in_a_row, in_order
from thermal_robot.inference.target import Worth
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


@dataclass(frozen=True)
class Examined:
    """Whether the residual is noise.

    Attributes
    ----------
    unexplained
        The residual, with the place where it enters and the quantity that it follows.
    floor
        Noise floor: one sigma per axis of instrument and repeatability together, m.
    source
        Where the floor comes from: ``stated``, ``repeats``, ``scatter`` or ``remainder``.
    """

    unexplained: Unexplained
    floor: float
    source: str


def examine(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Examined:
    """Test whether the residual is noise.

    The tests are its size against the stated noise, lack of fit against repeats, correlation of neighbours, smooth laws
    of recorded quantities, and whether the rows set aside are too many, follow each other, or have something in common.
    Only the first asks for more than the stated noise by a margin. Rows set aside count in the unexplained rms where
    they are no gross errors.
    """
    e, left = fit.explanation, remainder(fit)
    stated, again = fit.campaign.noise_position, repeats(fit, left)
    rms = float(
        np.sqrt(
            3.0 * (left.white[:, :3] ** 2).sum() * e.whitening.noise[0] ** 2 / (left.freedom * 3 / left.white.shape[1])
        )
    )
    if stated is not None:
        floor, source = stated, "stated"
    elif again is not None:
        floor, source = again.position, "repeats"
    else:
        floor, source = rms / np.sqrt(3.0), "remainder"
    progress("remainder: size and neighbours")
    near, likeness = _neighbours(fit, left)
    progress("remainder: places and quantities")
    law, locations, depends, share = _scan(fit, left)
    rest = [_too_large(fit, left), _lack_of_fit(left, again), near, law]
    aside = [_in_a_row(fit), too_many(fit, left), alike(fit)]
    count = len(rest) + len(aside)
    p_value = min(1.0, count * min(p for p, _ in (*rest, *aside)))
    told, of_aside = (tuple(reason for p, reason in tests if count * p < settings.LEVEL) for tests in (rest, aside))
    flagged = bool(told or of_aside) and rms > settings.ROUNDING
    if not flagged:
        return Examined(Unexplained(False, 0.0, p_value), floor, source)
    likeness = min(max(likeness, share, 0.0), 1.0)
    # what neighbours or a law have in common is no noise, however small beside the stated one
    beyond2 = max(rms**2 - 3.0 * floor**2, likeness * rms**2)
    if source == "remainder":
        # nothing tells the noise but the remainder itself: at most what neighbours do not have in common, if that
        floor, beyond2 = floor * float(np.sqrt(1.0 - likeness)), rms**2
    if of_aside:
        every2 = float((fit.corrected.gap[:, :3] ** 2).sum(axis=1).mean())
        beyond2 = max(beyond2, every2 - 3.0 * floor**2)
    # what the rest follows is said only where the rest is no noise
    followed = (locations, depends) if told else ((), ())
    return Examined(
        Unexplained(True, float(np.sqrt(beyond2)), p_value, (*told, *of_aside), *followed), float(floor), source
    )


def _too_large(fit: Fit, left: Remainder) -> tuple[float, str]:
    """Chi-square test of the residual against the stated noise; heavy tails reduce the degrees of freedom."""
    noise, worst = fit.explanation.whitening.noise, (1.0, "")
    stated = (fit.campaign.noise_position, fit.campaign.noise_orientation)
    for part, sigma in enumerate(stated[: left.white.shape[1] // 3]):
        if sigma is None:
            continue
        white = left.white[:, 3 * part : 3 * part + 3] * (noise[3 * part] / sigma)
        freedom = left.freedom * 3.0 / left.white.shape[1]
        ratio2 = float((white**2).sum() / freedom)
        tails = max(float((white**4).mean() / (white**2).mean() ** 2) - 1.0, 2.0)
        effective = freedom * 2.0 / tails
        p = float(chdtrc(effective, ratio2 * effective))
        what = "position" if part == 0 else "orientation"
        if p < worst[0] and ratio2 > settings.MATERIAL_SCALE**2:
            worst = (p, f"what remains in {what} is {np.sqrt(ratio2):.2g} times the stated noise")
    return worst


def _lack_of_fit(left: Remainder, again: Repeats | None) -> tuple[float, str]:
    """F test of the residual against the differences of near-repeats (lack of fit)."""
    if again is None:
        return 1.0, ""
    m = left.white.shape[1]
    ratio2 = left.scale2 / max(again.scale2, settings.TINY)
    p = float(fdtrc(left.freedom, again.pairs * m, ratio2))
    if ratio2 < settings.MATERIAL_REPEATS**2:
        return 1.0, ""
    times = np.sqrt(ratio2)
    return p, f"what remains is {times:.2g} times what {again.pairs} pairs of repeated commands differ by"


def _in_a_row(fit: Fit) -> tuple[float, str]:
    """Return the p-value that so many outliers are consecutive by chance, and the reason.

    Gross errors are not consecutive. Rows after a change of the robot or the setup are.
    """
    aside = fit.explanation.outliers[in_order(fit.campaign)]
    count, samples = int(aside.sum()), len(aside)
    if count < settings.FEW_ASIDE * samples:
        return 1.0, ""
    follow = int((aside[1:] & aside[:-1]).sum())
    # what chance gives has a Poisson law
    p = 1.0 - float(pdtr(follow - 1, count * (count - 1) / samples)) if follow else 1.0
    together = int(in_a_row(fit.campaign, fit.explanation.outliers).sum())
    return p, f"{together} of the {count} rows that were set aside follow each other: something changed there"


def _neighbours(fit: Fit, left: Remainder) -> tuple[tuple[float, str], float]:
    """Test whether residuals of neighbours, in joint space and in time, are correlated (permutation test).

    Returns p-value and reason, and the largest correlation that is significant.
    """
    q = fit.campaign.q[left.rows]
    spread = q.std(axis=0)
    used = spread > settings.ROUNDING
    white = left.white / np.sqrt((left.white**2).mean(axis=0) + settings.TINY)
    white = np.clip(white, -settings.CLIPPED, settings.CLIPPED)
    pairs = []
    if used.any() and len(q) > settings.FEWEST_NEIGHBOURS:
        _, near = nearest(q[:, used] / spread[used], settings.NEIGHBOURS)
        pairs.append(
            ("joint space", np.column_stack([np.repeat(np.arange(len(q)), settings.NEIGHBOURS), near.ravel()]))
        )
    order = np.argsort(np.argsort(in_order(fit.campaign))[left.rows], kind="stable")
    pairs.append(("the order of measurement", np.column_stack([order[:-1], order[1:]])))
    rng = np.random.default_rng(0)
    worst, most = (1.0, ""), 0.0
    for where, pair in pairs:
        statistic = float((white[pair[:, 0]] * white[pair[:, 1]]).sum(axis=1).mean())
        chance = np.empty(settings.SHUFFLES if len(white) < settings.SHUFFLED_ROWS else settings.FEW_SHUFFLES)
        for k in range(len(chance)):
            shuffled = white[rng.permutation(len(white))]
            chance[k] = (shuffled[pair[:, 0]] * shuffled[pair[:, 1]]).sum(axis=1).mean()
        p = float(2.0 * ndtr(-max(statistic - chance.mean(), 0.0) / (chance.std() + settings.TINY)))
        likeness = statistic / white.shape[1]
        if p < settings.LEVEL and likeness > settings.MATERIAL_SHARE:
            most = max(most, likeness)
        if p < worst[0] and likeness > settings.MATERIAL_SHARE:
            worst = (p, f"what remains is alike for neighbours in {where} (correlation {likeness:.2f})")
    return worst, most


@dataclass(frozen=True)
class _Tested:
    """A smooth law of one quantity at one place, and how much of the residual it explains."""

    kind: str
    place: str
    quantity: str
    worth: Worth


def _scan(fit: Fit, left: Remainder) -> tuple[tuple[float, str], tuple[Location, ...], tuple[Dependence, ...], float]:
    """F tests of a smooth law of every quantity at every place, with Bonferroni correction.

    Returns p-value and reason, places, quantities, and the share of the residual that the best law explains.
    """
    all_tests = _tests(fit.corrected, left.some(settings.ENOUGH_REMAINDER))
    tested = sorted((t for t in all_tests if np.isfinite(t.worth.gain)), key=lambda t: -t.worth.gain)
    if not tested:
        return (1.0, ""), (), (), 0.0
    locations = _locations(tested)[: settings.NAMED]
    material = [
        t
        for t in tested
        if t.worth.share > settings.MATERIAL_SHARE and t.worth.p_value * len(tested) < settings.LAW_LEVEL
    ]
    if not material:
        return (1.0, ""), locations, (), 0.0
    depends: dict[str, float] = {}
    for t in material:
        depends.setdefault(t.quantity, min(1.0, t.worth.p_value * len(tested)))
    first = material[0]
    at = in_words("joint", first.place) if first.kind == "joint" else f"the {first.place}"
    reason = f"a law of {first.quantity} at {at} explains {percent(first.worth.share, 0)} of what remains"
    named = tuple(Dependence(q, p) for q, p in list(depends.items())[: settings.NAMED])
    return (depends[first.quantity], reason), locations, named, first.worth.share


def _tests(observations: Observations, left: Remainder) -> Iterator[_Tested]:
    m, names = left.white.shape[1], observations.robot.joint_names
    places = [("joint", name, observations.joint_sensitivity[left.rows, :m, j, None]) for j, name in enumerate(names)]
    places.append(("base", "base", observations.base_sensitivity[left.rows, :m, :]))
    places.append(("tool", "tool", observations.tool_sensitivity[left.rows, :m, :m]))
    laws = {name: smooth_columns(values[left.rows]) for name, values in quantities(observations).items()}
    for kind, place, sensitivity in places:
        # five knots do not follow a wheel that turns more than once
        turns = [(place, _turns(observations, place)[left.rows])] if place in laws else []
        for quantity, law in [*laws.items(), *turns]:
            if not law.shape[1] or (law.shape[1] * sensitivity.shape[2]) > left.freedom // 3:
                continue
            columns = (sensitivity[:, :, :, None] * law[:, None, None, :]).reshape(len(left.rows), m, -1)
            yield _Tested(kind, place, quantity, left.target.worth(columns))


def _locations(tested: Sequence[_Tested]) -> tuple[Location, ...]:
    """Return the places with the posterior probability of the best law at each, largest first."""
    best: dict[tuple[str, str], float] = {}
    for t in tested:
        best[(t.kind, t.place)] = max(best.get((t.kind, t.place), -np.inf), t.worth.gain)
    gains = np.array(list(best.values()))
    weight = np.exp(gains - gains.max())
    found = [Location(kind, place, float(w)) for (kind, place), w in zip(best, weight / weight.sum(), strict=True)]
    return tuple(sorted(found, key=lambda place: -place.share))


def _turns(observations: Observations, joint: str) -> Array:
    """(N, 2k) harmonics of a joint's position."""
    angle = observations.q[:, observations.robot.joint_names.index(joint)]
    return np.column_stack([f(k * angle) for k in harmonics(observations, joint) for f in (np.sin, np.cos)])
