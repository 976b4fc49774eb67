"""Where the 3D view looks from: all of the stage, places round the performer, going along with the performer."""

from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from studio.web.framing import Look, fit

VIEWPOINTS = ("stage", "front", "side", "top", "orbit", "follow", "free")
"""Places by name: `stage` shows all, `orbit` turns about the performer, `follow` goes along, `free` ends both."""

FOV_RAD = float(np.radians(37.0))
FIRST_LOOK = Look(np.array([1.5, -5.4, 2.1]), np.array([0.0, 0.0, 0.88]))
"""Before anything is known of the stage."""

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
"""Corners of what a performer with open arms and a camera's frustum with its name take."""

_USUAL_ASPECT = 1.45
_SETTLED_S = 1.2
_TURN_S = 24.0
_STEP_M = 0.002


def look_from_everywhere(server: viser.ViserServer, look: Look) -> None:
    """Have browsers that open the view begin here."""
    server.initial_camera.position = look.position_m
    server.initial_camera.look_at = look.target_m


def whole_stage(cameras_m: NDArray[np.float64], hips_m: NDArray[np.float64] | None, aspect: float) -> Look:
    """Return a look at the performer and all cameras; cameras_m has the shape (camera_count, 3)."""
    at = np.zeros(3) if hips_m is None else np.array([hips_m[0], hips_m[1], 0.0])
    corners = [_PERFORMER_M + at, *(_CAMERA_M + camera for camera in cameras_m)]
    return fit(np.concatenate(corners), _FROM, fov_rad=FOV_RAD, aspect=aspect)


class Viewpoint:
    """Moves the cameras of all browsers; call it from the drawing thread."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._mode = ""
        self._last: NDArray[np.float64] | None = None
        self._cameras = 0
        self._came_s: dict[int, float] = {}
        self._placed: set[int] = set()

    def choose(self, place: str) -> None:
        """Look from a place of `VIEWPOINTS` from the next `update` on."""
        self._mode, self._last = ("" if place == "free" else place), None

    def place_new_browsers(self, cameras_m: NDArray[np.float64], now_s: float) -> None:
        """Show browsers that have come, or that came before the cameras were known, the whole stage.

        A browser begins with the server's first look, made for a usual page; a moment later, since it would take its
        first look for a newer one, it gets one of its own shape.
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
        """Move the cameras; `hips_m` is where the performer is, None where there is nobody."""
        if not self._mode:
            return
        target = np.array([0.0, 0.0, _LOOK_HEIGHT_M])
        if hips_m is not None:
            target[:2] = hips_m[:2]
        if self._mode == "stage":
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
            self._last = target
        elif np.linalg.norm(target - self._last) > _STEP_M:
            self._shift(target - self._last)
            self._last = target

    def _show_stage(
        self, client: Any, cameras_m: NDArray[np.float64], hips_m: NDArray[np.float64] | None
    ) -> None:
        look = whole_stage(cameras_m, hips_m, float(client.camera.aspect))
        with client.atomic():
            client.camera.position = look.position_m
            client.camera.look_at = look.target_m

    def _look(self, position: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = target

    def _shift(self, by: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            position, target = client.camera.position + by, client.camera.look_at + by
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = target
