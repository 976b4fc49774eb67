"""The solved character in the browser view: the mannequin, skinned to the performer's proportions."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.errors import FormatError
from studio.engine.frames import StepResult
from studio.engine.geometry import matrices
from studio.engine.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.mannequin import BODY, SEAM, mannequin_mesh
from studio.engine.soles import rest_lift_m
from studio.web.palette import BODY_RGB, JOINT_RGB
from studio.web.skin import Skin

Array = NDArray[np.float64]

_CHILDREN = np.flatnonzero(OUTPUT_PARENTS >= 0)
_RIGID_M = 1e-3
"""Bones that change by less from one pose to the next belong to a rigid skeleton."""

_OTHER_M = 0.02
"""A bone that differs by more from the body's needs another body."""

_MEMORY = 30
"""Poses over which bones that change all the time are averaged, and between two bodies made for them."""


def bone_offsets(positions_m: Array, rotations_wxyz: Array) -> Array:
    """Return where each joint lies in its parent's axes [m], shape (52, 3); the root at 0.

    Args:
        positions_m: output joints in the stage frame, shape (52, 3).
        rotations_wxyz: their world rotations, shape (52, 4).
    """
    parents = OUTPUT_PARENTS[_CHILDREN]
    along = positions_m[_CHILDREN] - positions_m[parents]
    offsets = np.zeros_like(positions_m)
    offsets[_CHILDREN] = np.einsum("jik,ji->jk", matrices(rotations_wxyz)[parents], along)
    return offsets


def rest_positions(offsets_m: Array) -> Array:
    """Return the joints in the T-pose, stage axes, hips at 0 [m], shape (52, 3)."""
    rest = offsets_m.copy()
    for joint in _CHILDREN:  # parents come first
        rest[joint] += rest[OUTPUT_PARENTS[joint]]
    return rest


class Proportions:
    """Tells of which proportions the body must be, pose by pose."""

    def __init__(self) -> None:
        self._last: Array | None = None
        self._mean: Array | None = None
        self._used: Array | None = None
        self._age = 0

    def another(self, offsets_m: Array) -> Array | None:
        """Return the offsets [m] to make another body of, None where the last one still fits."""
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
    """One mannequin, made anew where the performer is another; `tint` colours all of it."""

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

    def draw(self, result: StepResult) -> None:
        """Show a pose of the output skeleton."""
        offsets = self._proportions.another(bone_offsets(result.positions_m, result.rotations_wxyz))
        if offsets is not None:
            self._make(rest_positions(offsets), result.root_height_m)
        for skin in self._skins:
            skin.pose(result.positions_m, result.rotations_wxyz)

    def set_opacity(self, opacity: float | None) -> None:
        """See through the body, or not (None)."""
        self._opacity = opacity
        for skin in self._skins:
            skin.set_opacity(opacity)

    def _make(self, rest_m: Array, root_height_m: float | None) -> None:
        floor_m = -rest_lift_m(rest_m[:, 2], root_height_m)
        try:
            mesh = mannequin_mesh(OUTPUT_JOINTS, rest_m[:, [0, 2, 1]] * [1.0, 1.0, -1.0], floor_m=floor_m)
        except FormatError:  # bones so far off that no body fits: the last one stays
            return
        for skin in self._skins:
            skin.remove()
        self._skins = [
            Skin(
                self._server, f"{self._name}/{tone}", mesh, rest_m, tone=tone, rgb=rgb, opacity=self._opacity
            )
            for tone, rgb in self._colours.items()
        ]
