"""The residual of a gap, and how much of it further columns would explain: one projection, one criterion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, whitener, without
from thermal_robot.inference.robust import robust_noise


@dataclass(frozen=True)
class Worth:
    """How much further columns explain beyond what was fitted: p-value of their F test, share, and gain.

    ``share`` of the residual mean square, adjusted for their number; ``gain`` of log evidence by the Bayes information
    criterion: ½ ν ln(S₀/S₁) − ½ k ln ν, S₀ and S₁ the residual sums of squares without and with the k columns, ν the
    degrees of freedom.
    """

    p_value: float
    share: float
    gain: float


NOTHING = Worth(1.0, 0.0, -np.inf)


def gained(total: Array | float, explained: Array | float, rank: Array | float, freedom: float) -> Array:
    """Gain of log evidence by the Bayes information criterion (Schwarz 1978), ½ ν ln(S₀/S₁) − ½ k ln ν.

    ``total`` S₀ and S₀ − S₁ ``explained`` are sums of squares, ``rank`` k the number of columns, ``freedom`` ν the
    degrees of freedom without them; −∞ without columns, and where these would leave too few degrees of freedom.
    """
    rest = np.maximum(np.asarray(total) - explained, settings.TINY)
    gain = 0.5 * freedom * np.log(total / rest) - 0.5 * np.asarray(rank) * np.log(freedom)
    return np.where((np.asarray(rank) == 0) | (freedom - rank < settings.FEWEST_LEFT), -np.inf, gain)


@dataclass(frozen=True, eq=False)
class Target:
    """A remainder to be explained: the residual ``white`` (N·m,) of the gap after a fit of a design, in noise units.

    ``root`` (N, m): square root of each weight over the noise; ``basis`` (N·m, r): an orthonormal one of the design.
    """

    white: Array
    root: Array
    basis: Array

    @classmethod
    def of(
        cls,
        gap: Array,
        design: Array,
        trusted: NDArray[np.bool_] | None = None,
        relative: Array | None = None,
        like: Target | None = None,
    ) -> Target:
        """Project a design (N, m, K) out of a gap (N, m), robustly: rows far from the rest weigh little (Cauchy).

        Rows that are ``trusted`` (N,) weigh fully in the residual, however far they are. Where the noise of the figures
        differs, ``relative`` (N, m) says how. Weights are found by iteration, or at once from those of a target that is
        nearly ``like`` this one.
        """
        if relative is not None:
            like = None if like is None else replace(like, root=like.root * relative)
            even = cls.of(gap / relative, design / relative[:, :, None], trusted, like=like)
            return cls(even.white, even.root / relative, even.basis)
        found = _weighed(gap, design, gap if like is None else like.left, first=like is None)
        for _ in range(settings.CAUCHY_ROUNDS - 1 if like is None else 0):
            found = _weighed(gap, design, found.left)
        if trusted is not None and trusted.any():
            noise = np.repeat(robust_noise(found.left), 3)
            found = _projected(gap, design, np.where(trusted[:, None], 1.0 / noise, found.root))
        return found

    @property
    def left(self) -> Array:
        """(N, m) what is left of the gap, m and rad."""
        return self.white.reshape(self.root.shape) / self.root

    @property
    def freedom(self) -> int:
        """Residual degrees of freedom: equations less the rank of the design."""
        return max(int(len(self.white) - self.basis.shape[1]), 1)

    def worth(self, columns: Array) -> Worth:
        """Return what further columns (N, m, K) explain; nothing where they would leave too few degrees of freedom."""
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
        return Worth(
            float(fdtrc(k, freedom - k, (taken / k) / (rest / (freedom - k)))),
            1.0 - (rest / (freedom - k)) / (total / freedom),
            float(gained(total, taken, k, freedom)),
        )

    def seat(self, moves: Array) -> Seat:
        """Return the target seen from a place whose d components move the gap by (N, m, d) a unit."""
        own = moves * self.root[:, :, None]
        basis = self.basis.reshape(*self.root.shape, -1)
        return Seat(
            np.einsum("nmd,nme->nde", own, own),
            np.einsum("nmr,nmd->rdn", basis, own),
            np.einsum("nm,nmd->nd", self.white.reshape(self.root.shape), own),
            max(float(self.white @ self.white), settings.TINY),
            self.freedom,
        )


def _weighed(gap: Array, design: Array, left: Array, first: bool = False) -> Target:
    """Return the target with Cauchy's weights of what was left of the rows, all the same the ``first`` time."""
    noise = np.repeat(robust_noise(left), 3)
    far2 = 0.0 if first else ((left / noise) ** 2).sum(axis=1) / (3.0 * left.shape[1])
    return _projected(gap, design, 1.0 / np.sqrt(1.0 + np.broadcast_to(far2, len(gap)))[:, None] / noise)


def _projected(gap: Array, design: Array, root: Array) -> Target:
    basis = orthonormal(equations_of(design * root[:, :, None]))
    return Target(without((gap * root).ravel(), basis), root, basis)


@dataclass(frozen=True, eq=False)
class Alike:
    """C laws of K functions each (C, N, K) with their products (C, N, K, K), computed once for all targets."""

    laws: int
    stacks: tuple[tuple[list[int], Array, Array], ...]

    @classmethod
    def of(cls, laws: Sequence[Array]) -> Alike:
        """Put together laws, each with its (N, K) functions."""
        stacks = []
        for width in {law.shape[1] for law in laws}:
            which = [i for i, law in enumerate(laws) if law.shape[1] == width]
            functions = np.stack([laws[i] for i in which])
            stacks.append((which, functions, functions[:, :, :, None] * functions[:, :, None, :]))
        return cls(len(laws), tuple(stacks))


@dataclass(frozen=True, eq=False)
class Seat:
    """A target seen from one place: what many laws there need, summed over the components of a row once.

    A law's columns are the products of the place's d components with K functions of a quantity. Their Gram matrix
    without the design is then Σ_n φ_k φ_l W_n less that of their part in the design. In units of the noise: ``weight``
    (N, d, d) products of the components, ``design`` (r, d, N) and ``remainder`` (N, d) those with the basis and the
    residual; ``total`` and ``freedom`` of the residual.
    """

    weight: Array
    design: Array
    remainder: Array
    total: float
    freedom: int

    def gains(self, laws: Sequence[Array] | Alike) -> Array:
        """Return the log evidence that laws gain (:attr:`Worth.gain`), each with its (N, K) functions."""
        alike = laws if isinstance(laws, Alike) else Alike.of(laws)
        found = np.full(alike.laws, -np.inf)
        for which, functions, products in alike.stacks:
            found[which] = self._alike(functions, products)
        return found

    def _alike(self, functions: Array, products: Array) -> Array:
        """(C,) the same of C laws of K functions each, (C, N, K), and these functions' products (C, N, K, K)."""
        laws, rows, k = functions.shape
        r, d, _ = self.design.shape
        summed = products.reshape(laws, rows, k * k).transpose(0, 2, 1) @ self.weight.reshape(rows, d * d)
        whole = summed.reshape(laws, k, k, d, d).transpose(0, 1, 3, 2, 4).reshape(laws, k * d, k * d)
        seen = (self.design.reshape(r * d, rows) @ functions).reshape(laws, r, d, k)
        inside = seen.transpose(0, 1, 3, 2).reshape(laws, r, k * d)
        gram = whole - inside.transpose(0, 2, 1) @ inside
        vector = (functions.transpose(0, 2, 1) @ self.remainder).reshape(laws, k * d)
        explained, rank = explained_by(gram, vector, np.einsum("cii->ci", whole))
        return gained(self.total, explained, rank, self.freedom)


def explained_by(gram: Array, vector: Array, whole: Array) -> tuple[Array, Array]:
    """(C,) sums of squares that columns explain, and their ranks, from (C, K, K), (C, K) and squared lengths (C, K)."""
    own = np.einsum("cii->ci", gram)
    # what is left of an exact alias of the design is rounding, no column
    kept = own > settings.ALIAS**2 * whole
    length = np.where(kept, np.sqrt(np.where(kept, own, 1.0)), np.inf)
    value, axes = np.linalg.eigh(gram / (length[:, :, None] * length[:, None, :]))
    seen = value > settings.LAW_FLOOR * np.maximum(value.max(axis=1, initial=1.0), 1.0)[:, None]
    along = np.einsum("cki,ck->ci", axes, vector / length)
    return (np.where(seen, along**2 / np.where(seen, value, 1.0), 0.0)).sum(axis=1), seen.sum(axis=1)
