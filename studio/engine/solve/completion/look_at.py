"""Look-at: the head's direction where its orientation is not measured (Ménard 2014, 5.4).

The head turns towards a target, or follows the measured face. The neck takes a share of the turn. Both stay within
their ranges and within the speed of a head. The neck leans so that the head joint keeps its measured place.
"""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import angles_xyz, matrices, rotation_xyz
from studio.engine.model.human.ranges import dofs_of, range_rad
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.settings.settings import SolveSettings

MAX_YAW_RAD, MAX_PITCH_RAD, MAX_ROLL_RAD = math.radians(75.0), math.radians(40.0), math.radians(40.0)
"""Limits of the head's yaw, pitch and roll relative to the chest (AAOS)."""

FOLLOW_S = 0.25
"""Time constant of the head's turn to a target [s]."""

FASTEST_RAD_S = 8.0
"""Largest speed of a head whose face is followed [rad/s], along each of its three angles."""

NECK_SHARE = 0.5
"""The neck's share of the turn."""

NEAR_M = 1.2
"""Distance at which `near` looks at the ground."""

_HEAD, _NECK, _CHEST = OUTPUT_INDEX["Head"], OUTPUT_INDEX["Neck"], OUTPUT_INDEX["Spine2"]
_HANDS = (OUTPUT_INDEX["LeftHand"], OUTPUT_INDEX["RightHand"])


def _rotation_within(angles: tuple[float, float, float], ranges: list[list[float]]) -> NDArray[np.float64]:
    """`rotation_xyz` of three angles, each clamped to its range [rad]."""
    return rotation_xyz(
        *(min(max(angle, low), high) for angle, (low, high) in zip(angles, ranges, strict=True))
    )


def _within(angle: float, most: float) -> float:
    return min(max(angle, -most), most)


def _angles_of(gaze: NDArray[np.float64]) -> tuple[float, float]:
    """Yaw and pitch of a direction in the chest's axes, shape (3,)."""
    x, y, z = gaze.tolist()
    return math.atan2(x, -y), math.atan2(z, math.hypot(x, y))


def _head_in_chest(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    return rotation_xyz(0.0, 0.0, yaw) @ rotation_xyz(-pitch, roll, 0.0)


def _ahead(chest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where a chest, 3x3, faces on the floor, a unit vector."""
    ahead = -chest[:, 1] * np.array([1.0, 1.0, 0.0])
    return ahead / max(float(np.linalg.norm(ahead)), 1e-6)


class LookAt:
    """Turns the head: `hands`, `far`, `near`, `point`, or `measured` (else as `far`)."""

    def __init__(self, mode: str, point_m: tuple[float, float, float], *, flexibility: float = 1.0) -> None:
        self._mode, self._point = mode, np.array(point_m)
        self._turn, self._started = (0.0, 0.0, 0.0), False  # yaw, pitch and roll
        self._neck_range, self._head_range = (
            [range_rad(dof, flexibility).tolist() for dof in dofs_of(name)] for name in ("Neck", "Head")
        )

    @classmethod
    def of(cls, settings: SolveSettings) -> "LookAt | None":
        """Return the `LookAt` of a solve's settings; None = off."""
        if settings.look_at == "off":
            return None
        return cls(settings.look_at, settings.look_at_point_m, flexibility=settings.flexibility)

    @property
    def measures(self) -> bool:
        """Whether measured orientations turn the head."""
        return self._mode == "measured"

    def straight(self, rotations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the world rotation of a head that looks straight ahead of the chest, 3x3.

        Args:
            rotations: world rotations of the output joints, shape (52, 3, 3).
        """
        chest = rotations[_CHEST]
        yaw, pitch = _angles_of(chest.T @ _ahead(chest))
        return chest @ _head_in_chest(yaw, _within(pitch, MAX_PITCH_RAD), 0.0)

    def apply(
        self,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
        head_wxyz: tuple[float, float, float, float] | None,
        dt: float,
        face: NDArray[np.float64] | None = None,
    ) -> None:
        """Turn head and neck, in place, in the world `rotations`, shape (52, 3, 3).

        Args:
            positions: joint positions [m], shape (52, 3).
            rotations: world rotations.
            head_wxyz: measured head orientation in the stage frame, if any.
            dt: time since the last frame [s].
            face: world rotation of the head by its face's landmarks, 3x3, preferred to the others; None = not seen.
        """
        chest = rotations[_CHEST]
        if face is not None:
            turn = self._followed(chest.T @ face, dt)
        else:
            if self.measures and head_wxyz is not None:
                gaze = matrices(np.array(head_wxyz)) @ np.array([0.0, -1.0, 0.0])
            else:
                gaze = self._gaze(positions, chest)
            turn = self._approached(chest.T @ gaze, dt)
        self._turn, self._started = turn, True
        head = chest @ _head_in_chest(*turn)
        yaw = turn[0]
        rise = positions[_HEAD] - positions[_NECK]
        neck = chest @ self._turned_neck(chest.T @ rotations[_NECK], chest.T @ rise, NECK_SHARE * yaw)
        rotations[_NECK] = neck
        rotations[_HEAD] = neck @ _rotation_within(angles_xyz(neck.T @ head), self._head_range)

    def _approached(self, gaze: NDArray[np.float64], dt: float) -> tuple[float, float, float]:
        """Yaw, pitch and roll on the way to a direction in the chest's axes, shape (3,)."""
        last_yaw, last_pitch, last_roll = self._turn
        x, y, _ = gaze.tolist()
        yaw, pitch = _angles_of(gaze)
        if -y < 0.2 * math.hypot(x, y):  # to the side or behind: the limit on the present side
            yaw = math.copysign(MAX_YAW_RAD, last_yaw if abs(last_yaw) > 0.3 else x)
        share = 1.0 - math.exp(-dt / FOLLOW_S)
        return (
            last_yaw + share * (_within(yaw, MAX_YAW_RAD) - last_yaw),
            last_pitch + share * (_within(pitch, MAX_PITCH_RAD) - last_pitch),
            last_roll - share * last_roll,
        )

    def _followed(self, head: NDArray[np.float64], dt: float) -> tuple[float, float, float]:
        """Yaw, pitch and roll of a head in the chest's axes, 3x3, no faster than a head turns."""
        yaw, pitch = _angles_of(-head[:, 1])
        roll = angles_xyz(_head_in_chest(yaw, pitch, 0.0).T @ head)[1]
        limits = (MAX_YAW_RAD, MAX_PITCH_RAD, MAX_ROLL_RAD)
        yaw, pitch, roll = (
            _within(angle, most) for angle, most in zip((yaw, pitch, roll), limits, strict=True)
        )
        if not self._started:
            return yaw, pitch, roll
        most = FASTEST_RAD_S * dt
        last_yaw, last_pitch, last_roll = self._turn
        return (
            last_yaw + _within(yaw - last_yaw, most),
            last_pitch + _within(pitch - last_pitch, most),
            last_roll + _within(roll - last_roll, most),
        )

    def _turned_neck(
        self, neck: NDArray[np.float64], rise: NDArray[np.float64], yaw: float
    ) -> NDArray[np.float64]:
        """The neck's rotation in the chest, 3x3, with `yaw` added and a bend that keeps the head, at `rise`, in
        place."""
        low, high = self._neck_range[2]
        twist = min(max(angles_xyz(neck)[2] + yaw, low), high)
        # rise = R(x, bend) R(y, side) (x, y, z)
        x, y, z = (rotation_xyz(0.0, 0.0, twist) @ (neck.T @ rise)).tolist()
        reach = max(math.hypot(x, z), 1e-9)
        side = math.asin(max(-1.0, min(1.0, float(rise[0]) / reach))) - math.atan2(x, z)
        z = z * math.cos(side) - x * math.sin(side)
        bend = math.atan2(float(rise[2]), float(rise[1])) - math.atan2(z, y)
        bend = (bend + math.pi) % (2 * math.pi) - math.pi
        return _rotation_within((bend, side, twist), self._neck_range)

    def _gaze(self, positions: NDArray[np.float64], chest: NDArray[np.float64]) -> NDArray[np.float64]:
        """Direction from the head to the target, stage frame."""
        ahead = _ahead(chest)
        head = positions[_HEAD]
        if self._mode == "hands":
            target = 0.5 * (positions[_HANDS[0]] + positions[_HANDS[1]])
        elif self._mode == "point":
            target = self._point
        elif self._mode == "near":
            target = head * np.array([1.0, 1.0, 0.0]) + NEAR_M * ahead
        else:
            return ahead
        direction = target - head
        length = float(np.linalg.norm(direction))
        return direction / length if length > 0.05 else ahead
