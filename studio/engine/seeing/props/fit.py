"""The pose of a prop that explains what cameras see at an instant.

Two residuals form a least-squares problem in the prop's pose. Points near the prop should lie on its surface (signed
distance, robust). No visible part of its surface should lie where a camera looks through: the residual is that part's
distance from the nearest pixel of the prop. The first determines a prop's place across its length, the second also
along it.
Sources: Fitzgibbon, "Robust registration of 2D and 3D point sets", 2003 (distance transform, Levenberg-Marquardt);
Schmidt et al., "DART", 2014 (signed distances together with free space).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from studio.engine.base.geometry import transform_points
from studio.engine.model.rigid_body import RigidShape
from studio.engine.seeing.props.sight import SeenImage
from studio.engine.seeing.props.solid import distances_m, surface, turns_of

Array = NDArray[np.float64]

_SIGMA_M = 0.01
_ALIKE = 8.0
"""Pixels that count as one, because errors of neighbours are correlated."""

_GATE_M = 0.10
_BESIDE_M = 0.07
_THROUGH_M = 0.06
"""A camera sees through a place if it sees a surface at least this far behind it."""

_MOST_OFF_M = 0.10
_MOST_POINTS = 200
_SAMPLES = 100
_ON_M = 0.02
_STEPS, _WIDE = 9, 3
_TURN_STEP, _STEP_M = 2e-3, 1e-3


@dataclass(frozen=True)
class PropPose:
    """A prop at an instant, in the stage frame: its origin [m], shape (3,), its rotation, shape (3, 3), and its
    velocities [m/s, rad/s]."""

    place_m: Array
    turn: Array
    speed_m_s: Array
    spin_rad_s: Array

    @staticmethod
    def still(place_m: Array, turn: Array) -> "PropPose":
        """Return a prop that does not move."""
        return PropPose(np.asarray(place_m, np.float64), turn, np.zeros(3), np.zeros(3))

    def after(self, seconds: float) -> "PropPose":
        """Return the prop's pose after a time, at constant velocities."""
        turned = turned_by(self.spin_rad_s * seconds) @ self.turn
        return replace(self, place_m=self.place_m + self.speed_m_s * seconds, turn=turned)


@dataclass(frozen=True)
class Fitted:
    """A pose, and how well it explains what is seen.

    Attributes:
        on: number of pixels on the surface.
        beside: number of pixels outside the surface but near it, without hands.
        share: of the visible surface that was seen, 0..1.
        visible: share of the surface that faces cameras and is not occluded, 0..1.
    """

    pose: PropPose
    on: int
    beside: int
    share: float
    visible: float

    @property
    def holds(self) -> bool:
        """Whether the prop was seen there."""
        return self.on >= 12 and self.share >= 0.5 and self.visible >= 0.1 and self.beside < 1.5 * self.on

    @property
    def doubtful(self) -> bool:
        """Whether another pose may explain more."""
        return not self.holds or self.share < 0.75 or self.beside > 0.25 * self.on

    @property
    def worth(self) -> float:
        """Score of the pose; larger is better."""
        return (self.on - self.beside) * self.share


def turned_by(vector_rad: Array) -> Array:
    """Return the rotation matrix of a rotation vector, shape (3,). Source: Rodrigues' formula."""
    angle = math.sqrt(float(vector_rad @ vector_rad))
    if angle < 1e-9:
        return np.eye(3)
    x, y, z = (vector_rad / angle).tolist()
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)


def _sines(turn: Array) -> Array:
    """Return the axis of a rotation times the sine of its angle, shape (3,)."""
    return 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])


class PropFit:
    """Fits one shape."""

    def __init__(self, shape: RigidShape) -> None:
        self.shape = shape
        self._places, self._normals = surface(shape, _SAMPLES)
        self._turns = turns_of(shape)

    def fit(
        self, images: Sequence[SeenImage], first: PropPose, sigma_m: float = 0.03, sigma_rad: float = 0.2
    ) -> Fitted:
        """Return the best pose near `first`, which is a prior with these standard deviations."""
        views = [_FitView(one, self.shape, first) for one in images]
        pose, damping = first, 1e-3
        for step in range(_STEPS):
            scale = 0.025 if step < _WIDE else 0.012
            r, J = self._linear(views, pose, first, scale, sigma_m, sigma_rad)
            cost = float(r @ r)
            H, g = J.T @ J, J.T @ r
            move = -np.asarray(np.linalg.solve(H + damping * np.diag(np.diag(H)), g), np.float64)
            there = self._moved(pose, move)
            after = self._residuals(views, there, first, scale, sigma_m, sigma_rad)
            if float(after @ after) < cost:
                pose, damping = there, damping * 0.3
            else:
                damping *= 10.0
            if np.abs(move[:3]).max() < 5e-4 and np.abs(move[3:]).max(initial=0.0) < 2e-3 and step > _WIDE:
                break
        return self.judge(images, pose, views)

    def judge(
        self, images: Sequence[SeenImage], pose: PropPose, views: "Sequence[_FitView] | None" = None
    ) -> Fitted:
        """Return how well a pose explains what is seen."""
        on = beside = 0
        good = facing = clear = 0
        for view in [_FitView(one, self.shape, pose) for one in images] if views is None else views:
            there = pose.after(view.image.after_s)
            d = distances_m(self.shape, (view.near_m - there.place_m) @ there.turn)
            on += int((np.abs(d) < _ON_M).sum() * view.every)
            beside += int(((d > 1.25 * _ON_M) & (d < _BESIDE_M) & (view.weights > 0.5)).sum() * view.every)
            off, hidden, faces = view.off_m(*self._surface(there), there.place_m)
            facing += int(faces.sum())
            clear += int((faces & ~hidden).sum())
            good += int((faces & ~hidden & (off < 1.2 * _ON_M)).sum())
        share = good / clear if clear else 0.0
        return Fitted(pose, on, beside, share, clear / max(facing, 1))

    def _surface(self, pose: PropPose) -> tuple[Array, Array]:
        return self._places @ pose.turn.T + pose.place_m, self._normals @ pose.turn.T

    def _moved(self, pose: PropPose, move: Array) -> PropPose:
        turn = pose.turn
        if len(self._turns):
            turn = pose.turn @ turned_by(move[3:] @ self._turns)
        return replace(pose, place_m=pose.place_m + move[:3], turn=turn)

    def _linear(
        self, views: "list[_FitView]", pose: PropPose, first: PropPose, scale: float, *sigmas: float
    ) -> tuple[Array, Array]:
        r = self._residuals(views, pose, first, scale, *sigmas)
        columns = []
        for k in range(3 + len(self._turns)):
            move = np.zeros(3 + len(self._turns))
            step = _STEP_M if k < 3 else _TURN_STEP
            move[k] = step
            there = self._residuals(views, self._moved(pose, move), first, scale, *sigmas)
            columns.append((there - r) / step)
        return r, np.stack(columns, axis=1)

    def _residuals(
        self,
        views: "list[_FitView]",
        pose: PropPose,
        first: PropPose,
        scale: float,
        sigma_m: float,
        sigma_rad: float,
    ) -> Array:
        found = []
        for view in views:
            there = pose.after(view.image.after_s)
            d = distances_m(self.shape, (view.near_m - there.place_m) @ there.turn)
            bent = scale * np.sqrt(np.log1p((d / scale) ** 2))  # Cauchy's cost
            found.append(np.sqrt(view.weights * view.every / _ALIKE) * bent / _SIGMA_M)
            off, hidden, faces = view.off_m(*self._surface(there), there.place_m)
            counts = view.pixels_each / _ALIKE
            found.append(np.sqrt(counts) * np.where(hidden | ~faces, 0.0, off) / _SIGMA_M)
        found.append((pose.place_m - first.place_m) / sigma_m)
        if len(self._turns):
            between = first.turn.T @ pose.turn
            found.append(self._turns @ _sines(between) / sigma_rad)
        return np.concatenate(found)


class _FitView:
    """An image as one fit uses it: points near the prop, and each pixel's distance from the nearest of them."""

    def __init__(self, image: SeenImage, shape: RigidShape, first: PropPose) -> None:
        self.image = image
        there = first.after(image.after_s)
        d = distances_m(shape, (image.points_m - there.place_m) @ there.turn)
        near = d < _GATE_M
        self.every = max(1.0, near.sum() / _MOST_POINTS)
        chosen = np.unique(np.linspace(0, near.sum() - 1, min(near.sum(), _MOST_POINTS)).round().astype(int))
        self.near_m, self.weights = image.points_m[near][chosen], image.weights[near][chosen]
        centre = transform_points(image.T_camera_stage, there.place_m[None])[0]
        z = max(float(centre[2]), 0.3)
        pixel_m = z / image.camera.fx
        edges = np.sort(shape.edges_m)
        self.pixels_each = max(edges[2] * max(edges[1], pixel_m) / pixel_m**2 / (_SAMPLES / 2), 0.2)
        self._pixel_m = pixel_m
        pad = int(2 * _MOST_OFF_M / pixel_m) + 2
        corners = there.place_m + (np.linalg.norm(edges) / 2) * np.array(
            [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        )
        corners = transform_points(image.T_camera_stage, corners)
        corners[:, 2] = np.maximum(corners[:, 2], 0.2)
        at = image.camera.pixels_of(corners)
        tall, wide = image.z_m.shape
        low = np.clip(at.min(axis=0).astype(int) - pad, 0, [wide - 1, tall - 1])
        high = np.clip(at.max(axis=0).astype(int) + pad, low + 1, [wide, tall])
        self._low = low
        mask = np.ones((high[1] - low[1], high[0] - low[0]), bool)
        rows, columns = (image.pixels[near] - low[::-1]).T
        inside = (rows >= 0) & (columns >= 0) & (rows < mask.shape[0]) & (columns < mask.shape[1])
        mask[rows[inside], columns[inside]] = False
        self._any = not mask.all()
        self._off = distance_transform_edt(mask) * pixel_m if self._any else np.full(mask.shape, _MOST_OFF_M)

    def off_m(
        self, places: Array, normals: Array, middle: Array
    ) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return for points of the surface: distance from where the prop was seen [m]; whether they are occluded, at
        a performer or out of view; whether they face the camera."""
        image = self.image
        local = transform_points(image.T_camera_stage, places)
        faces = np.einsum("ij,ij->i", normals, image.eye_m - places) > 0
        z = np.maximum(local[:, 2], 0.1)
        at = image.camera.pixels_of(np.column_stack([local[:, :2], z]))
        tall, wide = image.z_m.shape
        column, row = np.round(at).astype(int).T
        inside = (row >= 0) & (column >= 0) & (row < tall) & (column < wide) & (local[:, 2] > 0.2)
        seen = image.z_m[np.clip(row, 0, tall - 1), np.clip(column, 0, wide - 1)]
        hidden = ~inside | ((seen > 0) & (seen < z - _THROUGH_M))
        off = map_coordinates(self._off, (at - self._low).T[::-1], order=1, mode="nearest")
        off = np.maximum(off - self._pixel_m, 0.0)
        at_body = (seen > 0) & (np.abs(seen - z) <= _THROUGH_M) & (off > 0)
        return np.minimum(off, _MOST_OFF_M), hidden | at_body, faces
