"""The solve `live` of a take, made of the poses that were kept while it was recorded."""

from pathlib import Path

from studio.engine.settings import SolveSettings
from studio.take.pose_log import POSE_LOG, read_poses
from studio.take.solves import write_solve
from studio.take.take import Take

LIVE_SOLVE = "live"


def save_live_solve(take: Take, settings: SolveSettings, camera_frames: int) -> int:
    """Make the solve `live` of the take's pose log, which is removed; return how many poses it has.

    Raises:
        StudioError: the disk does not take it; the pose log stays.
    """
    path: Path = take.path / POSE_LOG
    poses = read_poses(path) if path.is_file() else None
    count = 0 if poses is None else poses.frame_count
    if poses is not None:
        metrics = {"frames": count, "camera_frames": camera_frames}
        write_solve(take, LIVE_SOLVE, settings=settings, poses=poses, metrics=metrics)
    del poses
    path.unlink(missing_ok=True)
    return count
