"""What the browser view shows, in layers: floor, cameras, raw skeletons, fused skeleton, character, ghost, trails."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.calibration.result import Calibration
from studio.engine.errors import SettingsError
from studio.engine.frames import StepResult
from studio.web.character import Character
from studio.web.palette import CAMERA_COLOURS, GHOST_OPACITY, GHOST_RGB, camera_colours
from studio.web.skeletons import Frustum, FusedFigure, RawSkeleton, Trail

LAYERS: dict[str, tuple[str, bool]] = {
    "character": ("Character", True),
    "fused": ("Fused", True),
    "raw": ("Raw", True),
    "ghost": ("Ghost", True),
    "trails": ("Trails", False),
    "cameras": ("Cameras", True),
    "floor": ("Floor", True),
}
"""Layer -> what the page calls it, and whether it is shown at first."""

_BACKGROUND_TOP, _BACKGROUND_BOTTOM = (226, 229, 233), (240, 242, 244)


class Scene:
    """All that is drawn on one viser server. Call every method from one thread, inside `server.atomic()`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        scene = server.scene
        scene.set_up_direction("+z")
        scene.set_background_image(_gradient(), format="png")
        scene.configure_default_lights(enabled=True, cast_shadow=True)
        server.initial_camera.position = (1.5, -5.4, 2.1)
        server.initial_camera.look_at = (0.0, 0.0, 0.88)
        server.initial_camera.fov = float(np.radians(37.0))
        self._layers = {
            name: scene.add_frame(f"/{name}", show_axes=False, visible=shown)
            for name, (_, shown) in LAYERS.items()
        }
        self._figures = {
            name: scene.add_frame(f"/{name}/performer", show_axes=False, visible=False)
            for name in ("character", "fused", "raw", "ghost", "trails")
        }
        scene.add_grid(
            "/floor/grid", 8.0, 8.0, plane="xy", cell_size=0.5, section_size=1.0, cell_color=(206, 211, 217),
            section_color=(182, 188, 197), cell_thickness=0.7, section_thickness=1.0, fade_distance=14.0,
            fade_strength=1.2, fade_from="origin", shadow_opacity=0.16,
        )  # fmt: skip
        self._character = Character(server, "/character/performer/body")
        self._ghost: Character | None = None  # made when a second solve is first shown
        self._trails: list[Trail] = []
        self._fused = FusedFigure(server, "/fused/performer/skeleton")
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
        """Show one step of the pipeline, and the character of another beside it."""
        cameras = result.frame_set.cameras
        if any(name not in self.colours for name in cameras):
            self.use_cameras([*self.colours, *(name for name in cameras if name not in self.colours)])
        for name, positions in zip(cameras, result.frame_set.positions, strict=True):
            if name not in self._raw:
                self._raw[name] = RawSkeleton(self._server, f"/raw/performer/{name}", self.colours[name])
            self._raw[name].draw(positions)
        for name in [name for name in self._raw if name not in cameras]:
            self._raw.pop(name).remove()
        self._fused.draw(result.fused)
        self._character.draw(result.positions_m, result.rotations_wxyz)
        if ghost is not None:
            if self._ghost is None:
                self._ghost = Character(
                    self._server, "/ghost/performer/body", tint=GHOST_RGB, opacity=GHOST_OPACITY
                )
            self._ghost.draw(ghost.positions_m, ghost.rotations_wxyz)
        for name, figure in self._figures.items():
            figure.visible = name != "ghost" or ghost is not None

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


def _gradient() -> np.ndarray:
    """A soft light backdrop, shape (64, 4, 3)."""
    t = np.linspace(0.0, 1.0, 64)[:, None, None]
    rows = np.array(_BACKGROUND_TOP) * (1 - t) + np.array(_BACKGROUND_BOTTOM) * t
    return np.broadcast_to(rows, (64, 4, 3)).round().astype(np.uint8)
