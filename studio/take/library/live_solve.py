"""The solve `live` of a take, from the poses logged during its recording."""

from studio.engine.identity.recognised import performer_key
from studio.engine.model.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.solves import Solved, write_performers, write_solve
from studio.take.folder.take import Take
from studio.take.raw.pose_log import pose_files, read_poses

LIVE_SOLVE = "live"


def save_live_solve(take: Take, settings: SolveSettings, camera_frames: int) -> int:
    """Convert the take's pose logs to the solve `live` and remove the logs; return the number of poses.

    Raises:
        StudioError: the disk refuses; the pose logs stay.
    """
    files = pose_files(take.path)
    poses = {number: one for number, path in files.items() if (one := read_poses(path)) is not None}
    count = sum(one.frame_count for one in poses.values())
    metrics: SolveMetrics = {"frames": count, "camera_frames": camera_frames}
    if set(poses) == {1}:
        write_solve(take, LIVE_SOLVE, settings=settings, poses=poses[1], metrics=metrics)
    elif poses:
        performers = {
            performer_key(number): Solved(one, {"frames": one.frame_count}) for number, one in poses.items()
        }
        metrics["performers"] = {name: one.metrics for name, one in performers.items()}
        write_performers(take, LIVE_SOLVE, settings=settings, performers=performers, metrics=metrics)
        del performers
    del poses
    for path in files.values():
        path.unlink(missing_ok=True)
    return count
