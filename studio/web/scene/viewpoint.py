"""Viewpoints of the 3D view: the whole stage, places round the performer, following the performer."""

from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from studio.web.scene.framing import Look, fit

VIEWPOINTS = ("stage", "motion", "front", "side", "top", "orbit", "follow", "free")
"""Places by name: `stage` shows all, `motion` the replayed motion from first to last frame, `orbit` turns about the
performer, `follow` goes along, `free` ends both."""

FOV_RAD = float(np.radians(37.0))
FIRST_LOOK = Look(np.array([1.5, -5.4, 2.1]), np.array([0.0, 0.0, 0.88]))
"""The first viewpoint, before the stage is known."""

_DISTANCE_M = 4.6
_LOOK_HEIGHT_M = 0.9
_OFFSETS = {
    "front": (0.0, -_DISTANCE_M, 0.45),
    "side": (_DISTANCE_M, 0.0, 0.45),
    "top": (0.0, -0.02, 5.6),
}
_FROM = np.array([0.34, -1.0, 0.3])
_PERFORMER_M = np.array([[x, y, z] for x in (-0.9, 0.9) for y in (-0.5, 0.5) for z in (0.0, 1.95)])
_CAMERA_M = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.3)])
"""Corners of the space of a performer with open arms, and of a camera's frustum with its name."""

_MOTION_FROM = np.array([0.3, -1.0, 0.16])
_AROUND_M = 0.12
"""So much of a body lies beyond its joints."""

_SAME_ASPECT = 0.02
_SAME_PLACE_M = 0.01
_USUAL_ASPECT = 1.45
_SETTLED_S = 1.2
_TURN_S = 24.0
_STEP_M = 0.002


def look_from_everywhere(server: viser.ViserServer, look: Look) -> None:
    """Set the first viewpoint of browsers that open the view."""
    server.initial_camera.position = look.position_m
    server.initial_camera.look_at = look.target_m


def whole_stage(cameras_m: NDArray[np.float64], hips_m: NDArray[np.float64] | None, aspect: float) -> Look:
    """Return a look at the performer and all cameras; cameras_m has the shape (camera_count, 3)."""
    at = np.zeros(3) if hips_m is None else np.array([hips_m[0], hips_m[1], 0.0])
    corners = [_PERFORMER_M + at, *(_CAMERA_M + camera for camera in cameras_m)]
    return fit(np.concatenate(corners), _FROM, fov_rad=FOV_RAD, aspect=aspect)


def whole_motion(points_m: NDArray[np.float64], aspect: float) -> Look:
    """Return a look at a motion from its first to its last frame, whose joints are at points of the shape (N, 3)."""
    return fit(_body(points_m), _MOTION_FROM, fov_rad=FOV_RAD, aspect=aspect)


def performer(hips_m: NDArray[np.float64], direction: NDArray[np.float64], aspect: float) -> Look:
    """Return a look at a performer with open arms from a direction; arrays of the shape (3,)."""
    if np.linalg.norm(direction[:2]) < 0.2 * np.linalg.norm(direction) or np.linalg.norm(direction) < 1e-6:
        direction = _MOTION_FROM  # straight from above nothing is tall
    return fit(_PERFORMER_M + np.array([*hips_m[:2], 0.0]), direction, fov_rad=FOV_RAD, aspect=aspect)


def _body(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of what bodies with joints at these points take, by cells of the floor, shape (N, 3)."""
    points = points_m[np.isfinite(points_m).all(axis=1)]
    if not len(points):
        return _PERFORMER_M
    around = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * _AROUND_M
    low, high = points.min(axis=0), points.max(axis=0)
    cells, which = np.unique(np.floor((points - low) / 0.25).astype(int), axis=0, return_index=True)
    del cells
    kept = np.concatenate([points[which], points[points.argmin(axis=0)], points[points.argmax(axis=0)]])
    ground = np.array([[low[0], low[1], 0.0], [high[0], high[1], 0.0]])
    return np.concatenate([(kept[:, None] + around).reshape(-1, 3), ground])


class Viewpoint:
    """Moves the cameras of all browsers; call it from the drawing thread."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._mode = ""
        self._last: NDArray[np.float64] | None = None
        self._cameras = 0
        self._came_s: dict[int, float] = {}
        self._placed: set[int] = set()
        self._motion_m: NDArray[np.float64] | None = None
        self._framed: dict[int, tuple[float, NDArray[np.float64]]] = {}

    def choose(self, place: str, motion_m: NDArray[np.float64] | None = None) -> None:
        """Look from a place of `VIEWPOINTS` from the next `update` on.

        Args:
            motion_m: where joints are in the replayed motion, shape (N, 3), for the place `motion`.
        """
        self._mode, self._last, self._motion_m = ("" if place == "free" else place), None, motion_m
        self._framed.clear()

    def place_new_browsers(self, cameras_m: NDArray[np.float64], now_s: float) -> None:
        """Show the whole stage to new browsers, and to those from before the cameras were known.

        A browser begins with the server's first look, made for a usual page shape. A moment later it gets one for its
        own shape; earlier, it would overwrite that with its first look.
        """
        if len(cameras_m) != self._cameras:
            self._cameras = len(cameras_m)
            look_from_everywhere(self._server, whole_stage(cameras_m, None, _USUAL_ASPECT))
            self._placed.clear()
        clients = self._server.get_clients()
        self._came_s = {id_: self._came_s.get(id_, now_s) for id_ in clients}
        self._placed &= clients.keys()
        for id_, client in clients.items():
            if id_ not in self._placed and now_s - self._came_s[id_] > _SETTLED_S and len(cameras_m):
                self._placed.add(id_)
                self._show_stage(client, cameras_m, None)

    def update(
        self, hips_m: NDArray[np.float64] | None, now_s: float, cameras_m: NDArray[np.float64] | None = None
    ) -> None:
        """Move the cameras; `hips_m` is the performer's place, None without a performer."""
        if not self._mode:
            return
        target = np.array([0.0, 0.0, _LOOK_HEIGHT_M])
        if hips_m is not None:
            target[:2] = hips_m[:2]
        if self._mode == "motion":
            self._show_motion(now_s)
        elif self._mode == "stage":
            for client in self._server.get_clients().values():
                self._show_stage(client, np.zeros((0, 3)) if cameras_m is None else cameras_m, hips_m)
            self._mode = ""
        elif self._mode in _OFFSETS:
            self._look(target + _OFFSETS[self._mode], target)
            self._mode = ""
        elif self._mode == "orbit":
            turn = 2.0 * np.pi * now_s / _TURN_S
            offset = np.array([np.sin(turn), -np.cos(turn), 0.12]) * _DISTANCE_M
            self._look(target + offset, target)
        elif self._last is None:
            if hips_m is not None:
                self._frame_performer(hips_m)
                self._last = target
        elif np.linalg.norm(target - self._last) > _STEP_M:
            self._shift(target - self._last)
            self._last = target

    def _show_stage(
        self, client: Any, cameras_m: NDArray[np.float64], hips_m: NDArray[np.float64] | None
    ) -> None:
        self._place(client, whole_stage(cameras_m, hips_m, float(client.camera.aspect)))

    def _show_motion(self, now_s: float) -> None:
        """Show the whole motion in each browser, and anew where its picture has another shape by now; a browser whose
        user has looked elsewhere since is left alone."""
        if self._motion_m is None:
            self._mode = ""
            return
        for id_, client in self._server.get_clients().items():
            if now_s - self._came_s.get(id_, now_s) <= _SETTLED_S:
                continue
            aspect = float(client.camera.aspect)
            if id_ in self._framed:
                before, position = self._framed[id_]
                moved = np.linalg.norm(client.camera.position - position) > _SAME_PLACE_M
                if moved or abs(aspect / before - 1.0) < _SAME_ASPECT:
                    continue
            look = whole_motion(self._motion_m, aspect)
            self._framed[id_] = (aspect, look.position_m)
            self._place(client, look)

    def _frame_performer(self, hips_m: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            direction = client.camera.position - client.camera.look_at
            self._place(client, performer(hips_m, direction, float(client.camera.aspect)))

    @staticmethod
    def _place(client: Any, look: Look) -> None:
        with client.atomic():
            client.camera.position = look.position_m
            client.camera.look_at = look.target_m

    def _look(self, position: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            self._place(client, Look(position, target))

    def _shift(self, by: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            self._place(client, Look(client.camera.position + by, client.camera.look_at + by))
