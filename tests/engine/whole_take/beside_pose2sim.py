"""Pose2Sim's pipeline compared with this studio, on the same videos, landmarks and cameras.

Figures: docs/experiments/beside_pose2sim.md.

- `write FOLDER` makes projects for Pose2Sim from `STUDIO_TEST_DATA/rgb/pose2sim_single`: one with all cameras, and
  one without each of them. Pose2Sim then runs in each: personAssociation, triangulation, filtering.
- `compare FOLDER` prints the figures of its results, of this studio live, and of this studio finished.
"""

import argparse
import json
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.calibration import CameraCalibration
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.take.video.landmarks import landmarks_of
from tests.engine.whole_take.walking import PicturedWalk, read_treadmill

JOINTS = tuple(
    f"{side}_{part}"
    for side in ("left", "right")
    for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
_THEIRS = {
    f"{side}_{part}": f"{side[0].upper()}{part.title()}" for side, part in (j.split("_") for j in JOINTS)
}
_BONES = [
    (JOINTS.index(f"{side}_{a}"), JOINTS.index(f"{side}_{b}"))
    for side in ("left", "right")
    for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
]
_OURS = [INDEX[name] for name in JOINTS]
_STANDS_M = 0.02
"""A foot stands while its ankle is at most this far above its lowest place."""

_CONFIG = """\
[project]
multi_person = false
frame_rate = 60
frame_range = 'all'
[pose]
pose_model = 'BLAZEPOSE'
[personAssociation.single_person]
likelihood_threshold_association = 0.3
reproj_error_threshold_association = 20
tracked_keypoint = 'RShoulder'
[triangulation]
reproj_error_threshold_triangulation = 15
likelihood_threshold_triangulation = 0.3
min_cameras_for_triangulation = 2
interp_if_gap_smaller_than = 20
interpolation = 'linear'
fill_large_gaps_with = 'last_value'
sections_to_keep = 'all'
min_chunk_size = 10
max_distance_m = 1.0
make_c3d = false
[filtering]
reject_outliers = true
filter = true
type = 'butterworth'
display_figures = false
save_filt_plots = false
make_c3d = false
[filtering.butterworth]
cut_off_frequency = 6
order = 4
"""


def write(videos: Path, cameras: dict[str, CameraCalibration], folder: Path) -> None:
    """Write the projects: calibration, settings and OpenPose files with BlazePose's 33 landmarks."""
    found = {name: landmarks_of(videos / f"{name}.mp4", progress=lambda share: None) for name in cameras}
    for left_out in (None, *cameras):
        project = folder / ("all" if left_out is None else f"without_{left_out}")
        (project / "calibration").mkdir(parents=True)
        (project / "Config.toml").write_text(_CONFIG, encoding="utf-8")
        used = [name for name in cameras if name != left_out]
        told = "".join(_toml(name, cameras[name]) for name in used)
        (project / "calibration" / "Calib.toml").write_text(told, encoding="utf-8")
        for name in used:
            pose = project / "pose" / f"{name}_json"
            pose.mkdir(parents=True)
            seen = zip(found[name].pictures, found[name].visibility, strict=True)
            for k, (picture, visible) in enumerate(seen):
                points = np.nan_to_num(np.column_stack([picture.pixels, visible]))
                person = {"person_id": [-1], "pose_keypoints_2d": points.ravel().round(3).tolist()}
                file = pose / f"{name}_{k:06d}.json"
                file.write_text(json.dumps({"version": 1.3, "people": [person]}), encoding="utf-8")


def _toml(name: str, camera: CameraCalibration) -> str:
    lens, T = camera.lens, invert_transform(camera.T_stage_camera)
    assert lens is not None
    turn = Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist()
    return (
        f'[{name}]\nname = "{name}"\nsize = [{float(lens.width)}, {float(lens.height)}]\n'
        f"matrix = [[{lens.fx}, 0.0, {lens.cx}], [0.0, {lens.fy}, {lens.cy}], [0.0, 0.0, 1.0]]\n"
        f"distortions = {list((lens.distortion or (0.0,) * 4)[:4])}\nrotation = {turn}\n"
        f"translation = {T[:3, 3].tolist()}\nfisheye = false\n"
    )


def read_trc(project: Path, frame_count: int) -> NDArray[np.float64]:
    """Return the filtered joints that Pose2Sim wrote, shape (frame_count, 12, 3) [m], z up; NaN = left out."""
    (file,) = (project / "pose-3d").glob("*filt*.trc")
    lines = file.read_text(encoding="utf-8").splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name]
    points = np.full((frame_count, len(names), 3), np.nan)
    for line in filter(str.strip, lines[5:]):
        number, _, *values = line.split("\t")
        row = [float(value or "nan") for value in values[: 3 * len(names)]]
        points[int(number)] = np.reshape(row, (-1, 3))
    lower = [name.lower() for name in names]  # it writes "Lknee"
    chosen = points[:, [lower.index(_THEIRS[name].lower()) for name in JOINTS]]
    return chosen[..., [2, 0, 1]]  # its y is up


def solved(walk: PicturedWalk, names: tuple[str, ...], *, finished: bool) -> NDArray[np.float64]:
    """Return this studio's joints at the frames, shape (frame_count, 12, 3) [m]; NaN before the first."""
    live = walk.solved(names)
    out = np.full((len(walk.segment), len(JOINTS), 3), np.nan)
    at = {frame.device_time_ns: k for k, frame in enumerate(walk.frames[names[0]])}
    for segment in walk.finished(live) if finished else live:
        for result in segment:
            joints = result.positions_m[OUTPUT_OF_CANONICAL_INDEX][_OURS]
            out[at[result.frame_set.stage_time_ns]] = joints
    return out


def figures(walk: PicturedWalk, joints: NDArray[np.float64], stands: NDArray[np.bool_]) -> dict[str, float]:
    """Return jerk, spread of bone lengths, and slide of standing feet along the belt."""
    known = joints[np.isfinite(joints).all(axis=(1, 2))]
    jerk = np.linalg.norm(np.diff(known, n=3, axis=0), axis=2) * walk.hz**3
    bones = np.array([np.linalg.norm(known[:, a] - known[:, b], axis=1).std() for a, b in _BONES])
    ankles = joints[:, [JOINTS.index("left_ankle"), JOINTS.index("right_ankle")], :2]
    speed = np.diff(ankles, axis=0) * walk.hz
    standing = speed[stands[1:] & stands[:-1] & np.isfinite(speed).all(axis=2)]
    slide = np.linalg.norm(standing - np.median(standing, axis=0), axis=1)
    return {
        "jerk": float(jerk.mean()),
        "bones": float(bones.mean() * 1e3),
        "slide": float(slide.mean() * 1e2),
    }


def missed_px(walk: PicturedWalk, name: str, joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far a camera's landmarks are from the joints of a solve without it [pixels]."""
    camera = walk.cameras[name]
    assert camera.lens is not None
    shown = camera.lens.pixels_of(transform_points(invert_transform(camera.T_stage_camera), joints))
    seen = np.array([frame.picture.pixels[_OURS] for frame in walk.frames[name] if frame.picture])
    sure = np.array([frame.confidence[_OURS] > 0.5 for frame in walk.frames[name]])
    off = np.linalg.norm(shown - seen, axis=2)[sure]
    return off[np.isfinite(off)]


def compare(walk: PicturedWalk, folder: Path) -> None:
    """Print the figures of the three ways."""
    heights = walk.true_m[:, [INDEX["left_ankle"], INDEX["right_ankle"]], 2]
    stands = heights < heights.min(axis=0) + _STANDS_M
    every = tuple(walk.cameras)
    ways = {
        "Pose2Sim": lambda names, project: read_trc(folder / project, len(walk.segment)),
        "studio, live": lambda names, project: solved(walk, names, finished=False),
        "studio, finished": lambda names, project: solved(walk, names, finished=True),
    }
    for way, joints_of in ways.items():
        told = figures(walk, joints_of(every, "all"), stands)
        off = [
            missed_px(walk, name, joints_of(tuple(n for n in every if n != name), f"without_{name}"))
            for name in every
        ]
        print(
            f"{way}: jerk {told['jerk']:.0f} m/s3, bones {told['bones']:.1f} mm, slide {told['slide']:.1f} cm/s, "
            f"left-out cameras {np.median(np.concatenate(off)):.1f} px, 95 % under "
            f"{np.percentile(np.concatenate(off), 95):.1f} px"
        )


def main() -> None:
    """Write the projects, or compare."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.engine.whole_take.beside_pose2sim", description=__doc__
    )
    parser.add_argument("what", choices=("write", "compare"))
    parser.add_argument("folder", type=Path)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[4] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    chosen = parser.parse_args()
    videos = chosen.data / "rgb" / "pose2sim_single"
    walk = read_treadmill(videos)
    if chosen.what == "write":
        write(videos, walk.cameras, chosen.folder)
    else:
        compare(walk, chosen.folder)


if __name__ == "__main__":
    main()
