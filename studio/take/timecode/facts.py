"""Facts about the timecode that was received during a take."""

import numpy as np
from msgspec import Struct

from studio.engine.base.errors import StudioError
from studio.take.folder.take import Take
from studio.take.timecode.kept import take_course


class TakeTimecode(Struct):
    """The timecode of a take.

    Attributes:
        rate: its name; count: numbers in a second; fps: frames a second; drop: drop-frame.
        source: where it came from, such as `ltc`.
        drift_ppm: its drift, positive if it runs faster than the stage clock; None = too short to measure.
        runs: stage time [s] of each start of timecode, and the frame since midnight, with its share.
        bridged_s: spans without timecode, stage time [s].
    """

    rate: str
    count: int
    fps: float
    drop: bool
    source: str
    drift_ppm: float | None
    runs: list[tuple[float, float]]
    bridged_s: list[tuple[float, float]]


def take_timecode(take: Take) -> TakeTimecode | None:
    """Return the received timecode; None if there is none, or its file is damaged."""
    if "timecode_rate" not in take.meta:
        return None
    try:
        path = take_course(take, 0.0)
    except StudioError:
        return None
    if path is None or not path.source:
        return None
    begins = np.array([run.time_s[0] for run in path.runs])
    return TakeTimecode(
        rate=path.rate.name,
        count=path.rate.count,
        fps=path.rate.fps,
        drop=path.rate.drop,
        source=path.source,
        drift_ppm=None if path.drift_ppm is None else round(path.drift_ppm, 2),
        runs=list(zip(begins.tolist(), path.frames_at(begins).tolist(), strict=True)),
        bridged_s=path.gaps_s(),
    )
