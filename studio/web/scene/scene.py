"""The layers of the browser view: floor, cameras, points, skeletons, effectors, character, ghost, trails,
rigid bodies, markers."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import JOINT_COUNT
from studio.web.scene.bodies import BodyNodes
from studio.web.scene.clouds import Cloud, CloudNodes
from studio.web.scene.frusta import Frustum, Picture
from studio.web.scene.markers import MarkerNodes
from studio.web.scene.palette import STRANGER_RGB, camera_colours
from studio.web.scene.performers.figure import PerformerFigure
from studio.web.scene.performers.names import name_places
from studio.web.scene.performers.robot import ChosenRobot
from studio.web.scene.performers.skeletons import RawSkeleton
from studio.web.scene.performers.skin import send_frames_whole

LAYERS: dict[str, tuple[str, bool]] = {
    "character": ("Character", True),
    "fused": ("Fused skeleton", False),
    "raw": ("Raw skeletons", False),
    "effectors": ("Effectors and look", False),
    "ghost": ("Ghost", True),
    "trails": ("Trails", False),
    "bodies": ("Rigid bodies, markers", True),
    "points": ("Points", False),
    "cameras": ("Cameras", True),
    "floor": ("Floor", True),
}
"""Layer -> its label on the page, and whether it is shown at first."""

INSIDE = ("fused", "raw", "effectors", "points")
"""Layers in the body or on its skin; the body becomes transparent for them."""

_FOV_RAD = float(np.radians(37.0))
_FIRST_POSITION_M, _FIRST_TARGET_M = (1.5, -5.4, 2.1), (0.0, 0.0, 0.88)
"""Each browser's first viewpoint. Its page then chooses its own: `static/view/viewpoint.js`."""

_SUN_M, _SUN_ANGLE_RAD = (2.4, 2.4, 12.0), 0.5
"""Place of the light that casts shadows, and half its opening: it reaches 6.5 m around the middle of the stage."""

_CEILING_M = (-8.0, 24.0, 97.0)
"""Place of the room's light without shadows: far away, because only its direction counts."""

_SEEN_THROUGH = 0.42
_NO_NAMES: Mapping[int, str] = MappingProxyType({})
_NO_TRAILS: Mapping[int, NDArray[np.float64]] = MappingProxyType({})
_NO_ROBOTS: Mapping[int, NDArray[np.float64]] = MappingProxyType({})
_NO_TRAIL = np.zeros((0, 0, 3))
_NO_JOINTS = np.full((JOINT_COUNT, 3), np.nan)


class Scene:
    """All objects on one viser server. Call every method from one thread, inside `server.atomic()`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        scene = server.scene
        scene.set_up_direction("+z")
        _light(scene)
        send_frames_whole(server)
        server.initial_camera.fov = _FOV_RAD
        server.initial_camera.position = _FIRST_POSITION_M
        server.initial_camera.look_at = _FIRST_TARGET_M
        self._layers = {
            name: scene.add_frame(f"/{name}", show_axes=False, visible=shown)
            for name, (_, shown) in LAYERS.items()
        }
        scene.add_grid(
            "/floor/grid", 8.0, 8.0, plane="xy", cell_size=0.5, section_size=1.0, cell_color=(150, 159, 170),
            section_color=(124, 134, 147), cell_thickness=0.6, section_thickness=0.9, fade_distance=9.0,
            fade_strength=1.4, fade_from="origin", shadow_opacity=0.30, plane_opacity=0.0,
        )  # its own plane would be lighter than a dark backdrop, and so would the shadow on it  # fmt: skip
        self._figures: dict[int, PerformerFigure] = {}
        self._robot: ChosenRobot | None = None
        self._strangers: list[RawSkeleton] = []
        self._bodies, self._markers = BodyNodes(server), MarkerNodes(server)
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
        inside |= self.layer_shown("ghost") and any(one.stands_inside for one in self._figures.values())
        for figure in self._figures.values():
            figure.set_opacity(_SEEN_THROUGH if inside else None)

    def layer_shown(self, layer: str) -> bool:
        """Whether a layer of `LAYERS` is shown."""
        return bool(self._layers[layer].visible)

    def use_cameras(self, names: list[str]) -> None:
        """Give every camera a colour, in this order; remove skeletons of other cameras."""
        colours = camera_colours(names)
        same = [name for name, rgb in colours.items() if self.colours.get(name) == rgb]
        for figure in self._figures.values():
            figure.keep_raw(same)
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
        """Show the cameras' points, by camera, and those of no other camera."""
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

    def draw(
        self,
        result: StepResult,
        ghost: StepResult | None = None,
        *,
        names: Mapping[int, str] = _NO_NAMES,
        trails: Mapping[int, NDArray[np.float64]] = _NO_TRAILS,
        robots: Mapping[int, NDArray[np.float64]] = _NO_ROBOTS,
    ) -> None:
        """Show one step of the pipeline: every performer in `result.each()`; other performers are hidden.

        Args:
            result: the step.
            ghost: a second step, with each figure next to its performer.
            names: of performers, by number: a performer with a name is drawn in their own colour, with the name over
                the head. A single performer needs none.
            trails: earlier places of joints by the performer's number, shape (frame_count, joint_count, 3), the
                newest last.
            robots: configurations of the robot by the performer's number; without one it follows the step.
        """
        steps = {one.performer: one for one in result.each()}
        beside = {} if ghost is None else {one.performer: one for one in ghost.each()}
        unknown = sorted({name for one in steps.values() for name in one.frame_set.cameras} - {*self.colours})
        if unknown:
            self.use_cameras([*self.colours, *unknown])
        places = name_places(steps) if names else {}
        for number, one in steps.items():
            figure = self._figure(number)
            figure.call(names.get(number))
            figure.draw(
                one,
                beside.get(number),
                shown=self.layer_shown,
                colours=self.colours,
                name_at=places.get(number),
                robot_q=robots.get(number),
            )
            if self.layer_shown("trails"):
                figure.draw_trails(trails.get(number, _NO_TRAIL))
        for number in [number for number in self._figures if number not in steps]:
            self._figures[number].hide()
        self._draw_strangers(result.strangers)
        self._bodies.draw(result.bodies)
        self._markers.draw(result.markers)

    def _figure(self, number: int) -> PerformerFigure:
        if number not in self._figures:
            self._figures[number] = PerformerFigure(self._server, number)
            self._figures[number].use_robot(self._robot)
            self._see_through()
        return self._figures[number]

    def use_robot(self, chosen: ChosenRobot | None) -> None:
        """Draw everybody as this robot, or as a mannequin (None)."""
        self._robot = chosen
        for figure in self._figures.values():
            figure.use_robot(chosen)

    def _draw_strangers(self, joints_m: Sequence[NDArray[np.float64]]) -> None:
        """Show people who are not performers as grey skeletons, each of shape (21, 3)."""
        while len(self._strangers) < len(joints_m):
            name = f"/character/stranger_{len(self._strangers)}"
            self._strangers.append(RawSkeleton(self._server, name, STRANGER_RGB))
        for i, skeleton in enumerate(self._strangers):
            skeleton.draw(joints_m[i] if i < len(joints_m) else _NO_JOINTS)

    def hide_performers(self) -> None:
        """Hide everybody: no camera has seen anybody for a while."""
        for figure in self._figures.values():
            figure.hide()
        self._draw_strangers(())
        self._bodies.draw(())
        self._markers.draw(None)


def _light(scene: viser.SceneApi) -> None:
    """Light the scene with one lamp that casts shadows, and like a room: a bright ceiling, a dark floor.

    The viewer's own lights draw everything into three shadow maps, which takes a software renderer as long as the
    picture itself. Its own room is an image that it filters before the first picture of a body, which takes software
    4 to 6 s. The two lights here replace that image's light of 0.3 to 5.0 with an RMS error of 0.09.
    """
    scene.configure_default_lights(enabled=False)
    scene.add_light_spot(
        "/lights/sun", intensity=3.0, angle=_SUN_ANGLE_RAD, penumbra=0.3, decay=0.0, cast_shadow=True,
        position=_SUN_M, direction=(-_SUN_M[0], -_SUN_M[1], -_SUN_M[2]),
    )  # fmt: skip
    scene.configure_environment_map(hdri=None)
    scene.add_light_hemisphere(
        "/lights/room",
        intensity=2.65,
        sky_color=(231, 235, 255),
        ground_color=(137, 119, 114),
        position=_CEILING_M,
    )
    scene.add_light_directional("/lights/ceiling", intensity=2.29, color=(237, 236, 255), position=_CEILING_M)
