"""What the browser view shows, in layers: floor, cameras, skeletons, effectors, character, ghost, trails."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.calibration.result import Calibration
from studio.engine.errors import SettingsError
from studio.engine.frames import StepResult
from studio.web.character import Character
from studio.web.effectors import Effectors
from studio.web.frusta import Frustum, Picture
from studio.web.ghost import Ghost
from studio.web.palette import CAMERA_COLOURS, camera_colours
from studio.web.skeletons import FusedFigure, RawSkeleton, Trail
from studio.web.skin import send_frames_whole
from studio.web.viewpoint import FIRST_LOOK, FOV_RAD, look_from_everywhere

LAYERS: dict[str, tuple[str, bool]] = {
    "character": ("Character", True),
    "fused": ("Fused skeleton", False),
    "raw": ("Raw skeletons", False),
    "effectors": ("Effectors and look", False),
    "ghost": ("Ghost", True),
    "trails": ("Trails", False),
    "cameras": ("Cameras", True),
    "floor": ("Floor", True),
}
"""Layer -> what the page calls it, and whether it is shown at first."""

INSIDE = ("fused", "raw", "effectors")
"""Layers that lie inside the body: it lets them show through."""

_SEEN_THROUGH = 0.42
_FIGURES = ("character", "fused", "raw", "effectors", "ghost", "trails")


class Scene:
    """All that is drawn on one viser server. Call every method from one thread, inside `server.atomic()`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        scene = server.scene
        scene.set_up_direction("+z")
        scene.configure_default_lights(enabled=True, cast_shadow=True)
        send_frames_whole(server)
        server.initial_camera.fov = FOV_RAD
        look_from_everywhere(server, FIRST_LOOK)
        self._layers = {
            name: scene.add_frame(f"/{name}", show_axes=False, visible=shown)
            for name, (_, shown) in LAYERS.items()
        }
        self._figures = {
            name: scene.add_frame(f"/{name}/performer", show_axes=False, visible=False) for name in _FIGURES
        }
        scene.add_grid(
            "/floor/grid", 8.0, 8.0, plane="xy", cell_size=0.5, section_size=1.0, cell_color=(150, 159, 170),
            section_color=(124, 134, 147), cell_thickness=0.6, section_thickness=0.9, fade_distance=9.0,
            fade_strength=1.4, fade_from="origin", shadow_opacity=0.28, plane_color=(255, 255, 255),
            plane_opacity=0.05,
        )  # fmt: skip
        self._character = Character(server, "/character/performer/body")
        self._ghost = Ghost(server, "/ghost/performer")
        self._trails: list[Trail] = []
        self._fused = FusedFigure(server, "/fused/performer/skeleton")
        self._effectors = Effectors(server, "/effectors/performer/effectors")
        self._raw: dict[str, RawSkeleton] = {}
        self._frusta: dict[str, Frustum] = {}
        self._calibration: Calibration | None = None
        self.colours: dict[str, tuple[int, int, int]] = {}

    def show_layer(self, layer: str, shown: bool) -> None:
        """Show or hide a layer.

        Raises:
            SettingsError: no such layer.
        """
        if layer not in LAYERS:
            raise SettingsError(f"unknown layer {layer!r}; allowed: {', '.join(LAYERS)}")
        self._layers[layer].visible = shown
        if layer in INSIDE or layer == "ghost":
            self._see_through()

    def _see_through(self) -> None:
        """Let the body be seen through where skeletons are shown inside it."""
        inside = any(self.layer_shown(name) for name in INSIDE)
        inside |= self._ghost.stands_inside and self.layer_shown("ghost")
        self._character.set_opacity(_SEEN_THROUGH if inside else None)

    def layer_shown(self, layer: str) -> bool:
        """Whether a layer of `LAYERS` is shown."""
        return bool(self._layers[layer].visible)

    def use_cameras(self, names: list[str]) -> None:
        """Give every camera a colour, in this order; skeletons of other cameras are taken off."""
        colours = camera_colours(names)
        for name in [name for name in self._raw if colours.get(name) != self.colours.get(name)]:
            self._raw.pop(name).remove()
        redraw = colours != self.colours
        self.colours = colours
        if redraw:
            self._draw_frusta()

    def use_calibration(self, calibration: Calibration | None) -> None:
        """Show the cameras of a calibration where they stand."""
        if calibration is not self._calibration:
            self._calibration = calibration
            self._draw_frusta()

    def show_pictures(self, pictures: dict[str, Picture]) -> None:
        """Show in each camera's frustum what it sees, if there is a picture by its name."""
        for name, frustum in self._frusta.items():
            frustum.show(pictures.get(name))

    def camera_places_m(self) -> NDArray[np.float64]:
        """Return where the calibrated cameras stand, shape (camera_count, 3)."""
        cameras = {} if self._calibration is None else self._calibration.cameras
        return np.array([camera.T_stage_camera[:3, 3] for camera in cameras.values()]).reshape(-1, 3)

    def _draw_frusta(self) -> None:
        for frustum in self._frusta.values():
            frustum.remove()
        cameras = {} if self._calibration is None else self._calibration.cameras
        fallback = camera_colours(tuple(cameras))
        self._frusta = {
            name: Frustum(
                self._server, f"/cameras/{name}", name, self.colours.get(name, fallback[name]), camera
            )
            for name, camera in cameras.items()
        }

    def draw(self, result: StepResult, ghost: StepResult | None = None) -> None:
        """Show one step of the pipeline, and a second figure beside it."""
        cameras = result.frame_set.cameras
        if any(name not in self.colours for name in cameras):
            self.use_cameras([*self.colours, *(name for name in cameras if name not in self.colours)])
        if self.layer_shown("raw"):
            self._draw_raw(result)
        if self.layer_shown("fused"):
            self._fused.draw(result.fused)
        if self.layer_shown("effectors"):
            self._effectors.draw(result)
        if self.layer_shown("character"):
            self._character.draw(result)
        self._ghost.draw(ghost, result.positions_m[0])
        for name, figure in self._figures.items():
            figure.visible = name != "ghost" or ghost is not None

    def _draw_raw(self, result: StepResult) -> None:
        cameras = result.frame_set.cameras
        for name, positions in zip(cameras, result.frame_set.positions, strict=True):
            if name not in self._raw:
                self._raw[name] = RawSkeleton(self._server, f"/raw/performer/{name}", self.colours[name])
            self._raw[name].draw(positions)
        for name in [name for name in self._raw if name not in cameras]:
            self._raw.pop(name).remove()

    def draw_trails(self, paths_m: NDArray[np.float64]) -> None:
        """Show where joints were, shape (frame_count, joint_count, 3), the newest last."""
        count = paths_m.shape[1]
        while len(self._trails) < count:
            colour = CAMERA_COLOURS[len(self._trails) % len(CAMERA_COLOURS)]
            self._trails.append(Trail(self._server, f"/trails/performer/{len(self._trails)}", colour))
        for i, trail in enumerate(self._trails):
            trail.draw(paths_m[:, i] if i < count and self.layer_shown("trails") else paths_m[:0, 0])

    def hide_performer(self) -> None:
        """Show nobody: no camera has seen a performer for a while."""
        for figure in self._figures.values():
            figure.visible = False
