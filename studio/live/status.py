"""The status of the live stage as JSON: what `GET /api/v1/status` returns and the page shows."""

import shutil
from typing import TYPE_CHECKING, Any

from studio.engine.settings import PRESETS
from studio.live.calibrator import camera_verdicts

if TYPE_CHECKING:
    from studio.live.engine import Engine


def stage_status(engine: "Engine", now_ns: int) -> dict[str, Any]:
    """Return the status; called on the engine thread, `now_ns` on the server's clock."""
    known = () if engine.stage_calibration is None else tuple(engine.stage_calibration.cameras)
    cameras = {
        name: camera.status(now_ns, reference=engine.roster.reference == name, calibrated=name in known)
        for name, camera in engine.roster.cameras.items()
    }
    return {
        "cameras": cameras,
        "pipeline": engine.figures.status(now_ns) | {"problem": engine.problem},
        "recording": _recording(engine, now_ns),
        "calibration": _calibration(engine, now_ns),
        "settings": {
            "preset": next((name for name, value in PRESETS.items() if value == engine.settings), None),
            "output_hz": engine.settings.output_hz,
        },
    }


def _recording(engine: "Engine", now_ns: int) -> dict[str, Any]:
    recording = engine.recording
    meta = {} if recording is None else recording.recorder.take.meta
    return {
        "active": recording is not None,
        "session": meta.get("session"),
        "take": meta.get("name"),
        "seconds": 0.0 if recording is None else round((now_ns - recording.began_ns) * 1e-9, 1),
        "frames": 0 if recording is None else recording.recorder.frames,
        "problem": "" if recording is None else recording.recorder.problem,
        "disk_free_gb": round(shutil.disk_usage(engine.folder).free * 1e-9, 2),
    }


def _calibration(engine: "Engine", now_ns: int) -> dict[str, Any]:
    """`state` (good, provisional, none) is of what is in use; `attempt` is the last calibration begun."""
    calibration = engine.stage_calibration
    state = "none" if calibration is None else "provisional" if engine.number is None else "good"
    if not engine.roster.connected():
        message = "no camera is connected"
    elif state == "good" and engine.covered():
        missing = [
            c.name for c in engine.roster.connected() if calibration and c.name not in calibration.cameras
        ]
        message = f"not calibrated: {', '.join(missing)}; calibrate the stage" if missing else "calibrated"
    elif state == "provisional" and calibration is not None:
        message = f"not calibrated: only {calibration.reference} is shown, for now; calibrate the stage"
    else:
        message = "not calibrated: waiting for a performer in view"
    return {
        "state": state,
        "message": message,
        "number": engine.number,
        "reference": None if calibration is None else calibration.reference,
        "height_m": None
        if calibration is None or calibration.performer is None
        else round(calibration.performer.height_m, 3),
        "cameras": {} if calibration is None else camera_verdicts(calibration),
        "attempt": engine.calibrator.status(now_ns),
    }
