"""Pinhole camera: a marker, or the corners of a board, at (u, v) in an image; the camera on the hand or in the room.

A camera in the room sees the target, or points of a board that the target carries; its pose is unknown. One on the hand
is the target itself (the hand-eye problem; Tsai and Lenz, *IEEE Transactions on Robotics and Automation* 5, 1989) and
sees a board whose pose is unknown. Either way the loop is closed by reprojection, linear start and Gauss-Newton
(Strobl and Hirzinger, IROS 2006). Intrinsics are given, and refined where that is asked for; images are undistorted.

A row is told as a displacement across the line of sight: pixels times the median distance of what a camera sees over
its focal length. That distance is held from the start: what is compared are pixels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics import exp6, homogeneous, point_jacobian
from thermal_robot.observables import settings
from thermal_robot.observables.observable import Artefact, Observable, Seen, in_mm

BOARD = ("board.x", "board.y", "board.z")
HAND = "hand"


@dataclass(frozen=True, eq=False)
class View:
    """Unknown pose of a camera in the room, or of the board that a camera on the hand sees, with the camera's lens.

    ``pose`` (4, 4) in the measurement frame; ``lens`` fx, fy, cx, cy in pixels; ``far`` m of the median point, held.
    """

    pose: Array
    lens: Array
    far: float
    refined: bool = False

    @property
    def width(self) -> int:
        """Number of free parameters: 6 of the pose, and 4 of the lens where it is refined."""
        return 10 if self.refined else 6

    @property
    def words(self) -> str:
        """Position, mm, and direction of the third axis (a camera's line of sight) in words."""
        return f"at {in_mm(self.pose[:3, 3])}, looking along {tuple((np.round(self.pose[:3, 2], 2) + 0.0).tolist())}"

    def moved(self, step: Array) -> View:
        """Return the view after a twist in its own axes and, if refined, a change of the lens in shares of fx."""
        lens = self.lens + self.lens[0] * step[6:] if self.refined else self.lens
        return replace(self, pose=self.pose @ exp6(step[:6]), lens=lens)


class Pixel(Observable):
    """Reprojection: a point of the target, or of a board that the target looks at, in an image."""

    kind: ClassVar[str] = "pixel"
    says: ClassVar[str] = "a point in an image"
    label: ClassVar[str] = "camera"
    unit: ClassVar[str] = "px"
    fewest: ClassVar[int] = 6  # a projective map has eleven unknowns, and a row says two
    places: ClassVar[int] = 2
    turned: ClassVar[bool] = True

    @staticmethod
    def _facts(seen: Seen, name: str) -> Mapping[str, Any]:
        return dict(seen.campaign.facts["camera"][name.removeprefix("camera ")])

    @staticmethod
    def _points(seen: Seen) -> Array:
        """(n, 3) observed points of the board in its own frame, m; zero where the target itself is seen."""
        if BOARD[0] not in seen.campaign.readings:
            return np.zeros_like(seen.position)
        return seen.readings(*BOARD)

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return starting poses of cameras (direct linear transformation) or of boards seen from the hand."""
        found = dict[str, Artefact]()
        for name, here in self.unplaced(seen, known):
            facts = self._facts(seen, name)
            lens = np.array([facts[key] for key in ("fx", "fy", "cx", "cy")], dtype=float)
            rays = _rays(seen.readings("u", "v")[here], lens)
            points, base = self._points(seen)[here], seen.base[:3, :3]
            turns, places = base @ seen.rotation[here], seen.where[here]
            if facts["mount"] == HAND:
                pose = _board(places, np.einsum("nij,nj->ni", turns, rays), points)
                ahead = (pose[:3, :3] @ points.T).T + pose[:3, 3] - places
            else:
                pose = _camera(places + np.einsum("nij,nj->ni", turns, points), rays)
                ahead = places - pose[:3, 3]
            far = float(np.median(np.linalg.norm(ahead, axis=1)))
            found[name] = View(pose, lens, far, bool(facts.get("refine")))
        return found

    def _looked(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, ...]:
        """Return each row's observed point in the camera's frame (n, 3) and the camera's axes in the root's (n, 3, 3).

        Then the vector (n, 3) from the target's origin to the point, root frame, m, a sign (n,), −1 for a camera on the
        hand and 1 for one in the room, lenses (n, 4), px, and held distances (n,), m.
        """
        names, number = seen.shared("camera")
        views = [artefacts[name] for name in names]
        hand = np.array([self._facts(seen, name)["mount"] == HAND for name in names])[number]
        pose, base, points = np.array([own.pose for own in views])[number], seen.base, self._points(seen)
        own = np.einsum("nij,nj->ni", pose[:, :3, :3], points) + pose[:, :3, 3] - base[:3, 3]
        board = own @ base[:3, :3] - seen.position  # of the point, from the camera on the hand
        arm = np.where(hand[:, None], board, np.einsum("nij,nj->ni", seen.rotation, points))
        room = base[:3, :3].T @ pose[:, :3, :3]
        axes = np.where(hand[:, None, None], seen.rotation, room)
        away = seen.position + arm - (pose[:, :3, 3] - base[:3, 3]) @ base[:3, :3]
        inside = np.einsum("nji,nj->ni", axes, np.where(hand[:, None], board, away))
        lens, far = (np.array(values)[number] for values in ([v.lens for v in views], [v.far for v in views]))
        return inside, axes, arm, np.where(hand, -1.0, 1.0), lens, far

    def per_metre(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n,) pixels per metre across the line of sight: focal length fx over the median distance that is held."""
        *_, lens, far = self._looked(seen, artefacts)
        return np.asarray(lens[:, 0] / far)

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) reprojection error, read − predicted, as a displacement at the held distance, root frame axes, m."""
        inside, axes, _, _, lens, far = self._looked(seen, artefacts)
        predicted = lens[:, :2] * inside[:, :2] / inside[:, 2:] + lens[:, 2:]
        away = (seen.readings("u", "v") - predicted) * far[:, None] / lens[:, :2]
        return np.asarray(np.einsum("nij,nj->ni", axes[:, :, :2], away))

    @staticmethod
    def _across(inside: Array, axes: Array, far: Array, moved: Array) -> Array:
        """(n, 3, K) displacement across the line of sight, root axes, of a point moving by (n, 3, K) in camera axes."""
        depth = inside[:, 2, None, None]
        image = (moved[:, :2] - inside[:, :2, None] / depth * moved[:, 2:]) / depth
        return np.asarray(axes[:, :, :2] @ (image * far[:, None, None]))

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) motion of the image point, as a displacement, under twists of the target or the hand's camera."""
        inside, axes, arm, sign, _, far = self._looked(seen, artefacts)
        moved = twists[:, :3] + np.cross(twists[:, 3:], arm[:, :, None], axis=1)
        found = np.zeros_like(twists)
        found[:, :3] = self._across(inside, axes, far, sign[:, None, None] * (axes.transpose(0, 2, 1) @ moved))
        return found

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of predicted − read by a camera's pose and lens or its board's pose; else zero."""
        inside, axes, _, sign, lens, far = self._looked(seen, artefacts)
        own: View = artefacts[name]
        points, turn = self._points(seen), seen.base[:3, :3].T @ own.pose[:3, :3]
        lever = np.where(sign[:, None] < 0.0, points, inside)
        twist = point_jacobian(lever)
        # the board carries its points; of a camera that moves they move the other way
        carried = axes.transpose(0, 2, 1) @ (turn @ twist)
        columns = self._across(inside, axes, far, np.where(sign[:, None, None] < 0.0, carried, -twist))
        if own.refined:
            image = np.zeros((len(points), 2, 4))
            image[:, 0, 0], image[:, 1, 1] = (inside[:, :2] / inside[:, 2:]).T
            image[:, 0, 2] = image[:, 1, 3] = 1.0
            image *= (own.lens[0] * far[:, None] / lens[:, :2])[:, :, None]
            columns = np.concatenate([columns, axes[:, :, :2] @ image], axis=2)
        names, number = seen.shared("camera")
        here = number == names.index(name)
        return np.asarray(here[:, None, None] * columns)


def _rays(pixels: Array, lens: Array) -> Array:
    """Back-project pixels (n, 2) to unit vectors (n, 3) in the camera's frame."""
    rays = np.column_stack([(pixels - lens[2:]) / lens[:2], np.ones(len(pixels))])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _rigid(linear: Array, shift: Array) -> Array:
    """(4, 4) transform: the rotation nearest to a linear map (by singular value decomposition) and a translation."""
    u, _, vt = np.linalg.svd(linear)
    return homogeneous(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt, shift)


def _board(origins: Array, rays: Array, points: Array) -> Array:
    """(4, 4) pose of a board whose points lie on rays from origins, all (n, 3): linear least squares."""
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    design = np.concatenate([np.einsum("nij,nk->nijk", across, points).reshape(len(rays), 3, 9), across], axis=2)
    told = np.einsum("nij,nj->ni", across, origins)
    found = np.linalg.lstsq(design.reshape(-1, 12), told.ravel(), rcond=None)[0]
    linear = found[:9].reshape(3, 3)
    if np.ptp(points[:, 2]) < settings.FLAT:  # a flat board tells two of its axes
        linear[:, 2] = np.cross(linear[:, 0], linear[:, 1])
    pose = _rigid(linear, found[9:])
    rest = told - np.einsum("nij,nj->ni", across, points @ pose[:3, :3].T)
    pose[:3, 3] = np.linalg.lstsq(across.reshape(-1, 3), rest.ravel(), rcond=None)[0]
    return pose


def _camera(points: Array, rays: Array) -> Array:
    """(4, 4) pose of a camera that sees points along rays of its frame, both (n, 3): direct linear transformation."""
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    projective = np.column_stack([(points - middle) / size, np.ones(len(points))])
    skew = np.cross(np.eye(3)[None], rays[:, None, :]).transpose(0, 2, 1)  # e_k × ray, column k
    design = np.einsum("nij,nk->nijk", skew, projective).reshape(-1, 12)
    found = np.linalg.svd(design)[2][-1].reshape(3, 4)
    found *= np.sign(np.linalg.det(found[:, :3])) * np.cbrt(
        1.0 / max(abs(np.linalg.det(found[:, :3])), settings.LEAST_VOLUME)
    )
    inverse = _rigid(found[:, :3], found[:, 3] * size)
    return homogeneous(inverse[:3, :3].T, middle - inverse[:3, :3].T @ inverse[:3, 3])
