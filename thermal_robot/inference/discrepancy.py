"""What no effect and no law accounts for: a smooth discrepancy in the rows' covariance (Kennedy and O'Hagan 2001).

The whitened gap is y = F f + X θ + δ + e with e ~ N(0, s²) and δ ~ N(0, s² τ² K). K has one of several forms, each of
mean one on its diagonal, so that τ is the discrepancy's rms over the noise:

* ``tool``: the target moves by a smooth function of all joint positions and conditions together;
* ``places``: each joint, the base and the tool err by a sum of smooth functions of single quantities,
  K = Σ_p J_p k_p J_pᵀ;
* ``poses``: what a pose brings, anew for each pose and the same at every visit.

Sources: M. C. Kennedy, A. O'Hagan, *J. R. Statist. Soc. B* 63 (2001), eq. 4; low rank: Rasmussen and Williams,
*Gaussian Processes for Machine Learning*, 2006, 8.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.rows import repeated_poses
from thermal_robot.observations import Observations

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Form:
    """One form of the discrepancy: K = B Bᵀ over all rows, B the products of functions and moves.

    Attributes
    ----------
    name
        ``tool``, ``places``, ``poses``.
    functions
        (N, k) smooth functions of what is commanded and recorded.
    moves
        (N, m, c) how far a unit of each of c components moves the target, root frame axes, m and rad; (m, c) where that
        is the same for all rows: K is then a product of one matrix of the rows and one of the components.
    """

    name: str
    functions: Array
    moves: Array

    @property
    def columns(self) -> Array:
        """(N, m, k c) B."""
        rows, count = self.functions.shape
        moves = np.broadcast_to(self.moves, (rows, *self.moves.shape[-2:]))
        columns = self.functions[:, None, :, None] * moves[:, :, None, :]
        return np.asarray(columns.reshape(rows, moves.shape[1], count * moves.shape[2]))


@dataclass(frozen=True, eq=False)
class Smooth:
    """The correlated part of the rows' covariance, in units of the noise: 1 + U diag(d) Uᵀ on the rows in use.

    Attributes
    ----------
    columns
        (N, m, M) B of all rows, in units of the noise.
    tau
        τ, by which it is multiplied.
    basis
        (E, r) U, orthonormal, on the equations of the rows in use.
    variance
        (r,) d.
    """

    columns: Array
    tau: float
    basis: Array
    variance: Array

    def whitened(self, stack: Array) -> Array:
        """Return (1 + U d Uᵀ)^(−½) times (E, K) columns."""
        shrink = 1.0 - 1.0 / np.sqrt(1.0 + self.variance)
        return np.asarray(stack - self.basis @ (shrink[:, None] * (self.basis.T @ stack)))

    @property
    def log_det(self) -> float:
        """log|1 + U d Uᵀ|."""
        return float(np.log1p(self.variance).sum())

    @property
    def degrees(self) -> float:
        """How many equations the discrepancy follows: the trace of its smoother."""
        return float((self.variance / (1.0 + self.variance)).sum())

    def mean(self, left: Array, root: Array, used: NDArray[np.int64]) -> Array:
        """(N, m) posterior mean of the discrepancy, in units of the noise, given the residual of the rows in use.

        Parameters
        ----------
        left
            (E,) residual of the rows in use, whitened by weights and noise alone.
        root
            (n,) square root of the weights of the rows in use.
        used
            (n,) their numbers.
        """
        along = self.basis.T @ left
        solved = left - self.basis @ (self.variance / (1.0 + self.variance) * along)
        rows = self.columns[used] * root[:, None, None]
        inner = rows.reshape(len(left), -1).T @ solved
        return np.asarray(self.columns @ inner) * self.tau**2


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One form on the rows in use, decomposed once for all τ: columns (N, m, M), basis (E, r) and values (r,)."""

    columns: Array
    basis: Array
    value: Array

    @classmethod
    def of(cls, form: Form, weights: Array, noise: Array) -> Spectrum:
        """Scale a form to a mean of one on its diagonal, in units of the noise, and decompose it."""
        columns = form.columns / noise[:, None]
        scale = 1.0 / np.sqrt(max(float((columns**2).sum(axis=2).mean()), settings.TINY))
        columns *= scale
        used = np.flatnonzero(weights > 0)
        root = np.sqrt(weights[used])
        if form.moves.ndim == 2:
            rows = _decomposed(form.functions[used] * root[:, None])
            parts = _decomposed(form.moves / noise[:, None] * scale)
            basis: Array = np.kron(rows[0], parts[0])
            value: Array = np.kron(rows[1], parts[1])
        else:
            basis, value = _decomposed((columns[used] * root[:, None, None]).reshape(-1, columns.shape[2]))
        seen = value > settings.SMOOTH_FLOOR
        return cls(columns, basis[:, seen], value[seen])

    def at(self, tau: float) -> Smooth:
        """Return the covariance with a discrepancy of rms τ over the noise."""
        return Smooth(self.columns, tau, self.basis, self.value * tau**2)


def _decomposed(flat: Array) -> tuple[Array, Array]:
    """Return U and d of B Bᵀ = U d Uᵀ, from the smaller of the two products."""
    if flat.shape[0] <= flat.shape[1]:
        value, basis = np.linalg.eigh(flat @ flat.T)
        return basis, np.maximum(value, 0.0)
    value, vector = np.linalg.eigh(flat.T @ flat)
    seen = value > settings.SEEN * value.max(initial=settings.TINY)
    return flat @ (vector[:, seen] / np.sqrt(value[seen])), value[seen]


def forms(observations: Observations) -> tuple[Form, ...]:
    """Return the forms of the discrepancy that a campaign allows."""
    measures = 6 if observations.campaign.measures == "pose" else 3
    units = np.diag([settings.LEVER] * 3 + [1.0] * 3)[:measures, :measures]
    found = [Form("tool", functions, units) for functions in _together(observations)]
    functions = [_spectral(values) for values in quantities(observations).values()]
    found.append(Form("places", np.concatenate(functions, axis=1), _moves(observations, measures)))
    pose = repeated_poses(observations.campaign)
    count = int(pose.max()) + 1
    if observations.campaign.noise_position is not None or count < len(pose):
        found.append(Form("poses", np.eye(count)[pose], units))
    return tuple(found)


def _together(observations: Observations) -> list[Array]:
    """(N, M) features of a squared exponential of all joint positions and conditions, for each length scale.

    Low rank by Nyström's method with rows evenly drawn as landmarks.
    """
    campaign = observations.campaign
    varying = [observations.covariates[c] for c in observations.covariates if observations.varies(c)]
    inputs = np.column_stack([campaign.q, *varying])
    inputs = inputs[:, np.ptp(inputs, axis=0) > 0.0]
    inputs = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    landmarks = inputs[np.unique(np.linspace(0, len(inputs) - 1, settings.LANDMARKS).astype(int))]
    square = _distance2(inputs, landmarks), _distance2(landmarks, landmarks)
    result = []
    for length in settings.LENGTHS:
        cross, own = (np.exp(-0.5 * d / (length**2 * max(inputs.shape[1], 1))) for d in square)
        value, vector = np.linalg.eigh(own)
        seen = value > settings.NYSTROM_FLOOR * value[-1]
        result.append(cross @ (vector[:, seen] / np.sqrt(value[seen])))
    return result


def _distance2(a: Array, b: Array) -> Array:
    return np.asarray(((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2))


def _moves(observations: Observations, measures: int) -> Array:
    """(N, m, c) what a unit error in each joint, and in each component at the base and the tool, does to the target."""
    joints = observations.joint_sensitivity[:, :measures] * settings.ERROR_AT_JOINT
    base = observations.base_sensitivity[:, :measures] * settings.ERROR_ELSEWHERE
    tool = observations.tool_sensitivity[:, :measures, :measures] * settings.ERROR_ELSEWHERE
    return np.concatenate([joints, base, tool], axis=2)


def _spectral(values: Array) -> Array:
    """(N, K) cosines of a quantity over its range, their amplitudes those of an integrated Wiener process (1/k²)."""
    u = (values - values.min()) / max(float(np.ptp(values)), settings.TINY)
    order = np.arange(1, min(settings.COSINES, len(np.unique(values)) - 1) + 1)
    return np.asarray(np.cos(np.pi * order * u[:, None]) / order**2)
