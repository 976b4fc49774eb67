"""Parts of the body keep apart: forearms and hands from trunk, head and legs, legs from each other.

A part is a rounded cone on the bone between two canonical joints, with the radii of the tracker's surface of a
person of that stature (`seeing.fitting.cones.CONES`). Flesh gives way, and joints are measured to a centimetre. Parts
that overlap by more than `GIVES_M` are pushed apart, each as far as cameras and neighbouring frames let it move.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import nearest_on_segments
from studio.engine.model.joints import INDEX
from studio.engine.seeing.fitting.cones import CONES

GIVES_M = 0.010
SIGMA_M = 0.007
"""Overlap of two parts without a penalty, and the standard deviation of overlap beyond it [m]."""

BELIEVED_M = 0.018
"""Scale of the robust weight (Geman-McClure: Zhang, "Parameter estimation techniques", 1997, section 9). The joints'
noise explains no deeper overlap, so a much deeper one is real: the body may be slimmer than assumed.
"""

NEAR_M = 0.005
"""Parts nearer than this to touching have a row without a pull, which damps steps into each other. Without
it, the solve alternates between pushing a part out and letting it back in.
"""

_BODY = {"forearm": "ForeArm", "hand": "Hand", "thigh": "UpLeg", "shank": "Leg", "foot": "Foot"}
_ENDS = {
    "forearm": ("elbow", "wrist"),
    "hand": ("wrist", "hand"),
    "thigh": ("hip", "knee"),
    "shank": ("knee", "ankle"),
    "foot": ("ankle", "toe"),
}
_SIDES = ("left", "right")


def _radii(body: str) -> tuple[float, float]:
    """Radii of a body's surface at the two ends of its bone, as shares of stature."""
    cones = [cone for cone in CONES if cone.body == body]
    return cones[0].start_radius, cones[-1].end_radius


# part: joints at its ends, radii there as shares of stature
_PARTS: dict[str, tuple[str, str, float, float]] = {
    "trunk": ("hips", "neck", _radii("Hips")[0], _radii("LeftShoulder")[1]),
    "head": ("neck", "head", _radii("Neck")[0], _radii("Head")[0]),
} | {
    f"{side}_{part}": (f"{side}_{start}", f"{side}_{end}", *_radii(side.title() + _BODY[part]))
    for side in _SIDES
    for part, (start, end) in _ENDS.items()
}
SURFACES = _PARTS | {
    f"{side}_upper_arm": (f"{side}_shoulder", f"{side}_elbow", *_radii(f"{side.title()}Arm"))
    for side in _SIDES
}
"""All parts of a body's surface: joints at the ends, and radii there as shares of stature."""

_PAIRS: tuple[tuple[str, str], ...] = (
    *((f"{side}_{part}", whole) for side in _SIDES for part in ("forearm", "hand")
      for whole in ("trunk", "head", "left_thigh", "right_thigh", "left_shank", "right_shank")),
    *((f"left_{a}", f"right_{b}") for a in ("forearm", "hand") for b in ("forearm", "hand")),
    *((f"left_{a}", f"right_{b}") for a in ("thigh", "shank", "foot") for b in ("thigh", "shank", "foot")
      if (a, b) != ("thigh", "thigh")),
)  # fmt: skip
"""Pairs of parts that are kept apart. Thighs are not among them, because they touch in people who stand."""

_JOINTS = np.array([[INDEX[joint] for part in pair for joint in _PARTS[part][:2]] for pair in _PAIRS])
_RADII = np.array([[radius for part in pair for radius in _PARTS[part][2:]] for pair in _PAIRS])


class BodyContact:
    """Rows of finishing's problem that push parts of a performer apart."""

    def __init__(self, height_m: float) -> None:
        """Prepare for a performer of this stature."""
        self._radii_m = _RADII * height_m  # (pair_count, 4): first part's ends, second part's ends

    def rows(
        self, sites: NDArray[np.float64], jacobians: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return a row for every two parts that overlap too much, or nearly.

        Args:
            sites: canonical joints [m], shape (frame_count, 21, 3).
            jacobians: their Jacobians, shape (frame_count, 63, nv).

        Returns:
            The frame of each row, shape (row_count,); the derivative of the parts' distance by each degree of
            freedom, in standard deviations, shape (row_count, nv); the residual, in standard deviations, shape
            (row_count,).
        """
        a0, a1, b0, b1 = np.moveaxis(sites[:, _JOINTS], 2, 0)
        along_a, along_b, apart = nearest_on_segments(a0, a1, b0, b1)
        distance = np.linalg.norm(apart, axis=2)
        start_a, end_a, start_b, end_b = self._radii_m.T
        reach = start_a + along_a * (end_a - start_a) + start_b + along_b * (end_b - start_b)
        deep = reach - GIVES_M - distance
        frames, pairs = np.nonzero((deep > -NEAR_M) & (distance > 1e-6))
        s, t = along_a[frames, pairs, None], along_b[frames, pairs, None]
        way = apart[frames, pairs] / distance[frames, pairs, None]
        shares = np.concatenate([1.0 - s, s, t - 1.0, -t], axis=1)
        too_deep = np.maximum(deep[frames, pairs], 0.0)
        root_weight = 1.0 / (1.0 + (too_deep / BELIEVED_M) ** 2) / SIGMA_M
        of_joints = jacobians.reshape(len(sites), -1, 3, jacobians.shape[2])[frames[:, None], _JOINTS[pairs]]
        return (
            frames,
            np.einsum("rk,ra,rkan->rn", shares, way, of_joints) * root_weight[:, None],
            too_deep * root_weight,
        )
