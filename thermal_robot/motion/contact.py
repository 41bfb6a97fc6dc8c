"""Quasi-static contact of the tool with a rigid plane, along which it slides against Coulomb friction.

Joints are springs of the servos' compliances C = diag(c). Where their motion q would pass the plane by d, the force
λ ≥ 0 along its normal n solves d = λ nᵀJ C Jᵀn. Friction f in the plane, |f| ≤ μ λ, grows as the tool's compliance
along the plane lets it, T C Tᵀ Δf = T Δ(q + C Jᵀn λ) with T = (1 − n nᵀ) J, and returns to its circle where it would
leave it (radial return: Simo and Hughes, *Computational Inelasticity*, 1998). The joints yield by C (λ Jᵀn − Tᵀf).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled


def _returned(grown, most, first, found, way, last):  # type: ignore[no-untyped-def]
    """Radial return: sum what friction has ``grown`` (n, 2) within circles (n,), and tell where it slid ``last`` (n,).

    And which ``way`` (n, 2) there.
    """
    for k in range(len(most)):
        x, y = grown[k, 0], grown[k, 1]
        if not first[k]:
            x, y, last[k] = x + found[k - 1, 0], y + found[k - 1, 1], last[k - 1]
            way[k, 0], way[k, 1] = way[k - 1, 0], way[k - 1, 1]
        size = math.hypot(x, y)
        if size > most[k]:
            way[k, 0], way[k, 1], last[k] = x / size, y / size, k
            x, y = most[k] * way[k, 0], most[k] * way[k, 1]
        found[k, 0], found[k, 1] = x, y


@cache
def _kernel() -> Any:
    return compiled(_returned)


def contact_yields(
    q: Array, tool: Array, up: Array, deep: Array, first: NDArray[np.bool_], soft: Array, limits: Array,
    friction: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return what J joints yield to contact in n instants, rad, and its derivatives by plane's height and friction.

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
    step[first] = 0.0
    rubbed, way, last = np.zeros_like(step), np.zeros_like(step), np.zeros(len(deep), dtype=np.int64)
    _kernel()(np.linalg.solve(yielding, step[:, :, None])[:, :, 0], friction * force, first, rubbed, way, last)

    def yielded(push: Array, drag: Array) -> Array:
        return np.asarray(soft * (np.einsum("ni,nij->nj", drag, along) - push[:, None] * slope))

    return (
        yielded(force, rubbed),
        yielded(stiff, friction * stiff[last, None] * way),
        yielded(np.zeros_like(force), force[last, None] * way),
    )
