"""The solve `live` of a take, from the poses logged during its recording."""

from collections.abc import Sequence

from studio.engine.identity.recognised import performer_key
from studio.engine.identity.undecided import spans
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.solves import Solved, write_performers, write_solve
from studio.take.folder.take import Take
from studio.take.raw.pose_log import LoggedPoses, pose_files, read_poses

LIVE_SOLVE = "live"


def save_live_solve(take: Take, settings: SolveSettings, camera_frames: int) -> int:
    """Convert the take's pose logs to the solve `live` and remove the logs; return the number of poses.

    Raises:
        StudioError: the disk refuses; the pose logs stay.
    """
    files = pose_files(take.path)
    logged = {number: one for number, path in files.items() if (one := read_poses(path)) is not None}
    count = sum(one.poses.frame_count for one in logged.values())
    metrics: SolveMetrics = {"frames": count, "camera_frames": camera_frames}
    if set(logged) == {1}:
        write_solve(take, LIVE_SOLVE, settings=settings, poses=logged[1].poses, metrics=metrics)
    elif logged:
        performers = {
            performer_key(number): Solved(one.poses, _figures(one)) for number, one in logged.items()
        }
        metrics["performers"] = {name: one.metrics for name, one in performers.items()}
        metrics["recorded_s"] = recorded_spans([one.poses for one in logged.values()])
        write_performers(take, LIVE_SOLVE, settings=settings, performers=performers, metrics=metrics)
        del performers
    del logged
    for path in files.values():
        path.unlink(missing_ok=True)
    return count


def _figures(logged: LoggedPoses) -> SolveMetrics:
    doubts = [list(span) for span in spans(logged.undecided_s, 1)]
    return {"frames": logged.poses.frame_count, "undecided_s": doubts}


def recorded_spans(poses: Sequence[Poses]) -> list[list[float]]:
    """Return the span in which the live stage made poses of any performer, stage time [s]."""
    return [[min(float(one.time_s[0]) for one in poses), max(float(one.time_s[-1]) for one in poses)]]
