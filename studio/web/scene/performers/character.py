"""The solved character in the browser view: the mannequin, skinned to the performer's proportions.

All bodies of the mannequin are in the scene. Each browser shows one: `static/view/view_body.js` gives it the bones of
the first one; only these are sent.
"""

from functools import reduce
from itertools import cycle

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.animation.mannequin import BODY, SEAM
from studio.engine.animation.mannequin.performer import bone_offsets, rest_positions, stage_mesh
from studio.engine.base.errors import FormatError
from studio.engine.model.frames import StepResult
from studio.engine.model.performers.bodies import BODIES
from studio.web.scene.palette import BODY_RGB, JOINT_RGB
from studio.web.scene.performers.contact import ContactShadows
from studio.web.scene.performers.skin import Skin, joints_of

Array = NDArray[np.float64]

_RIGID_M = 1e-3
"""Maximum change of bones between poses of a rigid skeleton [m]."""

_OTHER_M = 0.02
"""Difference of a bone from the body's that requires another body [m]."""

_MEMORY = 30
"""Number of poses over which changing bones are averaged, and minimum number between two new bodies."""


class Proportions:
    """Tracks the proportions of the body, pose by pose."""

    def __init__(self) -> None:
        self._last: Array | None = None
        self._mean: Array | None = None
        self._used: Array | None = None
        self._age = 0

    def another(self, offsets_m: Array) -> Array | None:
        """Return the offsets [m] of a new body, None if the last one still fits."""
        last, self._last = self._last, offsets_m
        rigid = last is None or float(np.abs(offsets_m - last).max()) < _RIGID_M
        if rigid or self._mean is None:
            self._mean = offsets_m
        else:
            self._mean = self._mean + (offsets_m - self._mean) / _MEMORY
        self._age += 1
        fits = self._used is not None and float(np.abs(self._mean - self._used).max()) < _OTHER_M
        if fits or (self._used is not None and not rigid and self._age < _MEMORY):
            return None
        self._used, self._age = self._mean, 0
        return self._mean


class Character:
    """One mannequin, made again for other proportions. `tint` colours all of it, without contact shadows."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        *,
        tint: tuple[int, int, int] | None = None,
        opacity: float | None = None,
    ) -> None:
        self._server = server
        self._name = name
        self._colours = {BODY: tint or BODY_RGB, SEAM: tint or JOINT_RGB}
        self._opacity = opacity
        self._proportions = Proportions()
        self._skins: list[Skin] = []
        for body in BODIES:
            server.scene.add_frame(f"{name}/bodies/{body}", show_axes=False, visible=body == BODIES[0])
        self._contact = None if tint else ContactShadows(server, f"{name}/contact")

    def draw(self, result: StepResult) -> None:
        """Show a pose of the output skeleton."""
        offsets = self._proportions.another(bone_offsets(result.positions_m, result.rotations_wxyz))
        if offsets is not None:
            self._make(rest_positions(offsets), result.root_height_m)
        for skin in self._skins[: len(self._colours)]:  # of the first body
            skin.pose(result.positions_m, result.rotations_wxyz)
        if self._contact is not None:
            self._contact.draw(result.positions_m)

    def set_opacity(self, opacity: float | None) -> None:
        """Make the body transparent, or not (None)."""
        self._opacity = opacity
        for skin in self._skins:
            skin.set_opacity(opacity)

    def set_colour(self, rgb: tuple[int, int, int] | None) -> None:
        """Give the body a colour, with darker joints; None: the colour of a single performer."""
        self._colours = (
            {BODY: BODY_RGB, SEAM: JOINT_RGB}
            if rgb is None
            else {BODY: rgb, SEAM: (rgb[0] * 2 // 5, rgb[1] * 2 // 5, rgb[2] * 2 // 5)}
        )
        for skin, colour in zip(
            self._skins, cycle(self._colours.values())
        ):  # a body's tones follow one another
            skin.set_colour(colour)

    def _make(self, rest_m: Array, root_height_m: float | None) -> None:
        try:
            meshes = {body: stage_mesh(rest_m, root_height_m, body=body) for body in BODIES}
        except FormatError:  # no body fits such bones: the last one stays
            return
        if self._contact is not None:
            self._contact.fit(rest_m, root_height_m)
        for skin in self._skins:
            skin.remove()
        self._skins = []
        bones = {
            tone: reduce(np.union1d, (joints_of(mesh, tone) for mesh in meshes.values()))
            for tone in self._colours
        }
        for body, mesh in meshes.items():
            name = f"{self._name}/bodies/{body}"
            self._skins += [
                Skin(
                    self._server, f"{name}/{tone}", mesh, rest_m, tone=tone, joints=bones[tone], rgb=rgb,
                    opacity=self._opacity,
                )
                for tone, rgb in self._colours.items()
            ]  # fmt: skip
