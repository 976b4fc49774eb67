"""The cameras' joints around some pins, at even instants, with left and right corrected."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.edits.frames import places_between, stage_s
from studio.engine.model.calibration import Calibration, trunk_of
from studio.engine.model.cameras.joint_noise import JOINT_FACTOR
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT, LIMB_ROOTS, MIRROR
from studio.engine.model.triangulation.rays import nearest_on_rays, on_rays, placed
from studio.engine.whole_take.mending.middle import filled, median_of
from studio.engine.whole_take.mending.sides import exchanged_sides

Array = NDArray[np.float64]

STEP_S = 1.0 / 30.0
"""Time between two instants."""

GAP_S = 0.1
"""Longest gap between two frames that is interpolated."""

AXES_S = 0.1
"""Smoothing of the trunk's axes."""


@dataclass(frozen=True)
class SeenByCamera:
    """A camera's frames around pins.

    Attributes:
        places: their indices among all frames of the camera.
        time_s: stage time of each [s], shape (frame_count,).
        positions: joints in the stage frame [m], shape (frame_count, 21, 3); for a camera without depth, points on
            their rays; NaN = unseen.
        confidence: shape (frame_count, 21).
        depthless: the camera sees no depth.
    """

    places: range
    time_s: Array
    positions: Array
    confidence: Array
    depthless: bool


@dataclass(frozen=True)
class Around:
    """All cameras around some pins. A joint of a camera without depth is the point of its ray that is nearest to the
    joint placed by all cameras together.

    Attributes:
        time_s: the instants, `STEP_S` apart [s], shape (count,).
        cameras: by name, in the order of the axes below.
        tracks: joints with left and right corrected [m], shape (count, camera_count, 21, 3); NaN = unseen.
        noise: standard deviation of each relative to that of a clearly seen elbow, shape (count, camera_count, 21).
        exchanged: instants at which a camera has left and right exchanged, shape (count, camera_count).
    """

    time_s: Array
    cameras: dict[str, SeenByCamera]
    tracks: Array
    noise: Array
    exchanged: NDArray[np.bool_]

    def middle(self) -> Array:
        """Return the median over the cameras, gaps filled in time [m], shape (count, 21, 3)."""
        return filled(median_of(self.tracks))

    def row_of(self, time_s: float) -> int:
        """Return the index of the nearest instant."""
        return int(np.clip(round((time_s - self.time_s[0]) / STEP_S), 0, len(self.time_s) - 1))

    def rows_of(self, start_s: float, end_s: float) -> slice:
        """Return the instants between two times, at least one."""
        return slice(self.row_of(start_s), self.row_of(end_s) + 1)


def around(
    frames: Mapping[str, Sequence[CameraFrame]],
    calibration: Calibration,
    begin_s: float,
    end_s: float,
    doubted: Sequence[int] = (),
) -> Around | None:
    """Return the cameras' joints between two stage times [s]; None where they see nothing.

    `doubted`: joints that are not used to decide which cameras have left and right exchanged.
    """
    time_s = np.arange(begin_s, end_s + 0.5 * STEP_S, STEP_S)
    cameras = {
        name: found
        for name, mine in frames.items()
        if name in calibration.cameras
        and (found := _of_camera(name, mine, calibration, begin_s, end_s)) is not None
    }
    if not cameras:
        return None
    grids = [_on_grid(time_s, seen) for seen in cameras.values()]
    tracks = np.stack([positions for positions, _, _ in grids], axis=1)
    noise = np.stack([noise for _, noise, _ in grids], axis=1)
    centres = np.array([calibration.cameras[name].T_stage_camera[:3, 3] for name in cameras])
    depthless = np.array([seen.depthless for seen in cameras.values()])
    exchanged = np.zeros(tracks.shape[:2], dtype=bool)
    if depthless.any():
        confidence = np.stack([own for _, _, own in grids], axis=1)
        exchanged = _put_on_rays(tracks, confidence, centres, depthless)
    if not depthless.all():
        told = tracks[:, ~depthless]
        told[:, :, list(doubted)] = np.nan
        exchanged[:, ~depthless] = exchanged_sides(told)
    tracks = np.where(exchanged[..., None, None], tracks[:, :, MIRROR], tracks)
    noise = np.where(exchanged[..., None], noise[:, :, MIRROR], noise)
    return Around(time_s, cameras, tracks, noise, exchanged)


def _of_camera(
    name: str, frames: Sequence[CameraFrame], calibration: Calibration, begin_s: float, end_s: float
) -> SeenByCamera | None:
    """A camera's joints between two times; None without frames there."""
    time_of = stage_s(calibration, name)
    places = places_between(frames, time_of, begin_s, end_s)
    found = [frames[place] for place in places]
    if not found:
        return None
    camera, times = calibration.cameras[name], np.array([time_of(frame) for frame in found])
    pictures = [frame.picture for frame in found if frame.picture is not None]
    if len(pictures) == len(found):
        trunk = trunk_of(calibration.performer)
        positions = np.array([on_rays(camera, picture.of_body(trunk)) for picture in pictures])
    else:
        seen = unbiased(np.array([frame.positions for frame in found]), camera.depth_bias_m)
        positions = transform_points(camera.T_stage_camera, seen)
    confidence = np.array([frame.confidence for frame in found])
    return SeenByCamera(places, times, positions, confidence, bool(pictures))


def _put_on_rays(
    tracks: Array, confidence: Array, centres: Array, depthless: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Move joints of cameras without depth, in place, to where all cameras place them on their rays, under the names
    from these cameras; return where they have left and right exchanged, shape (count, camera_count)."""
    exchanged = np.zeros(tracks.shape[:2], dtype=bool)
    for row, (seen, sure) in enumerate(zip(tracks, confidence, strict=True)):
        out, _ = placed(seen, sure, centres, depthless)
        for camera in np.flatnonzero(depthless):
            stays, turns = (
                _off_rays(out[camera], centres[camera], one) for one in (seen[camera], seen[camera][MIRROR])
            )
            exchanged[row, camera] = turns < stays
            seen[camera] = out[camera][MIRROR] if turns < stays else out[camera]
    return exchanged


def _off_rays(joints: Array, centre: Array, points: Array) -> float:
    """Mean distance of joints from rays through points [m]; 0 where none is known."""
    off = np.linalg.norm(nearest_on_rays(points, centre, joints) - joints, axis=-1)
    known = np.isfinite(off)
    return float(off[known].mean()) if known.any() else 0.0


def _on_grid(time_s: Array, seen: SeenByCamera) -> tuple[Array, Array, Array]:
    """A camera's joints, shape (count, 21, 3), NaN where it sees none, their noise and confidence, (count, 21)."""
    out = np.full((len(time_s), JOINT_COUNT, 3), np.nan)
    doubt = np.clip(1.0 + 5.0 * (0.85 - seen.confidence), 1.0, 4.5)
    noise, confidence = np.ones((2, len(time_s), JOINT_COUNT))
    for joint in range(JOINT_COUNT):
        known = np.isfinite(seen.positions[:, joint, 0])
        if known.sum() < 2:
            continue
        times = seen.time_s[known]
        after = np.clip(np.searchsorted(times, time_s), 1, len(times) - 1)
        near = times[after] - times[after - 1] < GAP_S
        near &= (time_s >= times[0] - 0.5 * STEP_S) & (time_s <= times[-1] + 0.5 * STEP_S)
        for axis in range(3):
            own = np.interp(time_s, times, seen.positions[known, joint, axis])
            out[near, joint, axis] = own[near]
        noise[:, joint] = JOINT_FACTOR[joint] * np.interp(time_s, times, doubt[known, joint])
        confidence[:, joint] = np.interp(time_s, times, seen.confidence[known, joint])
    return out, noise, confidence


def axes_of(middle: Array, joint: int) -> tuple[Array, Array]:
    """Return axes in which a joint moves little, shape (count, 3, 3), and their origin [m], shape (count, 3).

    For a limb these are the trunk's axes at the limb's root, smoothed; for a joint of the trunk the stage's, at the
    mean of its other joints.

    Args:
        middle: joints without gaps [m], shape (count, 21, 3).
        joint: index of the joint.
    """
    smooth = gaussian_filter1d(middle, AXES_S / STEP_S, axis=0, mode="nearest")
    root = int(LIMB_ROOTS[joint])
    if root == joint:
        others = [INDEX[name] for name in ("hips", "chest", "neck") if INDEX[name] != joint]
        return np.tile(np.eye(3), (len(middle), 1, 1)), smooth[:, others].mean(axis=1)
    part = "hip" if root in (INDEX["left_hip"], INDEX["right_hip"]) else "shoulder"
    x = _unit(smooth[:, INDEX[f"left_{part}"]] - smooth[:, INDEX[f"right_{part}"]])
    y = _unit(np.cross(smooth[:, INDEX["neck"]] - smooth[:, INDEX["hips"]], x))
    return np.stack([x, y, np.cross(x, y)], axis=2), smooth[:, root]


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-6)
