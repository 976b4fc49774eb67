"""Displacement limit: the largest movement of a joint per frame relative to its parent (Ménard 2014, 5.5).

Before the solve it limits joints. After the solve it limits the turns that move them, so that bones keep their
length.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    CANONICAL,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL,
    OUTPUT_PARENTS,
    PARENTS,
)

_FAST = {
    "hips": 6.0,  # on the stage; a runner's, and a jumper's at take-off (3 to 4 m/s upward)
    "shoulder": 3.5,  # trunk turning at 15 rad/s: a pitcher's 20 (Fleisig et al. 1999) is the fastest known
    "elbow": 5.0,  # upper arm at 17 rad/s; with the forearm, a boxer's fist at 9 m/s (Whiting et al. 1988)
    "wrist": 7.0,  # forearm at 25 rad/s: a boxer's straight; a pitcher's elbow reaches 40 (Werner et al. 1993)
    "hand": 5.0,  # the fist's share
    "hip": 3.0,
    "knee": 5.0,  # thigh at 12 rad/s: a sprinter's (Novacheck 1998)
    "ankle": 8.0,  # shank at 19 rad/s: a sprinter's; a footballer's kick reaches 26 to 35 (Lees & Nolan 1998)
    "toe": 4.0,
}
_OTHER_M_S = 2.0  # spine, chest, neck, head: 10 rad/s
DEFAULT_M_S: dict[str, float] = {name: _FAST.get(name.split("_")[-1], _OTHER_M_S) for name in CANONICAL}
"""Largest speed of each canonical joint relative to its parent [m/s]; of the hips, on the stage: an adult's bone
length times the angular speed in the comment next to it.
"""

_FINGER_M_S = 1.0  # bones of 2 to 4 cm at 25 to 50 rad/s; the fastest tapping, 7 Hz over 60 degrees, has 23
_ANY_RAD_S = 1e6  # no limit: for a joint without children


def limits_m_s(overrides: dict[str, float]) -> dict[str, float]:
    """Return the limit of each canonical joint, with the user's own values where set."""
    return DEFAULT_M_S | overrides


class DisplacementLimitBefore:
    """Clamps the movement of canonical joints relative to their parents."""

    def __init__(self, limits: dict[str, float]) -> None:
        self._limits = np.array([limits[name] for name in CANONICAL])
        self._last: NDArray[np.float64] | None = None

    def apply(self, joints: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return the joints, shape (21, 3) [m]; a joint that was unseen in the last frame is not limited."""
        root = PARENTS < 0
        relative = joints - np.where(root[:, None], 0.0, joints[PARENTS])
        if self._last is not None:
            step = relative - self._last
            length = np.linalg.norm(step, axis=1)
            share = np.minimum(1.0, self._limits * dt / np.maximum(length, 1e-9))
            held = self._last + step * share[:, None]
            relative = np.where(np.isnan(held), relative, held)
            self._last = np.where(np.isnan(relative), self._last, relative)
        else:
            self._last = relative.copy()
        out = relative.copy()
        for joint in range(1, len(PARENTS)):
            parent = out[PARENTS[joint]]
            out[joint] = parent + relative[joint] if np.isfinite(parent[0]) else joints[joint]
        return out


class DisplacementLimitAfter:
    """Clamps the turn of each output joint, so that its children move no further than their limit. Fingers are
    included."""

    def __init__(self, skeleton: Skeleton, limits: dict[str, float]) -> None:
        by_output = {OUTPUT_OF_CANONICAL[name]: limit for name, limit in limits.items()}
        length = np.linalg.norm(skeleton.offsets_m, axis=1)
        self._max_rad_s = np.full(len(OUTPUT_JOINTS), _ANY_RAD_S)
        for joint, name in enumerate(OUTPUT_JOINTS[1:], start=1):
            finger = "Hand" in name and name not in ("LeftHand", "RightHand")
            limit = _FINGER_M_S if finger else by_output.get(name, _OTHER_M_S)
            parent = OUTPUT_PARENTS[joint]
            self._max_rad_s[parent] = min(self._max_rad_s[parent], limit / max(length[joint], 0.02))
        self._root_m_s = limits["hips"]
        self._last: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def apply(
        self, root: NDArray[np.float64], local: NDArray[np.float64], dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the limited hips' position [m] and rotations in the parent, shape (52, 3, 3). The next frame
        continues from these.
        """
        root, local = self.held(root, local, dt)
        self.put_out(root, local)
        return root, local

    def put_out(self, root: NDArray[np.float64], local: NDArray[np.float64]) -> None:
        """Set the pose that the next frame continues from, where it was changed after `held`."""
        self._last = (root, local)

    @property
    def last_local(self) -> NDArray[np.float64]:
        """Rotations in the parent of the last output pose; there must have been a frame."""
        assert self._last is not None
        return self._last[1]

    def shares(self, local: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return the allowed share of each joint's turn since the last frame, 0..1, shape (52,)."""
        return self._allowed(self._turn(local), dt)

    def held(
        self, root: NDArray[np.float64], local: NDArray[np.float64], dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the limited hips and rotations, as `apply` does, without keeping them for the next frame. Return
        `local` itself where no joint turns too fast.
        """
        if self._last is None:
            return root, local
        last_root, last_local = self._last
        step = root - last_root
        root = last_root + step * min(1.0, self._root_m_s * dt / max(float(np.linalg.norm(step)), 1e-9))
        turn = self._turn(local)
        share = self._allowed(turn, dt)
        if (share == 1.0).all():
            return root, local
        held = last_local @ Rotation.from_rotvec(turn * share[:, None]).as_matrix()
        return root, np.where((share < 1.0)[:, None, None], held, local)

    def _turn(self, local: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotation vectors since the last frame [rad], shape (52, 3)."""
        step = np.einsum("jba,jbc->jac", self.last_local, local)
        return Rotation.from_matrix(step, assume_valid=True).as_rotvec()

    def _allowed(self, turn: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        return np.minimum(1.0, self._max_rad_s * dt / np.maximum(np.linalg.norm(turn, axis=1), 1e-9))
