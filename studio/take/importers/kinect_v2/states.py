"""CSV of one Kinect v2 with tracking states, without a header.

A row is the time in ticks of 100 ns, then x, y, z [m, Kinect axes] and the tracking state of the 25 joints in
the SDK's order; a comma may end it. State 2 (tracked) becomes confidence 1.0, 1 (inferred) 0.4, 0 unseen.
"""

from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers.kinect_v2 import joint_set
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording, put_in_order
from studio.take.importers.table import check_length, csv_rows, first_row, number, whole_number

_NAMES = JOINT_SETS[joint_set.JOINT_SET]
_COUNT = 1 + 4 * len(_NAMES)
CONFIDENCE_OF_STATE: dict[int, float] = {0: 0.0, 1: 0.4, 2: 1.0}
_LATEST_TICKS = 2**62 // joint_set.TICK_NS


def matches(path: Path) -> bool:
    """Whether `path` is a text file whose first row has the right number of values and begins with a time."""
    row = _without_last_comma(first_row(path)) if path.is_file() else []
    return len(row) == _COUNT and row[0].isascii() and row[0].isdigit()


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording, one camera named `camera_0` on the Kinect's own clock.

    Raises:
        FormatError: a broken file; the message names file and line.
    """
    ticks: list[int] = []
    values: list[list[float]] = []
    for line, all_cells in csv_rows(path):
        cells = _without_last_comma(all_cells)
        check_length(path, line, cells, _COUNT)
        ticks.append(_time(path, line, cells[0]))
        values.append(_joints(path, line, cells[1:]))
    progress(1.0)
    notes = ["camera_0: confidence is 1 where tracked, 0.4 where inferred"]
    times_ns = np.array(ticks, dtype=np.int64) * joint_set.TICK_NS
    order = put_in_order("camera_0", times_ns, notes)
    joints = np.array(values).reshape(len(values), len(_NAMES), 4)[order]
    confidence = joints[:, :, 3]
    points = np.where(confidence[:, :, None] > 0, joints[:, :, :3], np.nan)
    camera = ReadCamera(
        name="camera_0",
        device=joint_set.DEVICE,
        joint_set=joint_set.JOINT_SET,
        times_ns=times_ns[order],
        positions=joint_set.to_camera(points),
        confidence=confidence,
    )
    return ReadRecording(cameras=(camera,), notes=notes)


def _without_last_comma(row: list[str]) -> list[str]:
    return row[:-1] if len(row) == _COUNT + 1 and row[-1] == "" else row


def _time(path: Path, line: int, text: str) -> int:
    ticks = whole_number(path, line, "time", text)
    if not 0 <= ticks <= _LATEST_TICKS:
        raise FormatError(
            "import.kinect_time",
            "{path}:{line}: time is {time}; allowed: 0 to {most} ticks of 100 ns",
            path=path,
            line=line,
            time=text,
            most=_LATEST_TICKS,
        )
    return ticks


def _joints(path: Path, line: int, cells: list[str]) -> list[float]:
    """Return x, y, z and confidence of every joint."""
    out: list[float] = []
    for k, name in enumerate(_NAMES):
        out += [number(path, line, f"{name} {axis}", cells[4 * k + i]) for i, axis in enumerate("xyz")]
        state = whole_number(path, line, f"{name} state", cells[4 * k + 3])
        if state not in CONFIDENCE_OF_STATE:
            raise FormatError(
                "import.kinect_state",
                "{path}:{line}: {name} has tracking state {state}; allowed: 0, 1, 2",
                path=path,
                line=line,
                name=name,
                state=state,
            )
        out.append(CONFIDENCE_OF_STATE[state])
    return out
