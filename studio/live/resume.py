"""Going on with a take after the server ended without warning: the mark says which, its raw file says from where."""

import logging
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from time import time_ns

from studio.engine.errors import StudioError, TakeError
from studio.engine.settings import SolveSettings
from studio.live import warmup
from studio.live.engine import Engine
from studio.live.recorder import Key, Recorder
from studio.live.recording import Recording, Restart
from studio.take.live_solve import save_live_solve
from studio.take.marker import RECORDING, STOPPING, Marker, machine, remove_marker, write_marker
from studio.take.raw_append import RawState, scan_raw
from studio.take.recovery import rebuild_meta
from studio.take.take import Take, TakeVersionError, utc_now

_log = logging.getLogger(__name__)


def marker_of(recording: Recording, now_ns: int, *, state: str = RECORDING) -> Marker:
    """Return the mark of a recording; `now_ns` is the present on the server's clock."""
    meta = recording.recorder.take.meta
    return Marker(
        session=str(meta["session"]),
        take=str(meta["name"]),
        take_id=recording.recorder.take_id,
        state=state,
        began_ns=recording.began_ns,
        server_ns=now_ns,
        wall_ns=time_ns(),
        machine=machine(),
        restarts=tuple(asdict(restart) for restart in recording.restarts),
    )


def take_up(
    engine: Engine,
    sessions: Path,
    marker: Marker,
    now_ns: int,
    synced: Callable[[Recorder, set[Key]], None],
) -> None:
    """Have the engine, before its thread runs, go on with the marked take; or end it, where that was asked for.

    A take that cannot be gone on with is told by the log and left to `studio doctor`; the mark is removed.
    This process is made ready for a pipeline first: the clients keep their frames until nothing holds them up here.
    """
    warmup.warm_up()
    try:
        take = _open(marker.path(sessions))
        state = scan_raw(take.raw_path)
        if marker.state == STOPPING:
            _finish(take, state)
            remove_marker(sessions)
            return
        recorder = Recorder(take, state=state)
    except StudioError as error:
        _log.error("take %s/%s cannot be gone on with: %s", marker.session, marker.take, error)
        engine.ended_problem = (
            f"the server was started again within take {marker.session}/{marker.take}, which cannot be gone on "
            f"with: {error}"
        )
        remove_marker(sessions)
        return
    recorder.on_synced = lambda keys: synced(recorder, keys)
    last_ns = state.newest_ns or marker.began_ns
    restart = Restart(utc_now(), max(0, round((now_ns - last_ns) * 1e-6)))
    before = tuple(Restart(str(one["at"]), int(one["gap_ms"])) for one in marker.restarts)
    recording = Recording(recorder, marker.began_ns, (*before, restart))
    engine.resume(recording, state)
    write_marker(sessions, marker_of(recording, now_ns))
    _log.warning("going on with take %s; %d ms were not recorded", recording.name, restart.gap_ms)


def _open(path: Path) -> Take:
    """Return the take, with a rebuilt `take.json` where that is broken."""
    try:
        take = Take.open(path)
    except TakeVersionError:
        raise
    except TakeError:
        take = rebuild_meta(path)
    if not take.raw_path.is_file():
        raise TakeError(f"{path} has no raw recording")
    take.meta["recording"] = "recording"
    take.save_meta()
    return take


def _finish(take: Take, state: RawState) -> None:
    """End a take whose end was asked for before the server ended."""
    recorder = Recorder(take, state=state)
    recorder.close()
    if state.settings is not None:
        save_live_solve(take, SolveSettings.from_json(state.settings), recorder.frames)
