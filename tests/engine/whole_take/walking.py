"""A walk before four cameras without depth: a real detector's landmarks, the true cameras and the true joints.

`STUDIO_TEST_DATA/rgb/walk_4_cameras`: a person at eight places and headings, one `segment` each. Run as a program, it
prints the errors of the solve by all groups of cameras.
"""

import argparse
import json
import os
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.proportions import measure
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, PictureJoints, StepResult
from studio.engine.model.joints import (
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    MIRROR,
    OUTPUT_OF_CANONICAL_INDEX,
    to_canonical,
)
from studio.engine.model.lens import Lens
from studio.engine.model.rays import on_rays, placed
from studio.engine.model.settings import SolveSettings
from studio.engine.solve.pipeline import Pipeline
from studio.engine.whole_take.finisher import Finisher

MEASURED = [INDEX[name] for name in MEASURED_JOINTS]
_HZ = 30.0


@dataclass(frozen=True)
class PicturedWalk:
    """The walk, by camera.

    Attributes:
        cameras: true cameras.
        frames: of each camera, at the same instants.
        segment: shape (frame_count,).
        true_m: canonical joints, shape (frame_count, 21, 3).
    """

    cameras: dict[str, CameraCalibration]
    frames: dict[str, list[CameraFrame]]
    segment: NDArray[np.int64]
    true_m: NDArray[np.float64]

    def performer(self) -> Performer:
        """The performer, measured from joints that all cameras place together."""
        centres = np.array([camera.T_stage_camera[:3, 3] for camera in self.cameras.values()])
        joints = []
        for frames in zip(*self.frames.values(), strict=True):
            found = np.array(
                [on_rays(self.cameras[f.camera], f.picture) for f in frames if f.picture is not None]
            )
            sure = np.array([f.confidence for f in frames])
            joints.append(placed(found, sure, centres, np.ones(len(centres), bool))[0])
        by_camera = np.swapaxes(np.array(joints), 0, 1)
        merged = _mean(by_camera)
        weights = np.isfinite(merged[None, :, :, 0]).astype(float)
        times_s = np.arange(len(merged)) / _HZ
        found = measure(Walk(times_s, merged[None], weights, merged))
        assert found is not None
        return found

    def solved(self, names: tuple[str, ...]) -> list[list[StepResult]]:
        """The live solve of each segment by some of the cameras."""
        first = next(iter(self.cameras))
        calibration = Calibration(first, {name: self.cameras[name] for name in names}, self.performer())
        edges = np.flatnonzero(np.diff(self.segment, prepend=-1, append=-1))
        return [self._segment(calibration, names, begin, end) for begin, end in pairwise(edges)]

    def _segment(
        self, calibration: Calibration, names: tuple[str, ...], begin: int, end: int
    ) -> list[StepResult]:
        pipeline = Pipeline(calibration, SolveSettings(output_hz=_HZ))
        results = []
        for k in range(begin, end):
            for name in names:
                pipeline.add_frame(self.frames[name][k])
            if k > begin:
                result = pipeline.step(self.frames[names[0]][k - 1].device_time_ns)
                assert result is not None
                results.append(result)
        return results

    def with_exchanged(self, name: str, *, every: int) -> "PicturedWalk":
        """The walk with left and right exchanged in each so many-th frame of a camera."""
        frames = [_mirrored(frame) if k % every == 0 else frame for k, frame in enumerate(self.frames[name])]
        return replace(self, frames=self.frames | {name: frames})

    def finished(self, live: list[list[StepResult]]) -> list[list[StepResult]]:
        """The segments of a live solve, finished."""
        performer, out = self.performer(), []
        for segment in live:
            finisher = Finisher(performer, SolveSettings(output_hz=_HZ), floor_given=True)
            for result in segment:
                finisher.add(result)
            out.append(list(finisher.results()))
        return out

    def errors_mm(self, results: list[list[StepResult]]) -> NDArray[np.float64]:
        """Errors of the measured joints, shape (result_count, 15)."""
        at = {frame.device_time_ns: k for k, frame in enumerate(next(iter(self.frames.values())))}
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
    cameras, frames = {}, {}
    for c, (name, about) in enumerate(json.loads((folder / "truth" / "cameras.json").read_text()).items()):
        K, R = np.array(about["K"]), np.array(about["R_camera_world"])
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R.T, -R.T @ np.array(about["t_camera_world_m"])
        cameras[name] = CameraCalibration(T, lens=Lens(K[0, 0], K[1, 1], K[0, 2], K[1, 2], width, height))
        frames[name] = [
            _frame(name, k, width, height, *(found[key][c, k] for key in ("pixels", "visibility", "world_m")))
            for k in range(found["pixels"].shape[1])
        ]
    truth = np.load(folder / "truth" / "landmarks_m.npz")["positions"]
    true_m = np.array([to_canonical("mediapipe", row, np.ones(len(row)))[0] for row in truth])
    return PicturedWalk(cameras, frames, found["segment"], true_m)


def _frame(
    name: str, k: int, width: int, height: int, pixels: np.ndarray, visibility: np.ndarray, world: np.ndarray
) -> CameraFrame:
    flat = np.column_stack([pixels, np.zeros(len(pixels))])
    joints, confidence = to_canonical("mediapipe", flat, visibility)
    picture = PictureJoints(width, height, joints[:, :2], to_canonical("mediapipe", world, visibility)[0])
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    return CameraFrame(name, k, round(k * 1e9 / _HZ), unseen, confidence, picture=picture)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m tests.engine.whole_take.walking", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[4] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    walk = read_walk(parser.parse_args().data / "rgb" / "walk_4_cameras")
    for count in range(len(walk.cameras), 1, -1):
        for names in combinations(walk.cameras, count):
            live = walk.solved(names)
            told = []
            for results in (live, walk.finished(live)):
                errors = walk.errors_mm(results)
                told.append(f"{errors.mean():5.1f} mm, 95 % under {np.percentile(errors, 95):5.1f}")
            print(f"{' '.join(names):26s} live {told[0]}; finished {told[1]}", flush=True)


if __name__ == "__main__":
    main()
