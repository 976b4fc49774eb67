"""The solve `live` of a take, from the poses logged during its recording."""

from pathlib import Path

from studio.engine.model.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.take.raw.pose_log import POSE_LOG, read_poses

LIVE_SOLVE = "live"


def save_live_solve(take: Take, settings: SolveSettings, camera_frames: int) -> int:
    """Convert the take's pose log to the solve `live` and remove the log; return the number of poses.

    Raises:
        StudioError: the disk refuses; the pose log stays.
    """
    path: Path = take.path / POSE_LOG
    poses = read_poses(path) if path.is_file() else None
    count = 0 if poses is None else poses.frame_count
    if poses is not None:
        metrics: SolveMetrics = {"frames": count, "camera_frames": camera_frames}
        write_solve(take, LIVE_SOLVE, settings=settings, poses=poses, metrics=metrics)
    del poses
    path.unlink(missing_ok=True)
    return count
