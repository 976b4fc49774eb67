"""A hand with a thumb and four fingers: solid, bones and bending.

Hand axes: x from the wrist to the fingers, y to the side of the thumb, z out of the back of the hand. In the T-pose,
those of the left hand are x, -y, z of the stage. The right hand is the mirror image.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.simulator.body.field import Solid

Array = NDArray[np.float64]
FINGERS: tuple[str, ...] = ("thumb", "index", "middle", "ring", "little")
BONES_PER_HAND = 3 * len(FINGERS)
_KNUCKLE_M = 0.092
"""From the wrist to the middle finger's knuckle in a hand of scale 1."""

# Root [m], lengths of three bones [m], radii at root and tip [m], spread and dip of the open finger [rad].
_TABLE: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float, float]] = {
    "thumb": ((0.022, 0.026, -0.008), (0.044, 0.034, 0.028), (0.0135, 0.0095), 0.72, 0.35),
    "index": ((0.090, 0.029, 0.000), (0.043, 0.026, 0.021), (0.0100, 0.0078), 0.10, 0.06),
    "middle": ((0.092, 0.008, 0.002), (0.047, 0.030, 0.022), (0.0102, 0.0078), 0.01, 0.06),
    "ring": ((0.087, -0.013, 0.001), (0.043, 0.028, 0.022), (0.0096, 0.0074), -0.09, 0.08),
    "little": ((0.079, -0.032, -0.003), (0.034, 0.020, 0.019), (0.0085, 0.0066), -0.20, 0.10),
}  # fmt: skip
# Bend of each bone from open to fist [rad], about the axis that curls it into the palm.
_FIST: dict[str, tuple[float, float, float]] = {
    "thumb": (0.15, 0.95, 0.95),
    "index": (1.30, 1.65, 0.95),
    "middle": (1.38, 1.70, 0.95),
    "ring": (1.42, 1.70, 0.95),
    "little": (1.45, 1.65, 0.95),
}


@dataclass(frozen=True)
class Hand:
    """An open hand in hand axes, wrist at 0.

    Attributes:
        joints_m: the ends of every finger's three bones, shape (5, 4, 3).
        radii_m: at root and tip of every finger, shape (5, 2).
        scale: relative to a hand of 92 mm from wrist to knuckle.
    """

    joints_m: Array
    radii_m: Array
    scale: float

    @staticmethod
    def of(length_m: float, finger: float) -> "Hand":
        """Return a hand with this length from wrist to knuckles [m] and this relative finger length."""
        scale = length_m / _KNUCKLE_M
        joints, radii = np.empty((len(FINGERS), 4, 3)), np.empty((len(FINGERS), 2))
        for i, name in enumerate(FINGERS):
            root, lengths, thickness, spread, dip = _TABLE[name]
            way = np.array([np.cos(spread) * np.cos(dip), np.sin(spread) * np.cos(dip), -np.sin(dip)])
            along = np.concatenate([[0.0], np.cumsum(lengths)]) * finger
            joints[i] = scale * (np.array(root) + along[:, None] * way)
            radii[i] = scale * np.array(thickness)
        return Hand(joints, radii, scale)

    def solid(self) -> Solid:
        """Return the open hand, wrist end included."""
        s = self.scale
        solid = Solid(blend_m=0.008 * s)
        solid.cone(np.array([-0.03, 0, 0]) * s, np.array([0.012, 0, 0]) * s, (0.026 * s, 0.027 * s),
                   flat=(1, 1, 0.72), blend_m=0.02 * s)  # fmt: skip
        for i in range(1, len(FINGERS)):
            root = self.joints_m[i, 0]
            start = np.array([0.012 * s, 0.62 * root[1], 0.0])
            solid.cone(start, root, (0.0145 * s, 0.0125 * s), blend_m=0.02 * s)
        thumb = self.joints_m[0]
        solid.cone(thumb[0], thumb[1], (0.017 * s, 0.013 * s), blend_m=0.022 * s)
        for i in range(len(FINGERS)):
            r0, r1 = self.radii_m[i]
            tip = self.joints_m[i, 3] - (self.joints_m[i, 3] - self.joints_m[i, 2]) * min(
                1.0, r1 / (0.02 * s)
            )
            solid.cone(self.joints_m[i, 0], tip, (r0, r1), group=i + 1)
        return solid

    def bend(self, openness: float) -> tuple[Array, Array]:
        """Return the finger bones' rotations and positions in hand axes, from an open hand (1) to a fist (0).

        Returns:
            Rotations, shape (5, 3, 3, 3), and the positions of the bones' roots [m], shape (5, 3, 3).
        """
        closed = 1.0 - openness
        rotations, places = np.empty((len(FINGERS), 3, 3, 3)), np.empty((len(FINGERS), 3, 3))
        for i, name in enumerate(FINGERS):
            spread = _TABLE[name][3]
            if name == "thumb":  # it moves in front of the palm, then bends over the fingers
                turn = Rotation.from_rotvec(closed * np.array([0.0, 0.05, 0.0])) * Rotation.from_rotvec(
                    closed * np.array([0.0, 0.0, -0.25])
                )
                axis = np.array([0.0, 0.1, -0.995])
            else:
                turn = Rotation.from_rotvec([0.0, 0.0, -spread * 0.8 * closed])
                axis = np.array([0.0, 1.0, 0.0])
            place = self.joints_m[i, 0]
            for k in range(3):
                turn = turn * Rotation.from_rotvec(closed * _FIST[name][k] * axis)
                rotations[i, k], places[i, k] = turn.as_matrix(), place
                place = place + turn.apply(self.joints_m[i, k + 1] - self.joints_m[i, k])
        return rotations, places
