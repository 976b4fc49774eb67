"""A walk in front of four cameras without depth: a real detector's landmarks, the true cameras and the joints.

Recordings of `STUDIO_TEST_DATA/rgb`: `walk_4_cameras`, a person at eight places and headings, one `segment` each,
with true joints; and `pose2sim_single`, videos of a person on a treadmill. Its joints are those that all four cameras
place, smoothed as usual in gait analysis (Butterworth, 6 Hz).

Run as a program, it prints the errors of the solve by all groups of cameras, and those where all cameras but one lose
the performer.
"""

import argparse
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, islice, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from studio.engine.base.geometry import make_transform
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.proportions import measure
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.frames import CameraFrame, PictureJoints, StepResult
from studio.engine.model.human.face import seen_in
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    MIRROR,
    OUTPUT_OF_CANONICAL_INDEX,
    to_canonical,
)
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.triangulation.rays import ACROSS_PER_M, nearest_on_rays, on_rays, placed
from studio.engine.model.triangulation.triangulation import triangulate
from studio.engine.solve.pipeline import Pipeline
from studio.engine.whole_take.finisher import Finisher
from studio.take.video.file import VideoFile
from studio.take.video.landmarks import LandmarkReader
from studio.take.video.picture import small_picture
from studio.wire import LandmarkArrays

MEASURED = [INDEX[name] for name in MEASURED_JOINTS]
LEFT_S = (0.4, 0.8)
"""Times for which one camera alone sees the performer at the end of each segment."""

_CUTOFF_HZ = 6.0
_SURE = 0.7


@dataclass(frozen=True)
class PicturedWalk:
    """The walk, by camera.

    Attributes:
        cameras: true cameras.
        frames: of each camera, at the same instants.
        segment: shape (frame_count,).
        true_m: canonical joints, shape (frame_count, 21, 3).
        hz: frames a second.
        lost: instants at which a camera, by name, sends nothing to the solve, shape (frame_count,); none = never.
    """

    cameras: dict[str, CameraCalibration]
    frames: dict[str, list[CameraFrame]]
    segment: NDArray[np.int64]
    true_m: NDArray[np.float64]
    hz: float = 30.0
    lost: dict[str, NDArray[np.bool_]] = field(default_factory=dict)

    def placed_m(self) -> NDArray[np.float64]:
        """The joints placed by all cameras, by camera, shape (camera_count, frame_count, 21, 3)."""
        centres = np.array([camera.T_stage_camera[:3, 3] for camera in self.cameras.values()])
        joints = [placed(ends, sure, centres, np.ones(len(centres), bool))[0] for ends, sure in self._rays()]
        return np.swapaxes(np.array(joints), 0, 1)

    def _rays(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield points on the cameras' rays at each instant, shape (camera_count, 21, 3), and confidences."""
        for frames in zip(*self.frames.values(), strict=True):
            ends = [on_rays(self.cameras[f.camera], f.picture) for f in frames if f.picture is not None]
            yield np.array(ends), np.array([f.confidence for f in frames])

    def missed_mm(self) -> NDArray[np.float64]:
        """How far each camera's rays miss the joints that the others place, median of confident ones, shape (21,)."""
        centres = np.array([camera.T_stage_camera[:3, 3] for camera in self.cameras.values()])
        missed = []
        for ends, sure in self._rays():
            if len(ends) < len(sure):
                continue
            for c in range(len(centres)):
                others = np.arange(len(centres)) != c
                errors = ACROSS_PER_M / np.maximum(sure[others], 0.05)
                places = triangulate(ends[others], errors, centres[others], np.ones(others.sum(), bool))
                off = np.linalg.norm(nearest_on_rays(ends[c], centres[c], places) - places, axis=1)
                missed.append(np.where(sure[c] > _SURE, off, np.nan))
        seen = np.isfinite(missed).any(axis=0)
        return 1e3 * np.array(
            [np.nanmedian(one) if s else np.nan for one, s in zip(np.transpose(missed), seen, strict=True)]
        )

    @cached_property
    def performer(self) -> Performer:
        """The performer, measured from joints that all cameras place together."""
        merged = _mean(self.placed_m())
        weights = np.isfinite(merged[None, :, :, 0]).astype(float)
        times_s = np.arange(len(merged)) / self.hz
        found = measure(Walk(times_s, merged[None], weights, merged))
        assert found is not None
        return found

    def solved(self, names: tuple[str, ...]) -> list[list[StepResult]]:
        """The live solve of each segment by some of the cameras."""
        first = next(iter(self.cameras))
        calibration = Calibration(first, {name: self.cameras[name] for name in names}, self.performer)
        edges = np.flatnonzero(np.diff(self.segment, prepend=-1, append=-1))
        return [self._segment(calibration, names, begin, end) for begin, end in pairwise(edges)]

    def _segment(
        self, calibration: Calibration, names: tuple[str, ...], begin: int, end: int
    ) -> list[StepResult]:
        pipeline = Pipeline(calibration, SolveSettings(output_hz=self.hz))
        results = []
        for k in range(begin, end):
            for name in names:
                if name not in self.lost or not self.lost[name][k]:
                    pipeline.add_frame(self.frames[name][k])
            if k > begin:
                result = pipeline.step(self.frames[names[0]][k - 1].device_time_ns)
                if result is not None:  # the first frames may show nobody
                    results.append(result)
        return results

    def with_exchanged(self, name: str, *, every: int) -> "PicturedWalk":
        """The walk with left and right exchanged in every n-th frame of a camera."""
        frames = [_mirrored(frame) if k % every == 0 else frame for k, frame in enumerate(self.frames[name])]
        return replace(self, frames=self.frames | {name: frames})

    def with_exchanged_at_first(self, name: str, *, frames: int) -> "PicturedWalk":
        """The walk with left and right exchanged in a camera's first frames of each segment."""
        began = np.flatnonzero(np.diff(self.segment, prepend=-1))
        first = (np.arange(len(self.segment)) - began[:, None] >= 0) & (
            np.arange(len(self.segment)) - began[:, None] < frames
        )
        mine = zip(self.frames[name], first.any(axis=0), strict=True)
        return replace(
            self, frames=self.frames | {name: [_mirrored(frame) if turn else frame for frame, turn in mine]}
        )

    def last(self, seconds: float) -> NDArray[np.bool_]:
        """Which instants are in the last seconds of their segment, shape (frame_count,)."""
        ends = np.flatnonzero(np.diff(self.segment, append=-1))
        instants = np.arange(len(self.segment))
        ending = ends[np.searchsorted(ends, instants)]
        return np.asarray(ending - instants < round(seconds * self.hz))

    def with_one_left(self, name: str, seconds: float) -> "PicturedWalk":
        """The walk of which all other cameras lose the last seconds of each segment."""
        return replace(self, lost={other: self.last(seconds) for other in self.cameras if other != name})

    def with_turned(self, name: str, degrees: float) -> "PicturedWalk":
        """The walk with a camera that is assumed to look further up than it does."""
        angle = np.radians(degrees)
        up = make_transform(
            np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]),
            np.zeros(3),
        )
        camera = self.cameras[name]
        turned = replace(camera, T_stage_camera=camera.T_stage_camera @ up)
        return replace(self, cameras=self.cameras | {name: turned})

    def finished(self, live: list[list[StepResult]]) -> list[list[StepResult]]:
        """The segments of a live solve, finished."""
        performer, out = self.performer, []
        for segment in live:
            finisher = Finisher(performer, SolveSettings(output_hz=self.hz), floor_given=True)
            for result in segment:
                finisher.add(result)
            out.append(list(finisher.results()))
        return out

    def jerk_m_s3(self, results: list[list[StepResult]]) -> float:
        """Mean jerk of the measured joints."""
        joints = [
            np.array([r.positions_m[OUTPUT_OF_CANONICAL_INDEX][MEASURED] for r in segment])
            for segment in results
        ]
        jerks = [np.linalg.norm(np.diff(one, n=3, axis=0), axis=2).ravel() for one in joints]
        return float(np.concatenate(jerks).mean() * self.hz**3)

    def errors_mm(
        self, results: list[list[StepResult]], counts: NDArray[np.bool_] | None = None
    ) -> NDArray[np.float64]:
        """Errors of the measured joints, shape (result_count, 15); `counts`: at these instants only, shape
        (frame_count,)."""
        first = next(iter(self.frames.values()))
        at = {frame.device_time_ns: k for k, frame in enumerate(first) if counts is None or counts[k]}
        return np.array(
            [
                1e3
                * np.linalg.norm(
                    result.positions_m[OUTPUT_OF_CANONICAL_INDEX][MEASURED]
                    - self.true_m[at[result.frame_set.stage_time_ns]][MEASURED],
                    axis=1,
                )
                for segment in results
                for result in segment
                if result.frame_set.stage_time_ns in at
            ]
        )


def _mirrored(frame: CameraFrame) -> CameraFrame:
    assert frame.picture is not None
    picture = replace(
        frame.picture, pixels=frame.picture.pixels[MIRROR], world_m=frame.picture.world_m[MIRROR]
    )
    return replace(frame, confidence=frame.confidence[MIRROR], picture=picture)


def _mean(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    seen = np.isfinite(joints)
    total, count = np.where(seen, joints, 0.0).sum(axis=0), seen.sum(axis=0)
    return np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)


def read_walk(folder: Path) -> PicturedWalk:
    """Read the walk of `rgb/walk_4_cameras`."""
    found = np.load(folder / "landmarks.npz")
    width, height = (int(number) for number in found["image_size"])
    cameras = _cameras(folder, width, height)
    frames = {
        name: [
            _frame(name, round(k * 1e9 / 30.0), LandmarkArrays(width, height, pixels, world), visible)
            for k, (pixels, world, visible) in enumerate(zip(*by_camera, strict=True))
        ]
        for name, *by_camera in zip(
            cameras, found["pixels"], found["world_m"], found["visibility"], strict=True
        )
    }
    truth = np.load(folder / "truth" / "landmarks_m.npz")["positions"]
    true_m = np.array([to_canonical("mediapipe", row, np.ones(len(row)))[0] for row in truth])
    return PicturedWalk(cameras, frames, found["segment"], true_m)


def read_treadmill(folder: Path, count: int | None = None) -> PicturedWalk:
    """Read the videos of `rgb/pose2sim_single`, or their first frames."""
    frames = {}
    for path in sorted(folder.glob("cam*.mp4")):
        reader, mine = LandmarkReader("full", hands=False), []
        for time_ns, picture in islice(VideoFile.open(path).frames(), count):
            seen, pose = reader.read(small_picture(picture))
            sure = np.zeros(len(seen.pixels)) if pose is None else pose.visibility
            mine.append(_frame(path.stem, time_ns, seen, sure))
        frames[path.stem] = mine
    hz = 1e9 / np.diff([frame.device_time_ns for frame in mine]).mean()
    cameras = _cameras(folder, seen.width, seen.height)
    whole = PicturedWalk(cameras, frames, np.zeros(len(mine)), np.empty(0), hz)
    filled = np.apply_along_axis(_filled, 0, _mean(whole.placed_m()))
    smooth = sosfiltfilt(butter(4, _CUTOFF_HZ, fs=whole.hz, output="sos"), filled, axis=0)
    return replace(whole, true_m=smooth)


def _filled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    known = np.isfinite(values)
    if not known.any():
        return values
    return np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])


def _cameras(folder: Path, width: int, height: int) -> dict[str, CameraCalibration]:
    cameras = {}
    for name, about in json.loads((folder / "truth" / "cameras.json").read_text()).items():
        K, R = np.array(about["K"]), np.array(about["R_camera_world"])
        T = make_transform(R.T, -R.T @ np.array(about["t_camera_world_m"]))
        lens = Lens(K[0, 0], K[1, 1], K[0, 2], K[1, 2], width, height, tuple(about.get("distortion", ())))
        cameras[name] = CameraCalibration(T, lens=lens)
    return cameras


def _frame(name: str, time_ns: int, seen: LandmarkArrays, visibility: NDArray[np.float64]) -> CameraFrame:
    flat = np.column_stack([seen.pixels, np.zeros(len(seen.pixels))])
    joints, confidence = to_canonical("mediapipe", flat, visibility)
    world_m = np.full((JOINT_COUNT, 3), np.nan)
    if seen.world_m is not None:
        world_m, _ = to_canonical("mediapipe", seen.world_m, visibility)
    face = seen_in("mediapipe", seen.pixels, visibility)
    picture = PictureJoints(seen.width, seen.height, joints[:, :2], world_m, face=face)
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    return CameraFrame(name, time_ns, time_ns, unseen, confidence, picture=picture)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m tests.engine.whole_take.walking", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[4] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    data = parser.parse_args().data / "rgb"
    for title, walk in (
        ("treadmill", read_treadmill(data / "pose2sim_single")),
        ("walk", read_walk(data / "walk_4_cameras")),
    ):
        missed = zip(CANONICAL, walk.missed_mm(), strict=True)
        print(title, "missed [mm]:", ", ".join(f"{name} {mm:.0f}" for name, mm in missed), flush=True)
        for count in range(len(walk.cameras), 1, -1):
            for names in combinations(walk.cameras, count):
                live = walk.solved(names)
                told = []
                for results in (live, walk.finished(live)):
                    errors = walk.errors_mm(results)
                    told.append(f"{errors.mean():5.1f} mm, 95 % under {np.percentile(errors, 95):5.1f}")
                print(f"{title} {' '.join(names):26s} live {told[0]}; finished {told[1]}", flush=True)
        for seconds in LEFT_S:
            means = []
            for name in walk.cameras:
                left = walk.with_one_left(name, seconds)
                live = left.solved(tuple(walk.cameras))
                last = left.last(seconds)
                means.append([left.errors_mm(one, last).mean() for one in (live, left.finished(live))])
            live_mm, finished_mm = np.mean(means, axis=0)
            print(
                f"{title}, one left for {seconds} s: live {live_mm:.1f} mm; finished {finished_mm:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
