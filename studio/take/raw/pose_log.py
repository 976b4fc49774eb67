"""The live poses of a take during its recording, written to disk at once: `live.poses`, records of one size.

Further performers have a file each, `live.performer_2.poses`. At the end of the take they become the solve `live`. A
record has the number of its tick in the live log; after a crash the poses and the log can be cut to the same length.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import TakeError
from studio.engine.base.file_sentences import unreadable
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.poses import Poses

POSE_LOG = "live.poses"
UNDECIDED = 1 << 62
"""Added to a record's tick where the performer was not told apart from another."""

_COUNT = len(OUTPUT_JOINTS)
RECORD = np.dtype(
    [
        ("tick", "<i8"),
        ("stage_time_ns", "<i8"),
        ("positions_m", "<f8", (_COUNT, 3)),
        ("rotations_wxyz", "<f8", (_COUNT, 4)),
        ("confidence", "<f8", (_COUNT,)),
        ("uncertainty_mm", "<f8", (_COUNT,)),
    ]
)


class PoseLog:
    """Writes the live poses of one performer; one thread writes.

    Args:
        path: the file.
        ticks: continue after this many ticks of the live log and delete later records; None: a new file.

    Raises:
        OSError: the disk refuses; from any method.
    """

    def __init__(self, path: Path, *, ticks: int | None = None) -> None:
        self.path = path
        if ticks is not None and self.path.is_file():
            whole = int((read_records(self.path)["tick"] % UNDECIDED < ticks).sum())
            os.truncate(self.path, whole * RECORD.itemsize)
        self._file = open(self.path, "wb" if ticks is None else "ab")

    def add(self, tick: int, result: StepResult) -> None:
        """Write the pose of tick number `tick`."""
        record = np.zeros((), dtype=RECORD)
        record["tick"] = tick + (UNDECIDED if result.undecided else 0)
        record["stage_time_ns"] = result.frame_set.stage_time_ns
        for name in ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"):
            record[name] = getattr(result, name)
        self._file.write(record.tobytes())

    def write_out(self) -> None:
        """Pass all data to the operating system, so that it outlives this program, but not the machine."""
        self._file.flush()

    def sync(self) -> None:
        """Wait until all data passed on is on the disk; a thread other than the writing one may wait."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


class PoseLogs:
    """Writes the live poses of one take, with a file for each performer; one thread writes.

    Args:
        folder: of the take.
        ticks: as for `PoseLog`.

    Raises:
        OSError: the disk refuses; from any method.
    """

    def __init__(self, folder: Path, *, ticks: int | None = None) -> None:
        self._folder = folder
        self._logs = {1: PoseLog(folder / POSE_LOG, ticks=ticks)}
        if ticks is not None:
            for number, path in pose_files(folder).items():
                if number != 1:
                    self._logs[number] = PoseLog(path, ticks=ticks)

    def add(self, tick: int, result: StepResult) -> None:
        """Write the poses of tick number `tick`."""
        for one in result.each():
            if one.performer not in self._logs:
                self._logs[one.performer] = PoseLog(pose_file(self._folder, one.performer))
            self._logs[one.performer].add(tick, one)

    def write_out(self) -> None:
        """See `PoseLog`."""
        for log in self._logs.values():
            log.write_out()

    def sync(self) -> None:
        """See `PoseLog`."""
        for log in list(self._logs.values()):
            log.sync()

    def close(self) -> None:
        for log in self._logs.values():
            log.close()

    def bytes_written(self) -> int:
        """Size of all files."""
        return sum(log.path.stat().st_size for log in list(self._logs.values()) if log.path.exists())


def pose_file(folder: Path, performer: int) -> Path:
    """Return the pose log of a performer, by number, of the take in a folder."""
    return folder / (POSE_LOG if performer == 1 else f"live.performer_{performer}.poses")


def pose_files(folder: Path) -> dict[int, Path]:
    """Return the pose logs of the take in a folder, by the performer's number."""
    found = {1: folder / POSE_LOG} if (folder / POSE_LOG).is_file() else {}
    for path in folder.glob("live.performer_*.poses"):
        number = path.name.removeprefix("live.performer_").removesuffix(".poses")
        if number.isascii() and number.isdigit():
            found[int(number)] = path
    return dict(sorted(found.items()))


def read_records(path: Path) -> NDArray[np.void]:
    """Return the whole records of a pose log, read from the disk on demand."""
    count = path.stat().st_size // RECORD.itemsize
    if count == 0:
        return np.empty(0, dtype=RECORD)
    return np.memmap(path, dtype=RECORD, mode="r", shape=(count,))


@dataclass(frozen=True)
class LoggedPoses:
    """The poses of one performer in their log, and the times at which they were not told apart from another [s]."""

    poses: Poses
    undecided_s: list[float]


def read_poses(path: Path) -> LoggedPoses | None:
    """Return the content of a pose log; None if it has no pose.

    Raises:
        TakeError: it cannot be read.
    """
    try:
        records = read_records(path)
    except OSError as error:
        raise TakeError(unreadable(path, error)) from error
    if len(records) == 0:
        return None
    doubted = records["stage_time_ns"][records["tick"] >= UNDECIDED] * 1e-9
    poses = Poses(
        time_s=records["stage_time_ns"] * 1e-9,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS.copy(),
        positions_m=records["positions_m"],
        rotations_wxyz=records["rotations_wxyz"],
        confidence=records["confidence"],
        uncertainty_mm=records["uncertainty_mm"],
    )
    return LoggedPoses(poses, doubted.tolist())
