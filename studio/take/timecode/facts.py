"""What is told of the timecode that came in while a take was recorded."""

import numpy as np
from msgspec import Struct

from studio.engine.base.errors import StudioError
from studio.take.folder.take import Take
from studio.take.timecode.kept import take_course


class TakeTimecode(Struct):
    """The timecode of a take.

    Attributes:
        rate: its name; count: numbers in a second; fps: frames a second; drop: drop-frame.
        source: what told it, such as `ltc`.
        drift_ppm: how much faster than the stage clock it runs; None = too short to tell.
        runs: of each start of timecode the stage time [s] and the frame since midnight, with its share.
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
    """Return the timecode that came in; None where none did, or its file is damaged."""
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
