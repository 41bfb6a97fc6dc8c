"""Quasi-static contact of the tool with a rigid plane, along which it slides against Coulomb friction.

Joints are springs of the servos' compliances C = diag(c). Where their motion q would pass the plane by d, the force
λ ≥ 0 along its normal n solves d = λ nᵀJ C Jᵀn. Friction f in the plane, |f| ≤ μ λ, grows as the tool's compliance
along the plane lets it, T C Tᵀ Δf = T Δ(q + C Jᵀn λ) with T = (1 − n nᵀ) J, and returns to its circle where it would
leave it (radial return: Simo and Hughes, *Computational Inelasticity*, 1998). The joints feel λ Jᵀn − Tᵀf.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled


def _returned(grown, most, first, found, last):  # type: ignore[no-untyped-def]
    """Radial return: sum what friction has ``grown`` (n, 2) within circles (n,); ``last`` (n,) rows where it slid."""
    for k in range(len(most)):
        x, y, slid = 0.0, 0.0, -1
        if not first[k]:
            x, y, slid = found[k - 1, 0] + grown[k, 0], found[k - 1, 1] + grown[k, 1], last[k - 1]
        size = np.hypot(x, y)
        if size > most[k]:
            x, y, slid = x * most[k] / size, y * most[k] / size, k
        found[k, 0], found[k, 1], last[k] = x, y, slid


@cache
def _kernel() -> Any:
    return compiled(_returned)


def contact_loads(
    q: Array, tool: Array, up: Array, deep: Array, first: NDArray[np.bool_], soft: Array, limits: Array,
    friction: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return loads of J joints by contact in n instants, N·m, and their derivatives by the plane's height and friction.

    Parameters
    ----------
    q
        (n, J) rad: where the joints would be without the plane.
    tool
        (n, 3, J) Jacobian of the tool's position.
    up
        (3,) normal of the plane, away from it.
    deep
        (n,) m by which the motion would pass the plane, positive.
    first
        (n,) instants in which the tool begins to touch; the others follow the one before.
    soft, limits
        (J,) compliances, rad/(N·m), and torques that no servo exceeds, N·m.
    friction
        Coulomb's coefficient.
    """
    slope = up @ tool
    yields = np.maximum((soft * slope**2).sum(axis=1), 1e-12)
    force = np.minimum(deep / yields, (limits / np.maximum(np.abs(slope), 1e-12)).min(axis=1))
    stiff = np.where(force < deep / yields, 0.0, 1.0 / yields)
    plane = np.linalg.svd(up[None])[2][1:]  # two directions along it
    along = plane @ tool
    turned = along * np.sqrt(soft)
    yielding = turned @ np.swapaxes(turned, 1, 2) + 1e-12 * np.eye(2)
    rested = q + soft * slope * force[:, None]
    step = np.einsum("nij,nj->ni", along, np.diff(rested, axis=0, prepend=rested[:1]))
    rubbed, last = np.zeros_like(step), np.zeros(len(deep), dtype=np.int64)
    _kernel()(np.linalg.solve(yielding, step[:, :, None])[:, :, 0], friction * force, first, rubbed, last)
    way = np.where(last[:, None] < 0, 0.0, rubbed[last] / np.maximum(friction * force[last], 1e-12)[:, None])

    def turning(push: Array, drag: Array) -> Array:
        return np.asarray(np.einsum("ni,nij->nj", drag, along) - push[:, None] * slope)

    return (
        turning(force, rubbed),
        turning(stiff, friction * stiff[last, None] * way),
        turning(np.zeros_like(force), force[last, None] * way),
    )
