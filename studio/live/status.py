"""The status of the live stage, for `GET /api/v1/status` and the page."""

import shutil
from datetime import datetime

from studio.engine.base.sentences import about, say
from studio.engine.model.settings.settings import PRESETS
from studio.engine.whole_take.residuals import not_followed_mm
from studio.live import warmup
from studio.live.calibration.calibrator import camera_verdicts
from studio.live.calibration.guards import age_s, calibration_warnings, moved_words, shared_usb
from studio.live.calibration.kept import BORROWED
from studio.live.engine import Engine
from studio.live.performers.status import performers_status
from studio.live.recording.recorder import RESERVE_BYTES
from studio.live.recording.recording import LiveRecording
from studio.live.states import (
    CalibrationStatus,
    RecordingStatus,
    SettingsStatus,
    StageStatus,
)
from studio.take.raw.pose_log import RECORD

RATE_S = 5.0
"""Length of a recording from which its size per second is known."""

FRAME_BYTES = 500
POSE_BYTES = RECORD.itemsize


def stage_status(engine: Engine, now_ns: int) -> StageStatus:
    """Return the status; called on the engine thread, `now_ns` on the server's clock."""
    known = () if engine.stage_calibration is None else tuple(engine.stage_calibration.cameras)
    moved, apart, shifts = engine.watch.moved(), engine.watch.apart(), engine.watch.shifts_m()
    cameras = {
        name: camera.status(now_ns, reference=engine.roster.reference == name, calibrated=name in known)
        for name, camera in engine.roster.cameras.items()
    }
    for name, words in shared_usb(engine.roster.connected(), now_ns).items():
        if cameras[name].state == "live":
            cameras[name].limited_by, cameras[name].reason = "usb", about(cameras[name].reason, words)
    for name, camera in cameras.items():
        camera.previews = engine.previews.count(name)
        camera.shift_mm = round(shifts[name] * 1e3, 1) if name in shifts else None
        camera.apart_mm = round(apart[name] * 1e3, 1) if name in apart else None
        if name in moved and camera.state == "live":
            camera.state, camera.limited_by, camera.reason = "trouble", "moved", moved_words(moved[name])
    stage_ns = engine.roster.clock.server_to_stage_ns(now_ns)
    _, newest = engine.results.get()
    pipeline = engine.figures.status(now_ns)
    pipeline.problem = engine.problem
    pipeline.preparing = engine.preparation.begun and not warmup.is_ready(engine.stage_calibration)
    pipeline.not_followed_mm = {} if newest is None else not_followed_mm(newest)
    pipeline.clock_offset_ns = None if stage_ns is None else now_ns - stage_ns
    performers, warnings = performers_status(engine, now_ns)
    named = next((name for name, value in PRESETS.items() if value == engine.settings), None)
    return StageStatus(
        cameras=cameras,
        pipeline=pipeline,
        recording=_recording(engine, now_ns),
        calibration=_calibration(engine, now_ns),
        settings=SettingsStatus(named, engine.settings.output_hz),
        performers=performers,
        performer_warnings=warnings,
        timecode=engine.timecode.status(),
        bodies=engine.bodies.status(),
    )


def _recording(engine: Engine, now_ns: int) -> RecordingStatus:
    recording = engine.recording
    meta = {} if recording is None else recording.recorder.take.meta
    free = _free_bytes(engine)
    missing = {} if recording is None else recording.recorder.missing()
    seconds = 0.0 if recording is None else (now_ns - recording.began_ns) * 1e-9
    return RecordingStatus(
        active=recording is not None,
        session=meta.get("session"),
        take=meta.get("name"),
        seconds=round(seconds, 1),
        frames=0 if recording is None else recording.recorder.frames,
        late_frames=0 if recording is None else recording.recorder.late,
        missing_frames=missing,
        restarts=() if recording is None else recording.restarts,
        notice="" if recording is None else _notice(recording, missing),
        problem=engine.ended_problem if recording is None else recording.recorder.problem,
        disk_free_gb=round(free * 1e-9, 2),
        minutes_left=_minutes_left(engine, free, seconds),
    )


def _notice(recording: LiveRecording, missing: dict[str, int]) -> str:
    """A message to the operator about a take that continues after a restart of the server."""
    if not recording.restarts:
        return ""
    times = " and ".join(
        datetime.fromisoformat(restart.at).astimezone().strftime("%H:%M:%S") for restart in recording.restarts
    )
    gap_ms = sum(restart.gap_ms for restart in recording.restarts)
    brought, waits = _counts(recording.recorder.owed.brought()), _counts(missing)
    if missing:
        state = say("recording.still_missing", "frames still missing: {waits}", waits=waits)
    else:
        state = (
            say("recording.brought", "filled by the cameras, frames: {brought}", brought=brought)
            if brought
            else say("recording.none_brought", "no camera has brought frames of it")
        )
    return say(
        "recording.restarted",
        "The server was started again within take {take} at {times}; gap {ms} ms, {state}",
        take=recording.name,
        times=times,
        ms=gap_ms,
        state=state,
    )


def _counts(frames: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(frames.items()))


def _free_bytes(engine: Engine) -> int:
    """Free space of the disk; 0 if the disk is gone."""
    try:
        return shutil.disk_usage(engine.folder).free
    except OSError:
        return 0


def _minutes_left(engine: Engine, free_bytes: int, seconds: float) -> float:
    """Minutes until the disk is full, by this recording's size so far, else by the cameras' data rate."""
    rate = 0.0
    if engine.recording is not None and seconds > RATE_S:
        rate = engine.recording.recorder.bytes_written / seconds
    else:
        cameras = [camera for camera in engine.roster.connected() if camera.frames]
        frames = sum(camera.hello.frames_per_second * FRAME_BYTES for camera in cameras)
        rate = frames + engine.settings.output_hz * POSE_BYTES
    return round(max(free_bytes - RESERVE_BYTES, 0) / max(rate, 1.0) / 60.0, 1)


def _calibration(engine: Engine, now_ns: int) -> CalibrationStatus:
    """`state` (good, provisional, none) is of the calibration in use; `attempt` is the last calibration begun."""
    calibration = engine.stage_calibration
    state = "none" if calibration is None else "provisional" if engine.kept is None else "good"
    if not engine.roster.connected():
        message = say("calibration.no_camera", "no camera is connected")
    elif state == "good" and engine.covered():
        missing = [
            c.name for c in engine.roster.connected() if calibration and c.name not in calibration.cameras
        ]
        message = (
            say("calibration.not_calibrated", "not calibrated: {names}; calibrate the stage", names=missing)
            if missing
            else say("calibration.calibrated", "calibrated")
        )
    elif state == "provisional" and calibration is not None:
        message = say(
            "calibration.provisional",
            "not calibrated: only {name} is shown, for now; calibrate the stage",
            name=calibration.reference,
        )
    else:
        message = say("calibration.waiting", "not calibrated: waiting for a performer in view")
    return CalibrationStatus(
        state=state,
        message=message,
        number=None if engine.kept is None else engine.kept.number,
        borrowed=engine.kept is not None and engine.kept.number == BORROWED,
        age_s=age_s(engine.kept),
        warnings=calibration_warnings(engine.kept, engine.roster.cameras.values(), engine.watch.moved()),
        reference=None if calibration is None else calibration.reference,
        height_m=None
        if calibration is None or calibration.performer is None
        else round(calibration.performer.height_m, 4),
        cameras={} if calibration is None else camera_verdicts(calibration),
        attempt=engine.calibrator.status(now_ns),
        tpose=engine.tpose.status(),
    )
