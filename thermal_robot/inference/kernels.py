"""Smooth model discrepancy as a Gaussian process in the rows' covariance (Kennedy and O'Hagan 2001).

The whitened gap is y = F f + X θ + δ + e with e ~ N(0, s²) and δ ~ N(0, s² τ² K). K is one of several kernels, each of
mean one on its diagonal, so that τ is the discrepancy's rms over the noise:

* ``tool``: the target moves by a smooth function of all joint positions and conditions together;
* ``places``: each joint, the base and the tool err by a sum of smooth functions of single quantities,
  K = Σ_p J_p k_p J_pᵀ;
* ``poses``: an independent error of each pose, the same at every visit, of the target or in one joint; ``visits``:
  an independent error of each visit, in one joint.

Sources: M. C. Kennedy, A. O'Hagan, *J. R. Statist. Soc. B* 63 (2001), eq. 4; low rank: Rasmussen and Williams,
*Gaussian Processes for Machine Learning*, 2006, 8.1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from thermal_robot.arrays import Array
from thermal_robot.campaign.turning import moves as moving
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.grouping import repeated_poses
from thermal_robot.observables import components
from thermal_robot.observations import Observations

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DesignMatrix:
    """Design matrix of K columns over E = n·m equations; columns shared by several settings are stored once.

    ``different`` are U distinct columns (N, m) over all rows, ``number`` (K,) which of them each column is, ``used``
    (n,) the rows in use, ``root`` (n, m) the factors by which these are multiplied.
    """

    different: tuple[Array, ...]
    number: Numbers
    used: Numbers
    root: Array

    @classmethod
    def of(cls, columns: Iterable[Array]) -> DesignMatrix:
        """Collect columns (N, m, ·) over all rows, unweighted, each distinct one stored once."""
        different: list[Array] = []
        number: list[int] = []
        seen: dict[bytes, int] = {}
        for some in columns:
            for k in range(some.shape[2]):
                own = np.ascontiguousarray(some[:, :, k])
                key = blake2b(own.tobytes(), digest_size=16).digest()
                if key not in seen:
                    seen[key] = len(different)
                    different.append(own)
                number.append(seen[key])
        return cls(tuple(different), np.array(number), np.arange(len(different[0])), np.ones(different[0].shape))

    @classmethod
    def from_array(cls, array: Array, measures: int) -> DesignMatrix:
        """Stack of the columns (E, K) of an array."""
        different = tuple(column.reshape(-1, measures) for column in array.T)
        rows = len(array) // measures
        return cls(different, np.arange(len(different)), np.arange(rows), np.ones((rows, measures)))

    def weighted(self, used: Numbers, root: Array) -> DesignMatrix:
        """Copy over the rows ``used`` (n,), times ``root`` (n, m); both are applied when columns are asked for."""
        return replace(self, used=used, root=root)

    @property
    def equations(self) -> int:
        """Number of equations E."""
        return self.root.size

    def some_columns(self, kept: Numbers) -> DesignMatrix:
        """Stack of some of the distinct columns."""
        return replace(self, different=tuple(self.different[k] for k in kept), number=np.arange(len(kept)))

    def rows(self, which: slice | Numbers) -> Array:
        """Distinct columns (r, m, U) of some of the rows in use, times ``root``."""
        rows, root = self.used[which], self.root[which]
        found = np.empty((*root.shape, len(self.different)))
        for k, own in enumerate(self.different):
            np.multiply(own[rows], root, out=found[:, :, k])
        return found

    def chunks(self) -> Iterator[tuple[slice, Array]]:
        """Yield slices of rows with their distinct columns (r, m, U)."""
        for part in chunks(len(self.used)):
            yield part, self.rows(part)

    def products(self) -> Array:
        """Gram matrix (K, K) of the columns."""
        found = np.zeros((len(self.different),) * 2)
        for _, rows in self.chunks():
            flat = equations_of(rows)
            found += flat.T @ flat
        return np.asarray(found[np.ix_(self.number, self.number)])


def chunks(rows: int) -> Iterator[slice]:
    """Yield slices of rows of a fixed chunk size."""
    for start in range(0, rows, settings.CHUNK):
        yield slice(start, min(start + settings.CHUNK, rows))


@dataclass(frozen=True, eq=False)
class KernelFactor:
    """Factor B of a kernel BBᵀ: functions (N, k) × displacements (N, m, c) of each row, times ``root`` (n,).

    ``root`` are the square roots of the weights of the rows in use. Displacements (``moves``) are in units of the
    noise; (m, c) where all rows have the same.
    """

    functions: Array
    moves: Array
    used: NDArray[np.int64]
    root: Array

    def rows(self, chunk: slice) -> tuple[Array, Array]:
        """Weighted functions (r, k) and displacements of some of the rows in use."""
        which = self.used[chunk]
        moves = self.moves if self.moves.ndim == 2 else self.moves[which]
        return self.functions[which] * self.root[chunk, None], moves

    def adjoint(self, stack: Array, chunk: slice) -> Array:
        """Product Bᵀ (c k, s) with the columns (r, m, s) of some rows."""
        functions, moves = self.rows(chunk)
        carried = np.moveaxis(np.matmul(np.swapaxes(moves, -1, -2), stack), 1, 0)
        return np.asarray(equations_of(np.matmul(functions.T, carried)))

    def times(self, inner: Array, chunk: slice) -> Array:
        """Product of B with (c k, s), for some rows: (r, m, s)."""
        functions, moves = self.rows(chunk)
        carried = np.matmul(functions, inner.reshape(moves.shape[-1], functions.shape[1], inner.shape[1]))
        return np.asarray(np.matmul(moves, np.moveaxis(carried, 0, 1)))

    @property
    def wide(self) -> bool:
        """Whether B has more columns than rows."""
        return bool(len(self.used) * self.moves.shape[-2] <= self.functions.shape[1] * self.moves.shape[-1])

    def own(self) -> Array:
        """Smaller one of the Gram matrices of the factor: B Bᵀ (n m, n m) where B is wide, else BᵀB (c k, c k)."""
        if self.wide:
            functions, moves = self.rows(slice(None))
            m, c = moves.shape[-2:]
            flat = equations_of(np.broadcast_to(moves, (len(functions), m, c)))
            return np.asarray(np.repeat(np.repeat(functions @ functions.T, m, 0), m, 1) * (flat @ flat.T))
        c, count = self.moves.shape[-1], self.functions.shape[1]
        found = np.zeros((c, count, c, count))
        for chunk in chunks(len(self.used)):
            functions, moves = self.rows(chunk)
            moves = np.broadcast_to(moves, (len(functions), *moves.shape[-2:]))
            pairs = np.einsum("nac,nad->cdn", moves, moves, optimize=True)
            for i in range(c):
                for j in range(i, c):
                    found[i, :, j] += (functions * pairs[i, j][:, None]).T @ functions
        for i in range(c):
            for j in range(i + 1, c):
                found[j, :, i] = found[i, :, j].T
        return found.reshape(c * count, c * count)


Labels = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class GroupKernel:
    """Spectrum of a kernel BBᵀ with a block-diagonal factor B: c columns for each of G groups of rows.

    ``moves`` (n, m, c) are in units of the noise with the square roots of the weights, ``everywhere`` (N, m, c) without
    weights; ``values`` (G, c) and ``vector`` (G, c, c) are the eigensystem of BᵀB in every group, the sum over its rows
    of movesᵀ moves.
    """

    moves: Array
    group: NDArray[np.int64]
    everywhere: Array
    groups: NDArray[np.int64]
    values: Array = field(repr=False)
    vector: Array = field(repr=False)

    @property
    def measures(self) -> int:
        """Number m of components of a row."""
        return int(self.moves.shape[1])

    @property
    def value(self) -> Array:
        """Eigenvalues (G c,) of BBᵀ, group after group."""
        return self.values.ravel()

    @classmethod
    def of(cls, moves: Array, groups: NDArray[np.int64], weights: Array, noise: Array) -> GroupKernel:
        """Scale displacements (N, m, c) to unit mean square, in units of the noise, and decompose each group."""
        everywhere = moves / noise[:, None]
        everywhere = everywhere / np.sqrt(max(float((everywhere**2).sum(axis=2).mean()), settings.TINY))
        used = np.flatnonzero(weights > 0)
        own = everywhere[used] * np.sqrt(weights[used])[:, None, None]
        count = int(groups.max(initial=-1)) + 1
        inside = _summed(groups[used], own.transpose(0, 2, 1) @ own, count)
        value, vector = np.linalg.eigh(inside)
        return cls(own, groups[used], everywhere, groups, np.maximum(value, 0.0), vector)

    def along(self, stack: DesignMatrix) -> Array:
        """Product BᵀS (G c, U) in the eigenvectors of every group, S the distinct columns."""
        found = np.zeros((*self.values.shape, len(stack.different)))
        for groups, rows, starts in _in_chunks(self.group):
            each = self.moves[rows].transpose(0, 2, 1) @ stack.rows(rows)
            found[groups] = self.vector[groups].transpose(0, 2, 1) @ np.add.reduceat(each, starts, axis=0)
        return equations_of(found)

    def back(self, inner: Array, *, everywhere: bool = False) -> Array:
        """Product (n, m, K) of B with coefficients (G c, K) in the groups' eigenvectors; ``everywhere``: (N, m, K)."""
        turned = self.vector @ inner.reshape(*self.values.shape, inner.shape[1])
        moves, group = (self.everywhere, self.groups) if everywhere else (self.moves, self.group)
        return np.asarray(moves @ turned[group])

    def reduction(self, tau: float, rows: NDArray[np.bool_], white: Callable[[Labels], Array], floor: float) -> Array:
        """Information SᵀS − SᵀV⁻¹S that whitened columns S lose to the correlated noise V of some rows.

        See :meth:`KernelCovariance.reduction`.
        """
        above = tau**2 * self.values > floor
        unit = self.vector * np.where(above, 1.0 / np.sqrt(np.where(above, self.values, 1.0)), 0.0)[:, None, :]
        tight = 1.0 / np.where(above, tau**2 * self.values, 1.0)
        numbers, found = np.flatnonzero(rows), np.zeros((1, 1))
        for groups, which, starts in _in_chunks(self.group[numbers]):
            own = self.moves[numbers[which]] @ unit[self.group[numbers[which]]]
            turned = own.transpose(0, 2, 1)
            along = np.add.reduceat(turned @ white(numbers[which]), starts, axis=0)
            inside = np.add.reduceat(turned @ own, starts, axis=0) + tight[groups][:, :, None] * np.eye(own.shape[2])
            solved = np.asarray(np.linalg.solve(inside, along), dtype=np.float64)
            found = found + np.asarray(equations_of(along).T @ equations_of(solved))
        return found


def _in_chunks(group: Labels) -> Iterator[tuple[Labels, Labels, Labels]]:
    """Yield groups in chunks: the groups, their row numbers, and where in these each group starts."""
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    for part in chunks(len(starts)):
        own = starts[part]
        last = starts[part.stop] if part.stop < len(starts) else len(order)
        yield group[order[own]], order[own[0] : last], own - own[0]


def _summed(group: NDArray[np.int64], each: Array, count: int) -> Array:
    """Return the sums (count, ...) of rows ``each`` (n, ...) over each group."""
    found = np.zeros((count, *each.shape[1:]))
    order = np.argsort(group, kind="stable")
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    if len(first):
        found[group[order][first]] = np.add.reduceat(each[order], first, axis=0)
    return found


@dataclass(frozen=True, eq=False)
class Kernel:
    """Kernel of the discrepancy: K = B Bᵀ over all rows, B the products of functions and displacements.

    ``functions`` (N, k) are smooth in what is commanded and recorded; of one that is ``grouped`` (N,) the number of
    each pose or visit. ``moves`` (N, m, c) or, the same for all rows, (m, c): displacement of the target by each
    component, root frame axes, m and rad. ``place`` is where it enters, the first of several joints (``further``);
    empty where it may be anywhere.
    """

    name: str
    functions: Array
    moves: Array
    grouped: bool = False
    place: tuple[str, str] = ("", "")
    further: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """Kind of the kernel, the first word of its name."""
        return self.name.split(", ")[0]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that scatter in this kernel, by pose or visit; of others none."""
        kind, name = self.place
        return (name, *self.further) if self.grouped and kind == "joint" else ()

    def with_joint(self, other: Kernel, part: float) -> Kernel:
        """Sum of this kernel and that of another joint, whose rms is ``part`` of that of all joints so far."""
        length = [np.sqrt((kernel.moves**2).sum(axis=2).mean()) for kernel in (self, other)]
        moves = np.concatenate([self.moves, other.moves * (part * length[0] / max(length[1], settings.TINY))], axis=2)
        name = ", ".join((self.kind, *sorted((*self.joints, *other.joints))))
        return replace(self, name=name, moves=moves, further=(*self.further, *other.joints))

    def with_one_more(self, kernels: Iterable[Kernel]) -> list[Kernel]:
        """Return the kernels with one more joint of the same kind, at several relative sizes; none above a number."""
        if len(self.joints) >= settings.SCATTERING:
            return []
        more = [k for k in kernels if k.kind == self.kind and k.joints and k.joints[0] not in self.joints]
        return [self.with_joint(kernel, part) for kernel in more for part in settings.PARTS]

    def over(self, relative: Array | None) -> Kernel:
        """Kernel with each row divided by its relative noise (N, m); unchanged for ``None``."""
        if relative is None:
            return self
        if not self.grouped and bool((relative == relative[:, :1]).all()):
            return replace(self, functions=self.functions / relative[:, :1])
        alike = bool((relative == relative[:1]).all())  # the same for all rows, if not for all figures
        return replace(self, moves=self.moves / (relative[0, :, None] if alike else relative[:, :, None]))


@dataclass(frozen=True, eq=False)
class KernelCovariance:
    """Covariance 1 + τ²BBᵀ of the rows in use, in units of the noise, from the eigenvalues λ of BBᵀ.

    With BᵀS in the eigenvectors of BᵀB (``along``), Woodbury's identity is Sᵀ(1 + τ²BBᵀ)⁻¹S = SᵀS − (BᵀS)ᵀ w BᵀS with
    the diagonal w = τ²/(1 + τ²λ), and log|1 + τ²BBᵀ| = Σ log(1 + τ²λ).
    """

    spectrum: SmoothKernel | GroupKernel
    tau: float

    @property
    def weight(self) -> Array:
        """Diagonal weights τ²/(1 + τ²λ) in Woodbury's identity, λ the eigenvalues of BBᵀ."""
        return self.tau**2 / (1.0 + self.tau**2 * self.spectrum.value)

    def products(self, stack: DesignMatrix) -> Array:
        """Gram matrix Sᵀ (1 + τ²BBᵀ)⁻¹ S (K, K) of the columns S."""
        distinct = stack.some_columns(np.arange(len(stack.different)))
        found = self.reduced(distinct.products(), self.spectrum.along(distinct))
        return np.asarray(found[np.ix_(stack.number, stack.number)])

    def reduced(self, plain: Array, along: Array) -> Array:
        """Gram matrix Sᵀ (1 + τ²BBᵀ)⁻¹ S by Woodbury's identity, from SᵀS and BᵀS in the eigenvectors (``along``)."""
        found, weight = plain.copy(), self.weight
        for part in chunks(len(weight)):
            found -= along[part].T @ (weight[part, None] * along[part])
        return found

    def whitened(self, stack: Array) -> Array:
        """Whitened columns (1 + τ²BBᵀ)^(−½) S of (E, K); slower than :meth:`products`."""
        value = self.spectrum.value
        power = np.expm1(-0.5 * np.log1p(self.tau**2 * value)) / np.maximum(value, settings.SMOOTH_FLOOR)
        along = self.spectrum.along(DesignMatrix.from_array(stack, self.spectrum.measures))
        return stack + self.spectrum.back(power[:, None] * along).reshape(stack.shape)

    def reduction(self, rows: NDArray[np.bool_], white: Callable[[Numbers], Array], floor: float) -> Array:
        """Information SᵀS − SᵀV⁻¹S that whitened columns S lose to the correlated noise V = 1 + τ²BBᵀ of some rows.

        ``rows`` (n,) are those among the rows in use, ``white`` gives their columns (r, m, K) by row number; directions
        of τ²BBᵀ with a variance below ``floor`` are left out.
        """
        return self.spectrum.reduction(self.tau, rows, white, floor)

    @property
    def log_det(self) -> float:
        """Log determinant of the covariance, log|1 + τ²BBᵀ|."""
        return float(np.log1p(self.tau**2 * self.spectrum.value).sum())

    @property
    def degrees(self) -> float:
        """Effective degrees of freedom of the smoother: its trace."""
        return float((self.weight * self.spectrum.value).sum())

    def mean(self, left: Array) -> Array:
        """Posterior mean (N, m) of the discrepancy, in units of the noise, given the whitened residual (E,)."""
        along = self.spectrum.along(DesignMatrix.from_array(left[:, None], self.spectrum.measures))
        return self.spectrum.back(self.weight[:, None] * along, everywhere=True)[:, :, 0]


@dataclass(frozen=True, eq=False)
class SmoothKernel:
    """Spectrum of a kernel BBᵀ on the rows in use, decomposed once for every amplitude τ, without an (E, M) array.

    The (m, m) orthonormal ``axes`` are components in which the ``parts`` are apart (one part where moves differ by
    row); ``everywhere`` are the parts on all rows, without weights. ``values`` and ``vectors`` of each part: the
    eigensystem of BᵀB, or of BBᵀ where B has more columns than rows.
    """

    axes: Array
    parts: tuple[KernelFactor, ...]
    everywhere: tuple[KernelFactor, ...]
    values: tuple[Array, ...]
    vectors: tuple[Array, ...]

    @classmethod
    def of(cls, kernel: Kernel, weights: Array, noise: Array) -> SmoothKernel:
        """Scale a kernel to unit mean diagonal, in units of the noise, and decompose it."""
        used = np.flatnonzero(weights > 0)
        moves = kernel.moves / noise[:, None]
        weight = (kernel.functions**2).sum(axis=1) if moves.ndim == 3 else (kernel.functions**2).sum(axis=1).mean()
        square = (moves**2).sum(axis=-1)
        mean = (square * weight[:, None]).mean() if moves.ndim == 3 else square.mean() * weight
        moves = moves / np.sqrt(max(float(mean), settings.TINY))
        if moves.ndim == 3:
            axes, each = np.eye(len(noise)), [moves]
        else:
            value, axes = np.linalg.eigh(moves @ moves.T)
            each = list(np.sqrt(np.maximum(value, 0.0))[:, None, None])
        parts = tuple(KernelFactor(kernel.functions, own, used, np.sqrt(weights[used])) for own in each)
        every = np.arange(len(weights))
        everywhere = tuple(KernelFactor(kernel.functions, own, every, np.ones(len(every))) for own in each)
        systems = [_positive_part(part.own()) for part in parts]
        return cls(axes, parts, everywhere, tuple(v for v, _ in systems), tuple(u for _, u in systems))

    @property
    def measures(self) -> int:
        """Number m of components of a row."""
        return len(self.axes)

    @cached_property
    def value(self) -> Array:
        """Eigenvalues (R,) of BBᵀ above rounding, part after part."""
        return np.concatenate(self.values)

    def along(self, stack: DesignMatrix) -> Array:
        """Product BᵀS (R, U) in the eigenvectors of every part, S the distinct columns."""
        found = [np.zeros((len(own), len(stack.different))) for own in self.vectors]
        for chunk, rows in stack.chunks() if stack.different else ():
            for k, (part, own) in enumerate(zip(self.parts, self.apart(rows), strict=True)):
                if part.wide:
                    flat = equations_of(own)
                    found[k][chunk.start * own.shape[1] :][: len(flat)] = flat
                else:
                    found[k] += part.adjoint(own, chunk)
        for k, (part, value, vector) in enumerate(zip(self.parts, self.values, self.vectors, strict=True)):
            found[k] = vector.T @ found[k]
            if part.wide:
                found[k] *= np.sqrt(value)[:, None]
        return np.concatenate(found)

    def back(self, inner: Array, *, everywhere: bool = False) -> Array:
        """Product (n, m, K) of B with coefficients (R, K) in the parts' eigenvectors; ``everywhere``: (N, m, K)."""
        ends = np.cumsum([len(value) for value in self.values])[:-1]
        turned = []
        for part, value, vector, own in zip(self.parts, self.values, self.vectors, np.split(inner, ends), strict=True):
            if part.wide:
                own = vector @ (own / np.sqrt(value)[:, None])
                rows = own.reshape(len(part.used), len(own) // max(len(part.used), 1), own.shape[1])
                turned.append(part.adjoint(rows, slice(None)))
            else:
                turned.append(vector @ own)
        parts = self.everywhere if everywhere else self.parts
        found = np.empty((len(parts[0].used), self.measures, inner.shape[1]))
        for chunk in chunks(len(found)):
            found[chunk] = self.joined([part.times(own, chunk) for part, own in zip(parts, turned, strict=True)])
        return found

    def apart(self, rows: Array) -> list[Array]:
        """Project columns (n, m, K) on each of the axes: a part (n, 1, K) each, or the columns if there is one part."""
        if len(self.parts) == 1:
            return [rows]
        return [np.einsum("a,nak->nk", axis, rows)[:, None] for axis in self.axes.T]

    def joined(self, rows: list[Array]) -> Array:
        """Inverse of :meth:`apart`: (n, m, K)."""
        if len(self.parts) == 1:
            return rows[0]
        return np.asarray(np.einsum("aj,jnk->nak", self.axes, np.array([r[:, 0] for r in rows])))

    def reduction(self, tau: float, rows: NDArray[np.bool_], white: Callable[[Numbers], Array], floor: float) -> Array:
        """Information SᵀS − SᵀV⁻¹S that whitened columns S lose to the correlated noise V of some rows.

        See :meth:`KernelCovariance.reduction`.
        """
        above = tau**2 * self.value > floor
        basis = self.back((np.eye(len(above)) / np.sqrt(self.value))[:, above])[rows]
        basis, columns = equations_of(basis), equations_of(white(np.flatnonzero(rows)))
        along = basis.T @ columns
        inside = np.diag(1.0 / (tau**2 * self.value[above])) + basis.T @ basis
        return np.asarray(along.T @ np.linalg.solve(inside, along))


def _positive_part(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues (R,) above rounding and eigenvectors (M, R) of a positive semidefinite matrix (M, M)."""
    value, vector = np.linalg.eigh(matrix)
    kept = value > np.finfo(float).eps * len(value) * value.max(initial=0.0)
    return value[kept], vector[:, kept]


def decomposed(kernel: Kernel, weights: Array, noise: Array) -> SmoothKernel | GroupKernel:
    """Eigendecomposition, for every amplitude, of a kernel scaled to unit mean diagonal in units of the noise."""
    if not kernel.grouped:
        return SmoothKernel.of(kernel, weights, noise)
    moves = np.broadcast_to(kernel.moves, (len(kernel.functions), *kernel.moves.shape[-2:]))
    return GroupKernel.of(moves, kernel.functions.astype(np.int64), weights, noise)


def discrepancy_kernels(observations: Observations) -> tuple[Kernel, ...]:
    """Return the kernels of the discrepancy that a campaign allows: at the tool, in all places, in one place alone.

    Those per pose need repeated poses or a stated noise, those per visit repeated poses.
    """
    measures = components(observations.campaign)
    units = np.diag([settings.LEVER] * 3 + [1.0] * 3)[:measures, :measures]
    lengths = zip(settings.LENGTHS, _together(observations), strict=True)
    found = [Kernel(f"tool, {length:g}", functions, units) for length, functions in lengths]
    smooth = [v for name, v in quantities(observations).items() if not name.startswith(settings.NO_BACKGROUND)]
    functions = np.concatenate([_spectral(values) for values in smooth], axis=1)
    found.append(Kernel("places", functions, _moves(observations, measures)))
    found += _at_one_place(observations, "places", functions, measures, grouped=False)
    pose = repeated_poses(observations.campaign)
    each, repeated = pose.astype(float), int(pose.max()) + 1 < len(pose)
    if observations.campaign.noise_position is not None or repeated:
        found.append(Kernel("poses", each, units, grouped=True))
        found += _at_one_place(observations, "poses", each, measures, grouped=True)
    if repeated:
        found += _at_one_place(observations, "visits", np.arange(len(pose), dtype=float), measures, grouped=True)
    return tuple(found)


def _at_one_place(
    observations: Observations, what: str, functions: Array, measures: int, *, grouped: bool
) -> list[Kernel]:
    """Kernels with the same functions (N, k): one for each joint that moves, and one for the base."""
    moves, names = observations.joint_sensitivity[:, :measures], observations.robot.joint_names
    seen = np.flatnonzero(moving(observations.q))
    found = [Kernel(f"{what}, {names[j]}", functions, moves[:, :, [j]], grouped, ("joint", names[j])) for j in seen]
    base = observations.base_sensitivity[:, :measures]
    return [*found, Kernel(f"{what}, base", functions, base, grouped, ("base", "base"))]


def _together(observations: Observations) -> list[Array]:
    """Nyström features (N, M) of a squared-exponential kernel of joints and conditions, by length scale."""
    campaign = observations.campaign
    varying = [observations.covariates[c] for c in observations.covariates if observations.varies(c)]
    inputs = np.column_stack([campaign.q[:, moving(campaign.q)], *varying])
    inputs = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    landmarks = inputs[np.unique(np.linspace(0, len(inputs) - 1, settings.LANDMARKS).astype(int))]
    square = [cdist(points, landmarks, "sqeuclidean") for points in (inputs, landmarks)]
    result = []
    for length in settings.LENGTHS:
        cross, own = (np.exp(-0.5 * d / (length**2 * max(inputs.shape[1], 1))) for d in square)
        value, vector = np.linalg.eigh(own)
        seen = value > settings.NYSTROM_FLOOR * value[-1]
        result.append(cross @ (vector[:, seen] / np.sqrt(value[seen])))
    return result


def _moves(observations: Observations, measures: int) -> Array:
    """Displacement (N, m, c) of the target by an error of expected size in each joint, base and tool component."""
    joints = observations.joint_sensitivity[:, :measures] * settings.ERROR_AT_JOINT
    base = observations.base_sensitivity[:, :measures] * settings.ERROR_ELSEWHERE
    tool = observations.tool_sensitivity[:, :measures, :measures] * settings.ERROR_ELSEWHERE
    return np.concatenate([joints, base, tool], axis=2)


def _spectral(values: Array) -> Array:
    """Cosines (N, K) of a quantity over its range, with the amplitudes 1/k² of an integrated Wiener process."""
    u = (values - values.min()) / max(float(np.ptp(values)), settings.TINY)
    order = np.arange(1, min(settings.COSINES, len(np.unique(values)) - 1) + 1)
    return np.asarray(np.cos(np.pi * order * u[:, None]) / order**2)
