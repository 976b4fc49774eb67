"""Continuation of a take after a crash of the server: the mark names the take, its raw file the position."""

import logging
from collections.abc import Callable
from pathlib import Path
from time import time_ns

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import say
from studio.engine.model.settings.settings import SolveSettings
from studio.live import warmup
from studio.live.engine import Engine
from studio.live.recording.recorder import Recorder
from studio.live.recording.recording import LiveRecording
from studio.take.folder.marker import (
    RECORDING,
    STOPPING,
    RecordingMarker,
    Restart,
    machine,
    remove_marker,
    write_marker,
)
from studio.take.folder.take import Take, TakeVersionError, utc_now
from studio.take.library.live_solve import save_live_solve
from studio.take.raw.append import RawState, scan_raw
from studio.take.raw.live_log import StoppedEvent
from studio.take.raw.membership import Key, stage_ns
from studio.take.upkeep.recovery import rebuild_meta

_log = logging.getLogger(__name__)


def marker_of(recording: LiveRecording, now_ns: int, *, state: str = RECORDING) -> RecordingMarker:
    """Return the mark of a recording; `now_ns` is the present on the server's clock."""
    meta = recording.recorder.take.meta
    return RecordingMarker(
        session=str(meta["session"]),
        take=str(meta["name"]),
        take_id=recording.recorder.take_id,
        state=state,
        began_ns=recording.began_ns,
        server_ns=now_ns,
        wall_ns=time_ns(),
        machine=machine(),
        restarts=recording.restarts,
    )


def take_up(
    engine: Engine,
    sessions: Path,
    marker: RecordingMarker,
    now_ns: int,
    synced: Callable[[Recorder, set[Key]], None],
) -> None:
    """Make the engine continue the marked take before its thread runs; or end the take, if that was requested.

    A take that cannot be continued is reported in the log and left to `studio doctor`; the mark is removed.
    This process is prepared for a pipeline first, so that nothing delays frames here; clients keep theirs until then.
    """
    warmup.warm_up()
    try:
        take = _open(sessions, marker)
        state = scan_raw(take.raw_path)
        if marker.state == STOPPING or _was_stopped(state):
            _finish(take, state, marker)
            remove_marker(sessions)
            return
        recorder = Recorder(take, state=state)
    except StudioError as error:
        _log.error("take %s/%s cannot be continued: %s", marker.session, marker.take, error)
        engine.ended_problem = say(
            "recording.not_resumed",
            "the server was started again within take {take}, which cannot be continued: {error}",
            take=f"{marker.session}/{marker.take}",
            error=error,
        )
        remove_marker(sessions)
        return
    recorder.on_synced = lambda keys: synced(recorder, keys)
    last_ns = state.newest_ns or marker.began_ns
    restart = Restart(utc_now(), max(0, round((now_ns - last_ns) * 1e-6)))
    recording = LiveRecording(recorder, marker.began_ns, (*marker.restarts, restart))
    engine.resume(recording, state)
    write_marker(sessions, marker_of(recording, now_ns))
    _log.warning("continuing take %s; %d ms were not recorded", recording.name, restart.gap_ms)


def _open(sessions: Path, marker: RecordingMarker) -> Take:
    """Return the marked take, with a rebuilt `take.json` where that is damaged.

    Raises:
        StudioError: it cannot be read, or another take is in its place.
    """
    path = marker.path(sessions)
    try:
        take = Take.open(path)
    except TakeVersionError:
        raise
    except TakeError:
        take = rebuild_meta(path)
    if not take.raw_path.is_file():
        raise TakeError("take.nothing_recorded", "{path} has no raw recording", path=path)
    if take.meta.setdefault("take_id", marker.take_id) != marker.take_id:
        raise TakeError(
            "take.another", "{path} is another take than the one that was being recorded", path=path
        )
    take.meta["recording"] = "recording"
    take.save_meta()
    return take


def _was_stopped(state: RawState) -> bool:
    """Whether the log has the end of the take, and nothing after it."""
    return bool(state.events) and isinstance(state.events[-1][1], StoppedEvent)


def _finish(take: Take, state: RawState, marker: RecordingMarker) -> None:
    """End a take whose end was requested before the crash, at the time of that request if the log lacks the end."""
    recorder = Recorder(take, state=state)
    if not _was_stopped(state):
        recorder.event(marker.server_ns, StoppedEvent(stage_ns(state, marker.server_ns)))
    recorder.close()
    if state.settings is not None:
        save_live_solve(take, SolveSettings.from_json(state.settings), recorder.frames)
