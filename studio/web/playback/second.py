"""A second figure next to a clip: another solve, or a reference, aligned to the clip's stage and clock."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.api.stage.shown import SecondFigure
from studio.engine.base.errors import SettingsError
from studio.engine.base.geometry import make_transform
from studio.engine.metrics.reference.alignment import Alignment
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL_INDEX
from studio.web.playback.clip import Clip

_CANONICAL = {int(output): place for place, output in enumerate(OUTPUT_OF_CANONICAL_INDEX)}
_AT_REST = np.tile([1.0, 0.0, 0.0, 0.0], (len(OUTPUT_JOINTS), 1))


@dataclass(frozen=True)
class Second:
    """A figure next to a clip, at stage times of the clip.

    Attributes:
        name: which it is.
        shown: a clip, drawn as a character, or a motion already on the stage, drawn as a skeleton.
        alignment: from the clip's stage and clock to those of `shown`.
        performer: number of the clip's performer next to whom a reference stands.
    """

    name: SecondFigure
    shown: Clip | Reference
    alignment: Alignment
    performer: int = 1

    @classmethod
    def solve(cls, other: Clip, clip: Clip, alignment: Alignment | None = None) -> "Second":
        """Return another solve next to a clip: one of the same take at the same times, one of another take from its
        beginning on, unless an alignment is given."""
        if alignment is not None:
            return cls(SecondFigure(other.take, other.solve, lined_up=True), other, alignment)
        start_s = 0.0 if other.take == clip.take else other.poses.begins_s - clip.poses.begins_s
        alignment = Alignment(np.eye(4), offset_s=start_s)
        return cls(SecondFigure(other.take, other.solve), other, alignment)

    @classmethod
    def reference(cls, take: str, name: str, motion: Reference, performer: int = 1) -> "Second":
        """Return a reference of the clip's take, on its stage; `performer`: number of its performer."""
        return cls(SecondFigure(take, reference=name), motion, Alignment(np.eye(4)), performer)

    def step(self, time_s: float, *, apart_m: float = 0.0) -> StepResult:
        """Return the figure at a stage time [s], moved to the performer's left by `apart_m`.

        If only joints are known, `positions_m` is NaN and `fused` holds them; NaN = unknown then.
        """
        time_s = float(self._own_s(time_s))
        shift = np.array([apart_m, 0.0, 0.0])
        if isinstance(self.shown, Clip):
            frame = self.shown.nearest(time_s)
            found = [
                self._body(one, frame, time_s, shift)
                for one in self.shown.everybody()
                if one.is_here(frame) or one is self.shown
            ]
            return replace(found[0], others=tuple(found[1:]))
        joints = joints_at(self.shown, time_s) + shift
        nowhere = np.full((len(OUTPUT_JOINTS), 3), np.nan)
        return replace(_step(time_s, nowhere, _AT_REST, joints), performer=self.performer)

    def _body(self, clip: Clip, frame: int, time_s: float, shift: NDArray[np.float64]) -> StepResult:
        positions = self.alignment.to_stage(clip.poses.positions_m[frame]) + shift
        turn = Rotation.from_matrix(self.alignment.T_reference_stage[:3, :3]).inv()
        own = Rotation.from_quat(clip.poses.rotations_wxyz[frame], scalar_first=True)
        step = _step(time_s, positions, (turn * own).as_quat(scalar_first=True), None)
        return replace(step, performer=clip.number)

    def path_m(self, times_s: NDArray[np.float64], joint: int) -> NDArray[np.float64]:
        """Return an output joint's places at stage times [s], shape (N, 3); NaN = unknown. They follow the alignment,
        without the shift to the side."""
        own_s = self._own_s(times_s)
        if isinstance(self.shown, Clip):
            known_s, places = self.shown.poses.time_s, self.shown.poses.positions_m[:, joint]
        elif joint in _CANONICAL:
            known_s, places = self.shown.time_s, self.shown.positions_m[:, _CANONICAL[joint]]
        else:
            return np.full((len(own_s), 3), np.nan)
        path = np.stack([np.interp(own_s, known_s, axis, np.nan, np.nan) for axis in places.T], axis=1)
        return self.alignment.to_stage(path)

    def _own_s(self, time_s: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Return its own times at stage times [s]."""
        return np.asarray(time_s + self.alignment.offset_s + self.alignment.drift_ppm * 1e-6 * time_s)


def joints_at(motion: Reference, time_s: float) -> NDArray[np.float64]:
    """Return the joints at a time [m], shape (21, 3), interpolated; NaN = unknown, or outside the motion."""
    times = motion.time_s
    if not times[0] <= time_s <= times[-1]:
        return np.full((JOINT_COUNT, 3), np.nan)
    after = min(max(int(np.searchsorted(times, time_s)), 1), len(times) - 1)
    share = (time_s - times[after - 1]) / (times[after] - times[after - 1])
    before_m, after_m = motion.positions_m[after - 1], motion.positions_m[after]
    return (1.0 - share) * before_m + share * after_m


def alignment_of(value: dict[str, Any]) -> Alignment:
    """Return an alignment from the keys of `Alignment.to_json`; missing ones are zero.

    Raises:
        SettingsError: numbers that are not an alignment.
    """
    wxyz = np.array(value.get("rotation_wxyz", [1.0, 0.0, 0.0, 0.0]), dtype=float)
    translation = np.array(value.get("translation_m", [0.0, 0.0, 0.0]), dtype=float)
    scale = float(value.get("scale", 1.0))
    numbers = [float(value.get(key, 0.0)) for key in ("time_offset_ms", "clock_drift_ppm")]
    finite = all(np.isfinite(part).all() for part in (wxyz, translation, scale, numbers))
    if not finite or abs(np.linalg.norm(wxyz) - 1.0) > 1e-3 or not 0.1 <= scale <= 10.0:
        raise SettingsError(
            "replay.alignment",
            "an alignment has rotation_wxyz (a unit quaternion), translation_m, scale (0.1 to "
            "10), time_offset_ms and clock_drift_ppm; take the one that the comparison answered",
        )
    rotation = Rotation.from_quat(wxyz, scalar_first=True).as_matrix()
    return Alignment(make_transform(rotation, translation), scale, numbers[0] * 1e-3, numbers[1])


def _step(
    time_s: float,
    positions_m: NDArray[np.float64],
    rotations_wxyz: NDArray[np.float64],
    joints_m: NDArray[np.float64] | None,
) -> StepResult:
    frames = FrameSet(
        round(time_s * 1e9), (), np.zeros((0, JOINT_COUNT, 3)), np.zeros((0, JOINT_COUNT)), np.zeros((0, 3))
    )
    joints = np.full((JOINT_COUNT, 3), np.nan) if joints_m is None else joints_m
    known = np.isfinite(joints).all(axis=1)
    fused = FusedSkeleton(
        joints, known.astype(float), np.full(JOINT_COUNT, np.nan), np.zeros((0, JOINT_COUNT), bool)
    )
    count = len(OUTPUT_JOINTS)
    return StepResult(frames, fused, positions_m, rotations_wxyz, np.ones(count), np.full(count, np.nan))
