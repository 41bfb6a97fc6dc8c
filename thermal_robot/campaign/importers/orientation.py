"""Measured orientations as other programs write them: quaternions, angles, vectors, matrices; one becomes the other."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.figures import no_orientation
from thermal_robot.campaign.importers.columns import Column, column_kind
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.units import ANGLE_UNITS
from thermal_robot.errors import CampaignError
from thermal_robot.schema import MisfitError, boolean, listed, record, word

QUATERNION, EULER, VECTOR, MATRIX = "quaternion", "euler", "rotation_vector", "matrix"
_COUNTS = {QUATERNION: (4,), EULER: (3,), VECTOR: (3,), MATRIX: (9, 12, 16)}
"""Columns of each kind; a matrix has three rows of three, three of four with the position last, or four of four."""
_SEQUENCES = tuple(
    "".join(axes) for letters in ("XYZ", "xyz") for axes in itertools.product(letters, repeat=3)
    if axes[0] != axes[1] != axes[2]
)  # fmt: skip
_TURNED = 0.01
"""By how much the product of a matrix with its transpose may differ from 1: figures with two decimals do."""


@dataclass(frozen=True)
class Orientation:
    """How orientations are written.

    Attributes
    ----------
    kind
        One of those above.
    columns
        Where the figures come from; of a matrix row by row.
    scalar_last
        Whether a quaternion is x y z w instead of w x y z.
    sequence
        Axes of Euler angles, in the order of the columns: capitals turn about the moving axes, small letters about
        the fixed ones.
    unit
        Of Euler angles and rotation vectors, ``"rad"`` or ``"deg"``, where no header names one.
    inverse
        Whether they turn vectors of the measurement frame into the target's.
    """

    kind: str
    columns: tuple[Column, ...]
    scalar_last: bool = False
    sequence: str = "XYZ"
    unit: str = "rad"
    inverse: bool = False

    def quaternions(self, table: Table) -> NDArray[np.float64]:
        """Return (N, 4) unit quaternions wxyz, which turn vectors of the target's frame into the measurement frame.

        Raises
        ------
        CampaignError
            No such column, a missing figure, a quaternion whose length is not 1, a matrix that is no rotation.
        """
        from scipy.spatial.transform import Rotation

        figures = np.column_stack([column.complete(table) for column in self.columns])
        if self.kind in (EULER, VECTOR):
            figures *= [ANGLE_UNITS.get(c.header_unit(table) or "", ANGLE_UNITS[self.unit]) for c in self.columns]
        if self.kind == QUATERNION:
            self._refuse(table, no_orientation(figures), "a quaternion whose length is not 1", figures)
            turned = Rotation.from_quat(figures, scalar_first=not self.scalar_last)
        elif self.kind == EULER:
            turned = Rotation.from_euler(self.sequence, figures)
        elif self.kind == VECTOR:
            turned = Rotation.from_rotvec(figures)
        else:
            matrices = figures.reshape(len(figures), -1, 3 if len(self.columns) == 9 else 4)[:, :3, :3]
            away = np.abs(matrices @ matrices.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2)) > _TURNED
            away |= np.linalg.det(matrices) < 0
            self._refuse(table, int(np.argmax(away)) if away.any() else None, "a matrix that is no rotation", figures)
            turned = Rotation.from_matrix(matrices)
        quaternions: NDArray[np.float64] = (turned.inv() if self.inverse else turned).as_quat(scalar_first=True)
        return quaternions

    def _refuse(self, table: Table, index: int | None, problem: str, figures: NDArray[np.float64]) -> None:
        if index is not None:
            raise CampaignError(
                table.file,
                problem,
                row=int(table.rows[index]),
                column=str((self.columns[0].sources or ("orientation",))[0]),
                found=", ".join(f"{figure:g}" for figure in figures[index]),
                expected="an orientation",
            )

    @property
    def position(self) -> tuple[Column, ...]:
        """The three columns of the position that a matrix of twelve or sixteen has; none elsewhere."""
        return self.columns[3:12:4] if len(self.columns) > 9 else ()


_KEYS = {
    "kind": word(_COUNTS),
    "columns": listed(column_kind),
    "order": word(("wxyz", "xyzw")),
    "sequence": word(_SEQUENCES),
    "unit": word(ANGLE_UNITS),
    "inverse": boolean,
}


def orientation_kind(value: Any, path: str) -> dict[str, Orientation]:
    """Take how orientations are written; the one entry of the section is called ``stated``."""
    if isinstance(value, Mapping) and isinstance(value.get("stated"), Orientation):
        return dict(value)
    given = record(_KEYS, may_lack=("order", "sequence", "unit", "inverse"))(value, path)
    counts = _COUNTS[given["kind"]]
    if len(given["columns"]) not in counts:
        expected = f"a list of {' or '.join(map(str, counts))} columns for a {given['kind']}"
        raise MisfitError(f"{path}.columns", value["columns"], expected)
    for key, kinds in (("sequence", (EULER,)), ("unit", (EULER, VECTOR)), ("order", (QUATERNION,))):
        if (given["kind"] in kinds) != (key in given):
            problem = "is missing" if given["kind"] in kinds else f"a {given['kind']} has none"
            raise MisfitError(f"{path}.{key}", given.get(key), "a value" if given["kind"] in kinds else "none", problem)
    plain = {key: given[key] for key in ("kind", "columns", "sequence", "unit", "inverse") if key in given}
    return {"stated": Orientation(scalar_last=given.get("order") == "xyzw", **plain)}
