"""Screening of candidate laws, each a quantity at a place, against a residual by an information criterion.

The residual is a projection (:class:`Target`), the score the Bayesian information criterion (:func:`bic_gain`).
Screened are laws of every quantity at every place, in several shapes, and waves of any order by a periodogram.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.settings import STILL
from thermal_robot.campaign.turning import SLIPS, moves
from thermal_robot.effects import Effect, Parameter, Response, gate, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN, began, quantities, unit
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, whitener, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.exact import corrected_observations
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import consecutive_outliers
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.weights import robust_noise
from thermal_robot.observables import components, seen_components
from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Score:
    """Score of further columns: p-value of their F test, share of the residual explained, and gain of log evidence.

    ``share`` of the residual mean square, adjusted for their number; ``gain`` of log evidence by the Bayesian
    information criterion: ½ ν ln(S₀/S₁) − ½ k ln ν, S₀ and S₁ the residual sums of squares without and with the k
    columns, ν the degrees of freedom.
    """

    p_value: float
    share: float
    gain: float


NOTHING = Score(1.0, 0.0, -np.inf)


def bic_gain(total: Array | float, explained: Array | float, rank: Array | float, freedom: float) -> Array:
    """Gain of log evidence by the Bayesian information criterion (Schwarz 1978), ½ ν ln(S₀/S₁) − ½ k ln ν.

    ``total`` S₀ and S₀ − S₁ ``explained`` are sums of squares, ``rank`` k the number of columns, ``freedom`` ν the
    degrees of freedom without them; −∞ without columns, and where these would leave too few degrees of freedom.
    """
    rest = np.maximum(np.asarray(total) - explained, settings.TINY)
    gain = 0.5 * freedom * np.log(total / rest) - 0.5 * np.asarray(rank) * np.log(freedom)
    return np.where((np.asarray(rank) == 0) | (freedom - rank < settings.FEWEST_LEFT), -np.inf, gain)


@dataclass(frozen=True, eq=False)
class Target:
    """Residual to be explained: ``white`` (N·m,), the gap with a design projected out, in units of the noise.

    ``root`` (N, m): square root of each weight over the noise; ``basis`` (N·m, r): orthonormal basis of the design;
    ``unseen``: how many of the N·m components are not measured.
    """

    white: Array
    root: Array
    basis: Array
    unseen: int = 0

    @classmethod
    def of(
        cls,
        gap: Array,
        design: Array,
        trusted: NDArray[np.bool_] | None = None,
        relative: Array | None = None,
        like: Target | None = None,
        seen: NDArray[np.int64] | None = None,
    ) -> Target:
        """Project a design (N, m, K) out of a gap (N, m), with Cauchy weights of the rows.

        Rows that are ``trusted`` (N,) weigh fully in the residual, however far they are. Where the noise of the figures
        differs, ``relative`` (N, m) says how; where rows see fewer components, ``seen`` (N, m/3). Weights
        are found by iteration, or at once from those of a target that is nearly ``like`` this one.
        """
        if relative is not None:
            like = None if like is None else replace(like, root=like.root * relative)
            even = cls.of(gap / relative, design / relative[:, :, None], trusted, like=like, seen=seen)
            return replace(even, root=even.root / relative)
        found = _reweighted(gap, design, gap if like is None else like.left, seen, first=like is None)
        for _ in range(settings.CAUCHY_ROUNDS - 1 if like is None else 0):
            found = _reweighted(gap, design, found.left, seen)
        if trusted is not None and trusted.any():
            noise = np.repeat(robust_noise(found.left, seen=seen), 3)
            found = _projected(gap, design, np.where(trusted[:, None], 1.0 / noise, found.root))
        return found if seen is None else replace(found, unseen=int((3 - seen).sum()))

    @property
    def left(self) -> Array:
        """Residual (N, m) in m and rad: ``white`` without weights."""
        return self.white.reshape(self.root.shape) / self.root

    @property
    def freedom(self) -> int:
        """Residual degrees of freedom: equations less the rank of the design."""
        return max(int(len(self.white) - self.unseen - self.basis.shape[1]), 1)

    def score(self, columns: Array) -> Score:
        """Test K columns (N, m, K) together by F and BIC; :data:`NOTHING` if none is new or few freedoms are left."""
        whole = equations_of(columns * self.root[:, :, None])
        flat = without(whole, self.basis)
        # what is left of an exact alias of the design is rounding, no column
        flat[:, np.linalg.norm(flat, axis=0) < settings.ALIAS * np.linalg.norm(whole, axis=0)] = 0.0
        own = whitener(flat.T @ flat, settings.LAW_FLOOR)
        k, freedom = own.shape[1], self.freedom
        if not k or freedom - k < settings.FEWEST_LEFT:
            return NOTHING
        projected = own.T @ (flat.T @ self.white)
        total, taken = max(float(self.white @ self.white), settings.TINY), float(projected @ projected)
        rest = max(total - taken, settings.TINY)
        return Score(
            float(fdtrc(k, freedom - k, (taken / k) / (rest / (freedom - k)))),
            1.0 - (rest / (freedom - k)) / (total / freedom),
            float(bic_gain(total, taken, k, freedom)),
        )

    def statistics(self, moves: Array) -> PlaceStatistics:
        """Sufficient statistics, row by row, to screen laws at a place from its Jacobian ``moves`` (N, m, d)."""
        own = moves * self.root[:, :, None]
        basis = self.basis.reshape(*self.root.shape, -1)
        return PlaceStatistics(
            np.einsum("nmd,nme->nde", own, own),
            np.einsum("nmr,nmd->rdn", basis, own),
            np.einsum("nm,nmd->nd", self.white.reshape(self.root.shape), own),
            max(float(self.white @ self.white), settings.TINY),
            self.freedom,
        )


def _reweighted(
    gap: Array, design: Array, left: Array, seen: NDArray[np.int64] | None = None, first: bool = False
) -> Target:
    """Return the target with Cauchy weights at a former residual ``left``, or with equal weights the ``first`` time."""
    noise = np.repeat(robust_noise(left, seen=seen), 3)
    figures = left.shape[1] if seen is None else np.maximum(seen.sum(axis=1), 1)
    far2 = 0.0 if first else ((left / noise) ** 2).sum(axis=1) / (3.0 * figures)
    return _projected(gap, design, 1.0 / np.sqrt(1.0 + np.broadcast_to(far2, len(gap)))[:, None] / noise)


def _projected(gap: Array, design: Array, root: Array) -> Target:
    basis = orthonormal(equations_of(design * root[:, :, None]))
    return Target(without((gap * root).ravel(), basis), root, basis)


@dataclass(frozen=True, eq=False)
class LawStack:
    """Batch of C laws, grouped by their number K of functions: (C, N, K) and their products (C, N, K, K)."""

    laws: int
    stacks: tuple[tuple[list[int], Array, Array], ...]

    @classmethod
    def of(cls, laws: Sequence[Array]) -> LawStack:
        """Stack laws, each given by its (N, K) functions, by their number of functions."""
        stacks = []
        for width in {law.shape[1] for law in laws}:
            which = [i for i, law in enumerate(laws) if law.shape[1] == width]
            functions = np.stack([laws[i] for i in which])
            stacks.append((which, functions, functions[:, :, :, None] * functions[:, :, None, :]))
        return cls(len(laws), tuple(stacks))


@dataclass(frozen=True, eq=False)
class PlaceStatistics:
    """Sufficient statistics of a residual for all laws at one place, each row's components summed.

    A law's columns are the products of the place's d displacement components with K functions φ of a quantity. Their
    Gram matrix without the design is Σ_n φ_k φ_l W_n less that of their projection on the design. In units of the
    noise: ``weight`` (N, d, d) products W of the components, ``design`` (r, d, N) and ``remainder`` (N, d) those with
    the design's basis and the residual; ``total`` sum of squares and degrees of ``freedom`` of the residual.
    """

    weight: Array
    design: Array
    remainder: Array
    total: float
    freedom: int

    def gains(self, laws: Sequence[Array] | LawStack) -> Array:
        """Gain of log evidence of each law (:attr:`Score.gain`), from its (N, K) functions."""
        alike = laws if isinstance(laws, LawStack) else LawStack.of(laws)
        found = np.full(alike.laws, -np.inf)
        for which, functions, products in alike.stacks:
            found[which] = self._alike(functions, products)
        return found

    def _alike(self, functions: Array, products: Array) -> Array:
        """Gain (C,) of C laws of K functions each, (C, N, K), with the products (C, N, K, K)."""
        laws, rows, k = functions.shape
        r, d, _ = self.design.shape
        summed = products.reshape(laws, rows, k * k).transpose(0, 2, 1) @ self.weight.reshape(rows, d * d)
        whole = summed.reshape(laws, k, k, d, d).transpose(0, 1, 3, 2, 4).reshape(laws, k * d, k * d)
        seen = (self.design.reshape(r * d, rows) @ functions).reshape(laws, r, d, k)
        inside = seen.transpose(0, 1, 3, 2).reshape(laws, r, k * d)
        gram = whole - inside.transpose(0, 2, 1) @ inside
        vector = (functions.transpose(0, 2, 1) @ self.remainder).reshape(laws, k * d)
        explained, rank = explained_by(gram, vector, np.einsum("cii->ci", whole), rows)
        return bic_gain(self.total, explained, rank, self.freedom)


def explained_by(gram: Array, vector: Array, whole: Array, rows: int) -> tuple[Array, Array]:
    """Explained sums of squares (C,) and ranks (C,) of C regressions, from normal equations (C, K, K) and (C, K).

    ``whole`` (C, K) are the squared lengths of the columns before the design was projected out. Errors of sums over
    ``rows`` grow with the square root of their number (Higham, *Accuracy and Stability*, 2002).
    """
    own = np.einsum("cii->ci", gram)
    # what is left of an alias of the design is a difference of large numbers: rounding has to lie below the tolerance
    kept = own > np.sqrt(rows) * np.finfo(float).eps / settings.LAW_FLOOR * whole
    length = np.where(kept, np.sqrt(np.where(kept, own, 1.0)), np.inf)
    value, axes = np.linalg.eigh(gram / (length[:, :, None] * length[:, None, :]))
    seen = value > settings.LAW_FLOOR * np.maximum(value.max(axis=1, initial=1.0), 1.0)[:, None]
    along = np.einsum("cki,ck->ci", axes, vector / length)
    return (np.where(seen, along**2 / np.where(seen, value, 1.0), 0.0)).sum(axis=1), seen.sum(axis=1)


__all__ = [
    "CLOCK",
    "harmonics",
    "hystereses",
    "law_of",
    "laws",
    "of_quantity",
    "relaxing",
    "shapes",
    "smooth_columns",
    "straight",
]


def laws(observations: Observations, kinds: Sequence[str], names: Iterable[str] | None = None) -> list[Discovered]:
    """Smooth laws of each quantity at each place of the given kinds; constant ones at segments, harmonics in joints."""
    turns = components(observations.campaign) == 6
    robot = observations.robot
    places = {
        "joint": robot.joint_names,
        "base": ("base",),
        "tool": ("tool",),
        # before the first joint a segment is the base, behind the last one the tool
        "link": tuple(s.name for s in robot.segments[1:] if s.movable),
    }
    known = quantities(observations)
    # knots and levels are the same wherever it enters
    follow = {
        n: law_of(observations, Discovered(turns=turns), n, known[n]) for n in (known if names is None else names)
    }
    found = []
    for kind in kinds:
        for place in places[kind]:
            plain = Discovered(kind=kind, place=place, turns=turns)
            if kind == "link":
                found.append(replace(plain, shape="constant", quantity="none"))
            for name, followed in follow.items():
                law = replace(followed, kind=kind, place=place)
                found.append(law)
                if kind == "joint" and name == place and law.shape == "smooth":
                    # five knots do not follow a wheel that turns more than once
                    found += [replace(law, shape="harmonic", marks=(k,)) for k in harmonics(observations, place)]
    return found


def law_of(observations: Observations, plain: Discovered, name: str, values: Array) -> Discovered:
    """Smooth law of a quantity (N,), or one of its levels where it has few values."""
    own = None if name in observations.covariates else observations.campaign.labels.get(name)
    labels = () if own is None else tuple(np.unique(own).tolist())
    law = replace(plain, quantity=name, unit=unit(observations.robot, name), labels=labels)
    return of_quantity(law, values)


def straight(law: Discovered) -> Discovered:
    """Straight-line version of a law; a law of labels, such as sessions, stays as it is."""
    return law if law.labels else replace(law, shape="ramp", marks=())


def harmonics(observations: Observations, joint: str) -> tuple[float, ...]:
    """Harmonics tried in a joint: the first three, and the motor's where its ratio is stated."""
    ratio = observations.campaign.gears.get(joint)
    return settings.HARMONICS if ratio is None else (*settings.HARMONICS, float(ratio), 2.0 * float(ratio))


def of_quantity(law: Discovered, values: Array) -> Discovered:
    """Law with knots at the quantity's quantiles, or with its levels where it has few values."""
    levels = np.unique(values)
    low, high = float(values.min()), float(values.max())
    if len(levels) <= settings.FEW_LEVELS:
        return replace(law, shape="levels", marks=tuple(levels.tolist()), origin=low, span=high - low)
    marks = np.quantile(values, np.linspace(settings.OUTER_KNOTS, 1.0 - settings.OUTER_KNOTS, settings.KNOTS))
    if np.diff(marks).min() < settings.NARROW_KNOTS * (high - low) / settings.KNOTS:
        # most values lie in one spot: a spline between knots there would be free to do anything
        marks = np.linspace(low, high, settings.KNOTS)
    return replace(law, shape="smooth", marks=tuple(marks.tolist()), origin=low, span=high - low)


def shapes(
    law: Discovered, values: Array, jumps: bool = True, orders: Sequence[float] = settings.HARMONICS
) -> list[Discovered]:
    """Alternative functional forms of a law: its own, smooth, and simpler ones, each once.

    Always straight, quadratic, and hinges at quantiles of the quantity; with ``jumps`` (positions, gravity, clock) also
    steps and bumps; of a velocity its sign; of a joint's own position harmonics of the given orders; of labels one that
    differs from the others; of two quantities their product alone; of a joint's memory stop operators.
    """
    if law.shape == "constant":
        return [law]
    law = replace(of_quantity(law, values), runs=(), starts=()) if law.starts else law
    if law.by:
        largest = float(np.abs(values).max())
        product = [replace(law, shape="product", span=largest)] if largest > 0.0 else []
        return list(dict.fromkeys([law, *product]))
    smooth = of_quantity(law, values)
    found = [law, smooth] if law.labels or len(smooth.marks) < 3 else [law, smooth, straight(law)]
    if law.labels and len(levels := np.unique(values)) > 2:
        found += [replace(law, shape="apart", marks=(float(m),)) for m in levels]
    if smooth.shape == "levels":
        return list(dict.fromkeys(found))
    found.append(replace(law, shape="quadratic", marks=()))
    middle = np.quantile(values, np.linspace(settings.INNER_MARKS, 1.0 - settings.INNER_MARKS, settings.MARKS))
    if law.quantity.startswith(TURN):
        return list(dict.fromkeys([*found, *hystereses(law, values)]))
    if jumps:
        found += _jumps(law, middle)
    found += [replace(law, shape="hinge", marks=(float(m), side)) for m in middle[2:-2:2] for side in (1.0, -1.0)]
    if law.quantity.startswith("velocity."):
        found.append(replace(law, shape="drag", marks=()))
    if law.quantity == law.place and law.kind == "joint" and not law.of:
        found += [replace(law, shape="harmonic", marks=(k,)) for k in orders]
    return list(dict.fromkeys(found))


def _jumps(law: Discovered, middle: Array) -> list[Discovered]:
    found = [replace(law, shape="step", marks=(float(m),)) for m in middle]
    found += [replace(law, shape="slide", marks=(float(m), settings.SLIDE_WIDTH * law.span)) for m in middle[::2]]
    widths = [w * law.span for w in settings.BUMP_WIDTHS]
    return found + [replace(law, shape="bump", marks=(float(m), w)) for m in middle[1:-1:2] for w in widths]


def hystereses(law: Discovered, values: Array) -> list[Discovered]:
    """Laws of stop operators (hysteresis) of a joint: sets over the whole range of slips, and neighbours in it.

    ``values`` (N,), rad or m from the last turning point, decide which slips are observable. A slip between two of the
    grid is nearly the sum of these.
    """
    least, most = (share * float(np.abs(values).max()) for share in settings.SLIP_SHARES)
    slips = tuple(r for r in SLIPS if least <= r <= most)
    whole = [slips[::step] for step in settings.SLIP_STEPS]
    few = [slips[k : k + n] for n in settings.SLIPS_TOGETHER for k in range(len(slips) - n + 1)]
    return [replace(law, shape="hysteresis", marks=marks) for marks in dict.fromkeys([*whole, *few]) if marks]


def relaxing(observations: Observations, law: Discovered) -> list[Discovered]:
    """Laws of time that relax exponentially after each start, with several time constants; none where time is constant.

    With sessions both: one amplitude for all starts, and one for each. A session begins with its first row; without
    sessions the campaign does.
    """
    clock = law.values(observations)
    if clock is None or not np.ptp(clock) > 0.0:
        return []
    span, starts = float(np.ptp(clock)), began(observations, clock)
    law = replace(law, labels=(), runs=(), origin=float(clock.min()), span=span, starts=tuple(starts.values()))
    if len(starts) < 2:
        found = [replace(law, shape="relaxing")]
    else:
        found = [replace(law, shape=shape, runs=tuple(starts)) for shape in ("relaxing", "relaxing each")]
    return [replace(one, marks=(share * span,)) for one in found for share in settings.RELAXED_WITHIN]


def smooth_columns(values: Array) -> Array:
    """Basis (N, k) of the smooth laws of a quantity: centred, uncorrelated, of mean square one.

    It spans the laws of :func:`of_quantity` without their constant: levels of a quantity with few values, a natural
    cubic spline otherwise. It is empty (N, 0) where the quantity does not vary.
    """
    if np.ptp(values) == 0.0:
        return np.zeros((len(values), 0))
    functions, _ = of_quantity(Discovered(), values).functions(values)
    u, s, _ = np.linalg.svd(functions - functions.mean(axis=0), full_matrices=False)
    kept: Array = u[:, s > settings.SPLINE_FLOOR * s[0]] * np.sqrt(len(values))
    return kept


def orders(q: Array, slides: bool = False) -> Array:
    """Grid (K,) of wave orders of a joint, rad per rad, or rad/m for a prismatic joint.

    The spacing is a quarter of a peak's width, the upper end the Nyquist order of the positions (N,): π/d on a lattice
    of spacing d (Shannon). At most :data:`settings.MOST_ORDERS` of them.
    """
    if not moves(q):
        return np.zeros(0)
    reach = float(np.ptp(q))
    lowest = np.pi / reach if slides else settings.LOWEST_ORDER
    highest = 2.0 * np.pi / settings.SHORTEST_PERIOD if slides else settings.HIGHEST_ORDER
    step = settings.ORDER_STEP * 2.0 * np.pi / reach
    return np.arange(lowest, min(highest, _nyquist(q), lowest + settings.MOST_ORDERS * step), step)


def independent(grid: Array) -> float:
    """Return number of independent orders in a grid of :func:`orders`: one for each width of a peak (Baluev 2008)."""
    return max(len(grid) * settings.ORDER_STEP, 1.0) if len(grid) else 0.0


def periodogram(statistics: PlaceStatistics, q: Array, at: Array) -> Array:
    """Least-squares periodogram (K,): log evidence of 1, sin kq and cos kq at each order k.

    The least-squares periodogram with a floating mean (Zechmeister and Kuerster, *The generalised Lomb-Scargle
    periodogram*, 2009), of many equations a row, the design projected out. Positions q (N,), rad or m; orders in equal
    steps (K,). Gains are those of :meth:`PlaceStatistics.gains`; orders collinear with the
    design, or whose sine and cosine are collinear at these positions, gain −∞.
    """
    found = [_chunk(statistics, q, at[k : k + settings.ORDER_CHUNK]) for k in range(0, len(at), settings.ORDER_CHUNK)]
    return np.concatenate([*found, np.zeros(0)])


def peak(statistics: PlaceStatistics, q: Array, grid: Array) -> float:
    """Wave order at the maximum of the periodogram over a grid (K,), refined by ever finer grids about it."""
    best = float(grid[np.argmax(periodogram(statistics, q, grid))])
    step = settings.ORDER_STEP * 2.0 * np.pi / float(np.ptp(q))
    for _ in range(settings.ORDER_ZOOMS):
        near = best + step * np.linspace(-1.0, 1.0, 17)
        best, step = float(near[np.argmax(periodogram(statistics, q, near))]), step / 8
    return best


def _chunk(statistics: PlaceStatistics, q: Array, at: Array) -> Array:
    weight, design, remainder = statistics.weight[:, 0, 0], statistics.design[:, 0], statistics.remainder[:, 0]
    # equal steps: e^(i k q) of the first, times powers of one step
    wave = _waves(q, at)
    both = np.concatenate([wave.real, wave.imag], axis=1)
    count = len(at)
    inside = design @ both
    twice = weight @ wave**2
    whole = float(weight.sum())
    squares = 0.5 * np.concatenate([whole + twice.real, whole - twice.real]) - np.einsum("rk,rk->k", inside, inside)
    cross = 0.5 * twice.imag - np.einsum("rk,rk->k", inside[:, :count], inside[:, count:])
    values = remainder @ both
    constant = design.sum(axis=1)
    left = whole - float(constant @ constant)
    explained, rank = 0.0, 2.0
    if left > settings.ALIAS * whole:
        shared = weight @ both - constant @ inside
        mean = float(remainder.sum()) / left
        values = values - shared * mean
        squares = squares - shared**2 / left
        cross = cross - shared[:count] * shared[count:] / left
        explained, rank = mean**2 * left, 3.0
    first, second = np.split(squares, 2)
    apart = first * second - cross**2
    seen = (np.minimum(first, second) > settings.ALIAS * whole) & (apart > settings.LAW_FLOOR * first * second)
    a, b = np.split(values, 2)
    part = (second * a**2 - 2.0 * cross * a * b + first * b**2) / np.where(seen, apart, 1.0)
    return np.where(seen, bic_gain(statistics.total, explained + part, rank, statistics.freedom), -np.inf)


def _waves(q: Array, at: Array) -> NDArray[np.complex128]:
    """Complex waves (N, K) e^(i k q) of equidistant orders k, as products of coarse and fine ones."""
    fine = int(np.ceil(np.sqrt(len(at))))
    step = at[1] - at[0] if len(at) > 1 else 0.0
    small = np.exp(1j * np.outer(q, step * np.arange(fine)))
    large = np.exp(1j * np.outer(q, at[::fine]))
    return np.asarray((large[:, :, None] * small[:, None, :]).reshape(len(q), -1)[:, : len(at)])


def _nyquist(q: Array) -> float:
    """Nyquist order of positions on a lattice; infinite where they lie on none."""
    levels = np.unique(q)
    gaps = np.diff(levels)
    gaps = gaps[gaps > STILL]
    if not len(gaps):
        return np.inf
    spacing = float(levels[-1] - levels[0]) / float(np.round(gaps / gaps.min()).sum())
    steps = (levels - levels[0]) / spacing
    return np.pi / spacing if np.abs(steps - np.round(steps)).max() < settings.LATTICE else np.inf


@dataclass(frozen=True, eq=False)
class RowSample:
    """Rows of a fit for a scan: all of them, or a random sample where there are very many.

    ``changed`` (M,): rows that were set aside and follow each other in time.
    """

    observations: Observations
    linear: Linear
    changed: NDArray[np.bool_]

    @classmethod
    def of(cls, fit: Fit) -> RowSample:
        """Take all rows of a fit, or a reproducible random sample of :data:`settings.ENOUGH_ROWS` of more."""
        e = fit.explanation
        if fit.campaign.samples <= settings.ENOUGH_ROWS:
            return cls(fit.corrected, e.linear, consecutive_outliers(fit.campaign, e.outliers))
        drawn = np.random.default_rng(settings.DRAW_SEED).choice(
            fit.campaign.samples, settings.ENOUGH_ROWS, replace=False
        )
        rows = np.sort(drawn)
        return cls(
            corrected_observations(fit.campaign.take(rows), fit.corrected.frames, fit.effects),
            Linear(
                e.linear.gap[rows],
                e.linear.frames[rows],
                tuple(replace(b, source=b.columns[rows]) for b in e.linear.blocks),
            ),
            consecutive_outliers(fit.campaign, e.outliers)[rows],
        )

    def target(self, blocks: Iterable[int], *, sound: bool = False) -> Target:
        """Residual with the frames and some blocks projected out; far rows but consecutive ones have Cauchy weights.

        With ``sound`` all but the farthest few weigh fully: a law that is large in few rows looks like gross errors.
        """
        columns = [self.linear.blocks[b].columns for b in blocks]
        design = np.concatenate([self.linear.frames, *columns], axis=2)
        relative, seen = self.observations.campaign.relative_noise, seen_components(self.observations.campaign)
        first = Target.of(self.linear.gap, design, self.changed, relative, seen=seen)
        if not sound:
            return first
        distance = np.linalg.norm(first.white.reshape(first.root.shape) / first.root, axis=1)
        near = distance <= np.quantile(distance, 1.0 - settings.FEW_ASIDE)
        return Target.of(self.linear.gap, design, near | self.changed, relative, seen=seen)


def conditions(observations: Observations, joint: str = "") -> list[str]:
    """List the quantities that may act on a place: recorded ones, the clock and the session.

    Not the joints' positions, gravity and reach; of quantities recorded for each joint, only this joint's.
    """
    robot = observations.robot
    others = tuple(f".{name}" for name in robot.joint_names if name != joint)
    computed = {*robot.joint_names, *GRAVITY, *REACH}
    return [name for name in quantities(observations) if name not in computed and not name.endswith(others)]


def modulated(observations: Observations, effects: Iterable[Effect] | None = None) -> list[Discovered]:
    """Laws of known effects whose size in one joint is modulated by a condition or position.

    Left out are effects with a constant response, which modulated are plain laws of that joint; the driver of the
    effect itself, as backlash times the direction of approach is a zero error; and effects that are not installed.
    """
    installed = library()
    offered = installed.values() if effects is None else effects
    known = quantities(observations)
    follow = {name: straight(law_of(observations, Discovered(), name, values)) for name, values in known.items()}
    found = []
    for effect in offered:
        if type(installed.get(effect.name)) is not type(effect) or gate.missing(effect, observations):
            continue
        setting = gate.variants(effect, observations)[0] if effects is None else effect
        arguments = {k: v for k, v in gate.arguments(setting).items() if k not in ("places", "excluded")}
        for joint in _varying_joints(setting, observations):
            driver = _driver(setting, observations, joint)
            followed = (*conditions(observations, joint), joint)
            names = [name for name in followed if driver not in (name, f"position of {name}")]
            plain = [follow[name] for name in names if name in known]
            text = json.dumps(arguments)
            found += [replace(law, place=joint, of=effect.name, of_arguments=text) for law in plain]
    return found


def _varying_joints(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Joints in which an effect's response differs between rows."""
    own = [p for p in gate.checked(effect, observations) if p.kind == "joint"]
    return gate.places_of([p for p in own if any(np.ptp(r.values, axis=0).any() for r in _varying_responses(p))])


def _driver(effect: Effect, observations: Observations, joint: str) -> str:
    """Name of the quantity that drives an effect in a joint; empty if none is recorded."""
    own = [p for p in gate.checked(effect, observations) if p.kind == "joint" and p.place == joint]
    driver = gate.driver(effect, observations, own, np.zeros(observations.campaign.samples))
    return driver[0] if driver else ""


def _varying_responses(parameter: Parameter) -> Iterator[Response]:
    """Yield the responses of a parameter that are stated row by row, not once for all rows."""
    yield from (r for r in parameter.responses if r.values.ndim == (1 if r.channel == "joint" else 2))


def interactions(observations: Observations, kinds: Sequence[str]) -> list[Discovered]:
    """Interactions of two quantities u and v (functions 1, u, v and u·v): a condition or own position with another."""
    robot, known = observations.robot, quantities(observations)
    turns = components(observations.campaign) == 6
    further = [name for name in (*robot.joint_names, *GRAVITY, *REACH) if name in known]
    follow = {
        name: Discovered(
            turns=turns,
            quantity=name,
            shape="ramp",
            unit=unit(robot, name),
            origin=float(values.min()),
            span=float(np.ptp(values)),
        )
        for name, values in known.items()
    }
    found = []
    for kind in kinds:
        for place in robot.joint_names if kind == "joint" else (kind,):
            own = [n for n in conditions(observations, place) if n not in observations.campaign.labels]
            first = [*own, place] if place in known else own
            for i, name in enumerate(first):
                law = replace(follow[name], kind=kind, place=place)
                for by in [*first[i + 1 :], *(n for n in further if n not in first)]:
                    found.append(replace(law, by=by, by_origin=follow[by].origin, by_span=follow[by].span))
    return found


def memory(observations: Observations) -> list[Discovered]:
    """Candidate laws with memory: hysteresis of each joint since its last turning point, relaxation after starts."""
    found, past, known = [], observations.campaign.since_turn, quantities(observations)
    clock = next((name for name in CLOCK if name in observations.covariates and name in known), None)
    for joint in observations.robot.joint_names:
        if joint in past and moves(past[joint]):
            smooth = law_of(observations, Discovered(place=joint), TURN + joint, past[joint])
            found += [smooth, *hystereses(smooth, past[joint])[:2]]
        if clock:
            found += relaxing(observations, law_of(observations, Discovered(place=joint), clock, known[clock]))
    return found


Site = tuple[str, str, str]
"""Kind and name of a place, and a quantity."""


@dataclass(frozen=True, eq=False)
class Scanned:
    """Candidate law, its gain of log evidence, and the number of candidates tried.

    ``tried`` is the number of kinds of law times that of the laws of its kind; 1/``tried`` is its share of the prior,
    and all sum to one.
    """

    law: Discovered
    gain: float
    tried: float = 1.0

    @property
    def net_gain(self) -> float:
        """Gain of log evidence less the logarithm of the number tried."""
        return self.gain - float(np.log(self.tried))


class ScanCache:
    """Cache of the columns of each place and the functions of each quantity, for scans of some targets."""

    def __init__(self, observations: Observations, targets: Sequence[Target]) -> None:
        self.observations, self.targets = observations, targets
        self._statistics: dict[tuple[object, ...], tuple[PlaceStatistics, ...]] = {}
        self._functions: dict[tuple[object, ...], Array] = {}

    def statistics(self, law: Discovered) -> tuple[PlaceStatistics, ...]:
        """Sufficient statistics of each target at a law's place, or for the known effect that it modulates."""
        place = (law.kind, law.place, law.turns, law.of, law.of_arguments)
        if place not in self._statistics:
            moves = block(self.observations, _constant_law(law)).columns
            self._statistics[place] = tuple(target.statistics(moves) for target in self.targets)
        return self._statistics[place]

    def functions(self, law: Discovered) -> Array:
        """Basis functions (N, K) of a law, memoised by what it follows and its shape, wherever it enters the robot."""
        # all that the functions hang on
        followed = (
            *(law.quantity, law.shape, law.marks, law.origin, law.span, law.labels, law.runs, law.starts),
            *(law.by, law.by_origin, law.by_span),
        )
        if followed not in self._functions:
            rows = law.at_rows(self.observations)
            self._functions[followed] = np.zeros((len(self.observations.q), 0)) if rows is None else rows[0]
        return self._functions[followed]

    def gains(self, candidates: Sequence[Discovered]) -> Array:
        """Gain (targets, C) of log evidence of each law."""
        found = np.zeros((len(self.targets), len(candidates)))
        together: dict[tuple[PlaceStatistics, ...], list[int]] = {}
        for i, law in enumerate(candidates):
            together.setdefault(self.statistics(law), []).append(i)
        for at_place, which in together.items():
            functions = LawStack.of([self.functions(candidates[i]) for i in which])
            for t, statistics in enumerate(at_place):
                found[t, which] = statistics.gains(functions)
        return found


def scan(
    observations: Observations, targets: Sequence[Target], effects: Iterable[Effect] | None = None
) -> tuple[list[list[Scanned]], int]:
    """Scan of all candidate laws: for every target sorted by :attr:`Scanned.net_gain`, and the number tried.

    Candidates are a smooth and a straight law of each quantity at each place; waves of any order and memory of each
    joint; known effects modulated in one joint; products of two quantities. At segments, whose laws have six
    components, only the best quantities are tried. Dropped are laws that gain no more than one nested in them: a
    modulated effect than the effect itself, a product than one of its quantities.
    """
    cache = ScanCache(observations, targets)
    kinds = _candidates(cache, effects)
    grids = _grids(observations)
    waves = round(sum(independent(grid) for grid in grids.values()))
    filled = sum(map(bool, (*kinds.values(), grids)))
    gains = {kind: cache.gains(own) for kind, own in kinds.items()}
    steady = list(dict.fromkeys(map(_constant_law, kinds["modulated"])))
    itself = dict(zip(steady, cache.gains(steady).T, strict=True))
    found = []
    for t in range(len(targets)):
        own = {
            kind: [Scanned(law, float(g), filled * len(made)) for law, g in zip(made, gains[kind][t], strict=True)]
            for kind, made in kinds.items()
        }
        own["free wave"] = _free_waves(cache, t, grids, filled * waves)
        own["modulated"] = [item for item in own["modulated"] if item.net_gain > itself[_constant_law(item.law)][t]]
        found.append(_best(own, cache, t))
    return found, sum(map(len, kinds.values())) + waves


def _candidates(cache: ScanCache, effects: Iterable[Effect] | None) -> dict[str, list[Discovered]]:
    """List candidate laws by kind: plain, wave, memory, modulated, product; without waves of arbitrary order."""
    observations = cache.observations
    first = laws(observations, ("joint", "base", "tool"))
    plain = [law for law in first if law.shape != "harmonic"]
    plain += [straight(law) for law in plain if law.shape == "smooth"]
    by_quantity = _gain_by_quantity(plain, cache.gains(plain))
    leading = sorted(by_quantity, key=lambda name: -by_quantity[name])[: settings.LINK_QUANTITIES]
    return {
        "plain": plain + laws(observations, ("link",), leading),
        "wave": [law for law in first if law.shape == "harmonic"],
        "memory": memory(observations),
        "modulated": modulated(observations, effects),
        "product": interactions(observations, ("joint", "base", "tool")),
    }


def shaped(observations: Observations, target: Target, law: Discovered) -> Scanned:
    """Select the functional form of a law by its net gain of log evidence, with marks and widths refined.

    Each kind of shape has the same share of the prior, which the places of its marks divide: ``tried`` counts shapes.
    """
    cache = ScanCache(observations, [target])
    measured = _gains_by_shape(cache, 0, law)
    first: dict[str, Scanned] = {}
    for item in sorted(measured, key=lambda item: -item.gain):
        first.setdefault(item.law.shape, item)
    # between the marks that were tried one may lie that makes another shape the best
    moved = {"sudden": _refined_step, "gradual": _refined_marks}
    moves = [(moved.get(SHAPES[shape].mark), item) for shape, item in first.items()]
    return max((move(item, cache) if move else item for move, item in moves), key=lambda item: item.net_gain)


def _gains_by_shape(cache: ScanCache, t: int, law: Discovered) -> list[Scanned]:
    """Score a law in each functional form: its gain of log evidence, and the number of forms tried."""
    observations = cache.observations
    whole = replace(law, shape="product") if law.by else law
    values = None if law.quantity == "none" else whole.values(observations)
    jumps = law.quantity in (*CLOCK, *GRAVITY, *observations.robot.joint_names) and not law.of
    waves = harmonics(observations, law.place) if law.kind == "joint" else settings.HARMONICS
    candidates = [law] if values is None else shapes(law, values, jumps, waves)
    if law.quantity in CLOCK and law.quantity in observations.covariates and not law.of and not law.by:
        candidates += relaxing(observations, law)
    names = [candidate.shape for candidate in candidates]
    gains = cache.statistics(law)[t].gains([cache.functions(candidate) for candidate in candidates])
    return [
        Scanned(candidate, float(gain), len(set(names)) * names.count(candidate.shape))
        for candidate, gain in zip(candidates, gains, strict=True)
    ]


def _refined_marks(best: Scanned, cache: ScanCache) -> Scanned:
    """Pattern search over the mark and width of a law for the largest gain of log evidence.

    The mark stays between two quantiles of the quantity, lest the law follow a single row beyond it.
    """
    step, low, high = settings.MARK_STEP, -np.inf, np.inf
    values = None if best.law.starts else best.law.values(cache.observations)
    if values is not None:
        low, high = np.quantile(values, [settings.INNER_MARKS, 1.0 - settings.INNER_MARKS])
    for _ in range(settings.MARK_ROUNDS):
        law, (mark, *width) = best.law, best.law.marks
        moved = (law.shifted(s * step * law.span) for s in (1, -1))
        near = [own for own in moved if low <= own.marks[0] <= high]
        if SHAPES[law.shape].width:
            near += [
                replace(law, marks=(mark, width[0] * f))
                for f in (1.0 + settings.WIDTH_STEP * step, 1.0 / (1.0 + settings.WIDTH_STEP * step))
            ]
        gains = cache.gains(near)[0]
        if gains.max() > best.gain:
            best = replace(best, law=near[int(gains.argmax())], gain=float(gains.max()))
        else:
            step /= 2.0
    return best


def _refined_step(best: Scanned, cache: ScanCache) -> Scanned:
    """Move a step to the midpoint between neighbouring values, near its own, with the largest net gain.

    The prior of the mark is uniform over the range, so that a long break between sessions has a larger share than a gap
    between two rows.
    """
    law, followed = best.law, best.law.values(cache.observations)
    values = np.unique(followed if followed is not None else np.zeros(1))
    gaps, widths = 0.5 * (values[1:] + values[:-1]), np.diff(values)
    beside = -(-len(gaps) // settings.MARKS)
    middle = int(np.searchsorted(gaps, law.marks[0]))
    near = range(max(middle - beside, 0), min(middle + beside + 1, len(gaps)))
    moved = [_between_runs(replace(law, marks=(float(gaps[k]),)), cache.observations) for k in near]
    shapes_tried = best.tried / settings.MARKS
    tried = [shapes_tried * float(np.ptp(values) / widths[k]) for k in near]
    found = [Scanned(*item) for item in zip(moved, map(float, cache.gains(moved)[0]), tried, strict=True)]
    return max(found, key=lambda item: item.net_gain)


def _between_runs(law: Discovered, observations: Observations) -> Discovered:
    """Label a step in time with the sessions on either side of it; unchanged where a session lies on both sides."""
    clock, runs = law.values(observations), observations.campaign.labels.get("session")
    if law.quantity not in CLOCK or clock is None or runs is None:
        return law
    late = clock > law.marks[0]
    if not late.any() or late.all() or set(runs[late]) & set(runs[~late]):
        return law
    last, first = np.flatnonzero(~late)[clock[~late].argmax()], np.flatnonzero(late)[clock[late].argmin()]
    return replace(law, runs=(str(runs[last]), str(runs[first])))


def _constant_law(law: Discovered) -> Discovered:
    """Constant law at a law's place, or the known effect itself that the law modulates."""
    return Discovered(
        kind=law.kind,
        place=law.place,
        quantity="none",
        shape="constant",
        turns=law.turns,
        of=law.of,
        of_arguments=law.of_arguments,
    )


def _gain_by_quantity(candidates: Sequence[Discovered], gains: Array) -> dict[str, float]:
    """Largest gain of each quantity over all targets and places."""
    found: dict[str, float] = {}
    for law, own in zip(candidates, gains.T, strict=True):
        found[law.quantity] = max(found.get(law.quantity, -np.inf), float(own.max()))
    return found


def _grids(observations: Observations) -> dict[str, Array]:
    """Wave orders tried in each joint that moves."""
    robot = observations.robot
    every = {
        joint: orders(observations.q[:, j], robot.joint_types[j] == "prismatic")
        for j, joint in enumerate(robot.joint_names)
    }
    return {joint: grid for joint, grid in every.items() if len(grid)}


def _free_waves(cache: ScanCache, t: int, grids: Mapping[str, Array], tried: int) -> list[Scanned]:
    """Best wave of each joint, by the peak of its periodogram over the grid of orders."""
    observations, found = cache.observations, []
    for joint, grid in grids.items():
        q = observations.q[:, observations.robot.joint_names.index(joint)]
        plain = Discovered(place=joint, quantity=joint, shape="harmonic", unit=unit(observations.robot, joint))
        plain = replace(plain, origin=float(q.min()), span=float(np.ptp(q)))
        statistics = cache.statistics(plain)[t]
        law = replace(plain, marks=(peak(statistics, q, grid),))
        found.append(Scanned(law, float(statistics.gains([cache.functions(law)])[0]), tried))
    return found


def _session_step(cache: ScanCache, t: int, levels: Scanned) -> Scanned | None:
    """Best step between consecutive sessions at the place of a law of sessions; ``None`` where there is none."""
    observations = cache.observations
    known = quantities(observations)
    clock = next((name for name in CLOCK if name in known), None)
    if clock is None:
        return None
    law = replace(levels.law, quantity=clock, shape="step", labels=())
    ends = [float(known[clock][observations.campaign.labels["session"] == run].max()) for run in levels.law.labels]
    steps = [_between_runs(replace(law, marks=(end,)), observations) for end in sorted(ends)[:-1]]
    steps = [step for step in steps if step.runs]
    if not steps:
        return None
    gains = cache.statistics(law)[t].gains([cache.functions(step) for step in steps])
    return Scanned(steps[int(gains.argmax())], float(gains.max()))


def _prefer_sessions(single: dict[Site, Scanned], session: Site, cache: ScanCache, t: int) -> None:
    """Drop laws of time whose net gain is not clearly above that of the law of sessions at the same place."""
    own = _best_shape(cache, t, single[session].law)
    for clock in [(*session[:2], name) for name in CLOCK]:
        if clock in single and _best_shape(cache, t, single[clock].law) < own + settings.COARSER:
            del single[clock]


def _best_shape(cache: ScanCache, t: int, law: Discovered) -> float:
    """Largest net gain of log evidence of a law over its functional forms."""
    return max(item.net_gain for item in _gains_by_shape(cache, t, law))


def _best(own: Mapping[str, list[Scanned]], cache: ScanCache, t: int) -> list[Scanned]:
    """Rank candidates by net gain: one law for each place and quantity; products only if better than their factors."""
    single: dict[Site, Scanned] = {}
    for item in (*own["plain"], *own["memory"]):
        key = (item.law.kind, item.law.place, item.law.quantity)
        if key not in single or item.net_gain > single[key].net_gain:
            single[key] = item
    for key in [key for key in single if key[2] == "session"]:
        step = _session_step(cache, t, single[key])
        if step is not None and step.gain > single[key].gain - settings.REFINED_GAIN:
            # one step in time explains as much: nothing is known of the session beside when it was
            del single[key]
        elif step is not None:
            _prefer_sessions(single, key, cache, t)
    alone = {key: item.net_gain for key, item in single.items()}
    for key in sorted(alone, key=lambda key: -alone[key])[: settings.SHAPED]:
        # a step is no smooth law; a product of the clock with anything would stand in for it
        best = _best_shape(cache, t, single[key].law)
        alone[key] = max(alone[key], best - float(np.log(single[key].tried)))
    inside = [
        max(alone.get((i.law.kind, i.law.place, name), -np.inf) for name in (i.law.quantity, i.law.by))
        for i in own["product"]
    ]
    products = [item for item, least in zip(own["product"], inside, strict=True) if item.net_gain > least]
    others = [*own["wave"], *own["free wave"], *own["modulated"], *products]
    ranked = [*((item, alone[key]) for key, item in single.items()), *((item, item.net_gain) for item in others)]
    return [item for item, _ in sorted(ranked, key=lambda pair: -pair[1])]
