"""Limbs that the first solve lost: they restart from their poses before and after.

Gauss-Newton finds local minima, and an arm that is folded the wrong way is in one. Where all cameras see an elbow,
wrist, knee or ankle far from the first solve for several frames, the limb's hinges are interpolated from the edges of
this stretch.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_dilation, binary_opening

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.joints import INDEX

LOST_M = 0.12
LOST_S = 0.1
"""A limb is lost if each camera that sees one of its joints sees it this far away, for this long."""

GAP_S = 0.05
EDGE_S = 0.07
"""Shorter gaps in a lost stretch are closed, and the stretch is extended by this at its edges."""

_LIMBS = (
    *(((f"{s}_elbow", f"{s}_wrist"), (f"{s.title()}Arm", f"{s.title()}ForeArm")) for s in ("left", "right")),
    *(((f"{s}_knee", f"{s}_ankle"), (f"{s.title()}UpLeg", f"{s.title()}Leg")) for s in ("left", "right")),
)
_JOINTS = [[INDEX[name] for name in joints] for joints, _ in _LIMBS]


def _columns() -> list[list[int]]:
    """Columns in `q` of each limb's hinges."""
    carriers = [name for name in BODY_JOINTS[1:] for _ in dofs_of(name)]
    return [[7 + k for k, name in enumerate(carriers) if name in bones] for _, bones in _LIMBS]


_COLUMNS = _columns()


def far_limbs(positions: NDArray[np.float64], sites: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which limbs are far from where every camera sees them, shape (frame_count, 4).

    Args:
        positions: shape (frame_count, camera_count, 21, 3) [m]; NaN = unseen.
        sites: the first solve's canonical joints [m], shape (frame_count, 21, 3).
    """
    distance = np.linalg.norm(positions - sites[:, None], axis=3)
    nearest = np.fmin.reduce(distance, axis=1, initial=np.inf)
    far = (nearest > LOST_M) & np.isfinite(nearest)
    return np.stack([far[:, joints].any(axis=1) for joints in _JOINTS], axis=1)


def bring_back(q: NDArray[np.float64], far: NDArray[np.bool_], dt: float) -> None:
    """Interpolate lost limbs from the edges of their lost stretches, in place.

    Args:
        q: configurations of a take without gaps, shape (frame_count, nq).
        far: from `far_limbs`.
        dt: time between frames [s].
    """
    gap, least, edge = (np.ones(2 * round(0.5 * s / dt) + 1, dtype=bool) for s in (GAP_S, LOST_S, 2 * EDGE_S))
    frames = np.arange(len(q))
    for limb, columns in enumerate(_COLUMNS):
        lost = binary_dilation(binary_opening(binary_closing(far[:, limb], gap), least), edge)
        if not lost.any() or lost.all():
            continue
        for column in columns:
            q[lost, column] = np.interp(frames[lost], frames[~lost], q[~lost, column])
