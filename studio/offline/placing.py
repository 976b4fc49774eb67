"""Refinement of a take's cameras before its depth is tracked, and its entries in the figures of a solve."""

import logging
from collections.abc import Callable

import numpy as np

from studio.engine.model.calibration import Calibration
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import CameraMoveJson, SolveMetrics
from studio.engine.seeing.cameras.refine import Tracked, refine_cameras, with_places
from studio.take.raw.depth import DepthRecording

Progress = Callable[[float], None]
_WINDOWS, _WINDOW_S = 4, 4.0
"""Number and length [s] of the parts that are used, spread over the take; a shorter take is used whole."""
_log = logging.getLogger(__name__)


def refines(settings: SolveSettings, calibration: Calibration, names: tuple[str, ...]) -> bool:
    """Whether solves with these settings refine the cameras that they track with."""
    wanted = settings.refine_cameras == "all" or (settings.refine_cameras == "given" and calibration.given)
    return wanted and settings.tracker == "points" and len(names) > 1


def refined(
    recording: DepthRecording,
    calibration: Calibration,
    names: tuple[str, ...],
    progress: Progress | None = None,
    tracked: Tracked | None = None,
) -> tuple[Calibration, SolveMetrics]:
    """Return the calibration with refined cameras, and what was done to them as JSON (`with_refined`).

    Args:
        progress: receives the share done.
        tracked: see `refine_cameras`.
    """
    clocks = {name: calibration.cameras[name].clock for name in names}
    every = np.array([clocks[name].stage_ns(int(t)) for name in names for t in recording.times_ns(name)])
    spans = windows(int(every.min()), int(every.max()))
    total = sum(int(((every >= begin) & (every <= end)).sum()) for begin, end in spans)
    images = recording.frames(names, clocks=clocks, spans_ns=spans)

    def told():
        for done, image in enumerate(images):
            if progress is not None and done % 16 == 0:
                progress(done / max(total, 1))
            yield image

    found = refine_cameras(told(), {name: recording.cameras[name] for name in names}, calibration, tracked)
    _log.info("%s: cameras refined: %s", recording.path, found.line())
    cameras: dict[str, CameraMoveJson] = {
        name: {
            "T_stage_camera": found.calibration.cameras[name].T_stage_camera.tolist(),
            "moved_mm": move.metres * 1e3,
            "turned_deg": move.degrees,
        }
        for name, move in found.moves.items()
    }
    return found.calibration, {"refined_cameras": found.line(), "cameras_moved": cameras}


def with_refined(calibration: Calibration, done: SolveMetrics) -> Calibration:
    """Return the calibration with the cameras that `refined` reported."""
    moved = done.get("cameras_moved", {})
    return with_places(calibration, {name: np.array(one["T_stage_camera"]) for name, one in moved.items()})


def windows(first_ns: int, last_ns: int) -> list[tuple[int, int]]:
    """Return the spans of time whose images are used [ns]."""
    window_ns = round(_WINDOW_S * 1e9)
    if last_ns - first_ns <= _WINDOWS * window_ns:
        return [(first_ns, last_ns)]
    begins = np.linspace(first_ns, last_ns - window_ns, _WINDOWS).astype(np.int64)
    return [(int(begin), int(begin) + window_ns) for begin in begins]
