"""The layers of the browser view: floor, cameras, points, skeletons, effectors, character, ghost, trails."""

from collections.abc import Mapping

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.web.scene.character import Character
from studio.web.scene.clouds import Cloud, CloudNodes
from studio.web.scene.effectors import EffectorMarks
from studio.web.scene.frusta import Frustum, Picture
from studio.web.scene.ghost import Ghost
from studio.web.scene.palette import CAMERA_COLOURS, camera_colours
from studio.web.scene.skeletons import FusedFigure, RawSkeleton, Trail
from studio.web.scene.skin import send_frames_whole

LAYERS: dict[str, tuple[str, bool]] = {
    "character": ("Character", True),
    "fused": ("Fused skeleton", False),
    "raw": ("Raw skeletons", False),
    "effectors": ("Effectors and look", False),
    "ghost": ("Ghost", True),
    "trails": ("Trails", False),
    "points": ("Points", False),
    "cameras": ("Cameras", True),
    "floor": ("Floor", True),
}
"""Layer -> its label on the page, and whether it is shown at first."""

INSIDE = ("fused", "raw", "effectors", "points")
"""Layers in the body or on its skin; it becomes transparent for them."""

BODY = ("character", "fused", "effectors", "trails")
"""Layers that show nothing where there is no solve."""

_FOV_RAD = float(np.radians(37.0))
_FIRST_POSITION_M, _FIRST_TARGET_M = (1.5, -5.4, 2.1), (0.0, 0.0, 0.88)
"""Each browser's first viewpoint. Its page then chooses its own: `static/view/viewpoint.js`."""

_SEEN_THROUGH = 0.42
_FIGURES = ("character", "fused", "raw", "effectors", "ghost", "trails")


class Scene:
    """All objects on one viser server. Call every method from one thread, inside `server.atomic()`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        scene = server.scene
        scene.set_up_direction("+z")
        scene.configure_default_lights(enabled=True, cast_shadow=True)
        send_frames_whole(server)
        server.initial_camera.fov = _FOV_RAD
        server.initial_camera.position = _FIRST_POSITION_M
        server.initial_camera.look_at = _FIRST_TARGET_M
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
            fade_strength=1.4, fade_from="origin", shadow_opacity=0.30, plane_opacity=0.0,
        )  # a plane of its own would be lighter than a dark backdrop, and so the shadow on it  # fmt: skip
        self._character = Character(server, "/character/performer/body")
        self._ghost = Ghost(server, "/ghost/performer")
        self._trails: list[Trail] = []
        self._fused = FusedFigure(server, "/fused/performer/skeleton")
        self._effectors = EffectorMarks(server, "/effectors/performer/effectors")
        self._raw: dict[str, RawSkeleton] = {}
        self._frusta: dict[str, Frustum] = {}
        self._clouds = CloudNodes(server)
        self._calibration: Calibration | None = None
        self.colours: dict[str, tuple[int, int, int]] = {}

    def show_layer(self, layer: str, shown: bool) -> None:
        """Show or hide a layer.

        Raises:
            SettingsError: no such layer.
        """
        if layer not in LAYERS:
            raise SettingsError(
                "view.layer", "unknown layer {layer!r}; allowed: {allowed}", layer=layer, allowed=[*LAYERS]
            )
        self._layers[layer].visible = shown
        if layer in INSIDE or layer == "ghost":
            self._see_through()

    def _see_through(self) -> None:
        """Make the body transparent if skeletons are shown inside it."""
        inside = any(self.layer_shown(name) for name in INSIDE)
        inside |= self._ghost.stands_inside and self.layer_shown("ghost")
        self._character.set_opacity(_SEEN_THROUGH if inside else None)

    def layer_shown(self, layer: str) -> bool:
        """Whether a layer of `LAYERS` is shown."""
        return bool(self._layers[layer].visible)

    def use_cameras(self, names: list[str]) -> None:
        """Give every camera a colour, in this order; remove skeletons of other cameras."""
        colours = camera_colours(names)
        for name in [name for name in self._raw if colours.get(name) != self.colours.get(name)]:
            self._raw.pop(name).remove()
        redraw = colours != self.colours
        self.colours = colours
        if redraw:
            self._draw_frusta()

    def use_calibration(self, calibration: Calibration | None) -> None:
        """Show the cameras of a calibration at their poses."""
        if calibration is not self._calibration:
            self._calibration = calibration
            self._draw_frusta()

    def show_pictures(self, pictures: dict[str, Picture]) -> None:
        """Show each camera's picture in its frustum, if there is one by its name."""
        for name, frustum in self._frusta.items():
            frustum.show(pictures.get(name))

    def draw_clouds(self, clouds: Mapping[str, Cloud]) -> None:
        """Show what cameras see, as points, by camera; those of no other camera."""
        self._clouds.draw(
            {name: cloud for name, cloud in clouds.items() if name in self.colours}, self.colours
        )

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
        body = bool(np.isfinite(result.positions_m[0]).all())
        if self.layer_shown("raw"):
            self._draw_raw(result)
        if self.layer_shown("fused"):
            self._fused.draw(result.fused)
        if self.layer_shown("effectors") and body:
            self._effectors.draw(result)
        if self.layer_shown("character") and body:
            self._character.draw(result)
        self._ghost.draw(ghost, result.positions_m[0])
        for name, figure in self._figures.items():
            figure.visible = (name != "ghost" or ghost is not None) and (body or name not in BODY)

    def _draw_raw(self, result: StepResult) -> None:
        cameras = result.frame_set.cameras
        for name, positions in zip(cameras, result.frame_set.positions, strict=True):
            if name not in self._raw:
                self._raw[name] = RawSkeleton(self._server, f"/raw/performer/{name}", self.colours[name])
            self._raw[name].draw(positions)
        for name in [name for name in self._raw if name not in cameras]:
            self._raw.pop(name).remove()

    def draw_trails(self, paths_m: NDArray[np.float64]) -> None:
        """Show earlier places of joints, shape (frame_count, joint_count, 3), the newest last."""
        count = paths_m.shape[1]
        while len(self._trails) < count:
            colour = CAMERA_COLOURS[len(self._trails) % len(CAMERA_COLOURS)]
            self._trails.append(Trail(self._server, f"/trails/performer/{len(self._trails)}", colour))
        for i, trail in enumerate(self._trails):
            trail.draw(paths_m[:, i] if i < count and self.layer_shown("trails") else paths_m[:0, 0])

    def hide_performer(self) -> None:
        """Hide the performer, whom no camera has seen for a while."""
        for figure in self._figures.values():
            figure.visible = False
