"""The rigid bodies of a take on disk.

`rigid_bodies.npz` has their motion on the stage clock, in the frame of their own system. It is made from the events
`rigid_bodies` of the live log when it is first requested, and again if it is missing. `rigid_bodies.json` describes
them. `seen_props.npz` has the motion of props that depth cameras saw, in the stage frame. `markers.npz` has markers
as `rigid_bodies.npz` has bodies, made from the events `markers`.
"""

import json
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.file_sentences import damaged
from studio.engine.base.files import write_atomically, write_json
from studio.engine.base.versions import BODY_TRACKS, MARKER_TRACKS, TAKE_BODIES
from studio.engine.model.frames import ClockModel
from studio.engine.rigid_bodies.known import TakeBodies, check_bodies
from studio.engine.rigid_bodies.markers import MarkerGatherer, MarkerTracks
from studio.engine.rigid_bodies.tracks import BodyTrack, BodyTracks, tracks_of
from studio.take.folder.take import Take
from studio.take.raw.live_log import BodiesEvent, LiveEvent, MarkersEvent, StageClockEvent
from studio.take.raw.reader import RawReader
from studio.take.raw.records import RawEvent

TRACKS_FILE, KNOWN_FILE, SEEN_FILE = "rigid_bodies.npz", "rigid_bodies.json", "seen_props.npz"
MARKERS_FILE = "markers.npz"
_KEYS = ("names", "body", "time_s", "positions_m", "rotations_wxyz")
_MARKER_KEYS = ("names", "time_s", "positions_m", "loose_counts", "loose_m")
_DAMAGED = (ValueError, KeyError, IndexError, OSError, EOFError, zipfile.BadZipFile, zlib.error)


def stage_tracks(events: Iterable[tuple[int, LiveEvent]], server_to_stage: ClockModel | None) -> BodyTracks:
    """Return the motion of events at times of the server's clock [ns], on the stage clock; none without a clock."""
    if server_to_stage is None:
        return BodyTracks()
    return tracks_of(
        (server_to_stage.stage_ns(time_ns) * 1e-9, event.axes, one)
        for time_ns, event in events
        if isinstance(event, BodiesEvent)
        for one in event.bodies
    )


def save_tracks(take: Take, tracks: BodyTracks) -> None:
    """Write the motion of received rigid bodies into the take.

    Raises:
        StudioError: the disk refuses.
    """
    _save(take.path / TRACKS_FILE, tracks)


def save_seen(take: Take, name: str, track: BodyTrack | None) -> None:
    """Write the motion of a prop that cameras saw, in the stage frame; None removes it.

    Raises:
        FormatError: the file of those seen before is damaged. StudioError: the disk refuses.
    """
    path = take.path / SEEN_FILE
    seen = dict(_load(path).tracks) if path.is_file() else {}
    seen.pop(name, None)
    if track is not None:
        seen[name] = track
    _save(path, BodyTracks(seen))


def _save(path: Path, tracks: BodyTracks) -> None:
    mine = list(tracks.tracks.values())
    arrays: Mapping[str, ArrayLike] = {
        "names": np.array(list(tracks.tracks)),
        "body": np.repeat(np.arange(len(mine)), [len(one.time_s) for one in mine]),
        "time_s": np.concatenate([np.empty(0), *(one.time_s for one in mine)]),
        "positions_m": np.concatenate([np.empty((0, 3)), *(one.positions_m for one in mine)]),
        "rotations_wxyz": np.concatenate([np.empty((0, 4)), *(one.rotations_wxyz for one in mine)]),
    }
    with write_atomically(path) as file:
        save_arrays(file, arrays, BODY_TRACKS)


def take_tracks(take: Take) -> BodyTracks:
    """Return the motion of a take's rigid bodies: received ones in their own system's frame, props seen by cameras in
    the stage frame.

    Raises:
        FormatError: a file is damaged.
        StudioError: the disk refuses.
    """
    seen = take.path / SEEN_FILE
    told = _told_tracks(take)
    if not seen.is_file():
        return told
    mine = _load(seen).tracks
    return BodyTracks({**told.tracks, **mine}, frozenset(mine))


def _told_tracks(take: Take) -> BodyTracks:
    path = take.path / TRACKS_FILE
    if path.is_file():
        return _load(path)
    return _gathered(take)[0]


def take_markers(take: Take) -> MarkerTracks:
    """Return the markers that were received during a take, in their own system's frame.

    Raises:
        FormatError: a file is damaged.
        StudioError: the disk refuses.
    """
    path = take.path / MARKERS_FILE
    if not path.is_file():
        return _gathered(take)[1]
    try:
        values = read_arrays(path, _MARKER_KEYS, MARKER_TRACKS)
        names, time_s, positions, counts, loose = (values[key] for key in _MARKER_KEYS)
        shapes = (positions.shape, counts.shape, loose.shape)
        if shapes != ((len(time_s), len(names), 3), time_s.shape, (int(counts.sum()), 3)):
            raise ValueError("its times and places do not fit")
        return MarkerTracks(tuple(names.tolist()), time_s.astype(np.float64), positions, counts, loose)
    except _DAMAGED as error:
        raise FormatError(damaged(path, error)) from error


def _gathered(take: Take) -> tuple[BodyTracks, MarkerTracks]:
    """Make both files from the recording; none if nothing was received."""
    if not (take.path / KNOWN_FILE).is_file() or not take.raw_path.is_file():
        return BodyTracks(), MarkerTracks()
    told: list[tuple[int, LiveEvent]] = []
    gatherer, clock = MarkerGatherer(), None
    for one in RawReader(take.raw_path):
        if not isinstance(one, RawEvent):
            continue
        match one.event:
            case BodiesEvent() as event:
                told.append((one.time_ns, event))
            case MarkersEvent(axes=axes, markers=reading):
                gatherer.add(one.time_ns, axes, reading)
            case StageClockEvent() as event:
                clock = event.model
    tracks, markers = stage_tracks(told, clock), gatherer.tracks(clock)
    save_tracks(take, tracks)
    arrays: Mapping[str, ArrayLike] = {
        "names": np.array(list(markers.names), str),
        **{key: getattr(markers, key) for key in _MARKER_KEYS[1:]},
    }
    with write_atomically(take.path / MARKERS_FILE) as file:
        save_arrays(file, arrays, MARKER_TRACKS)
    return tracks, markers


def _load(path: Path) -> BodyTracks:
    try:
        values = read_arrays(path, _KEYS, BODY_TRACKS)
        count = len(values["time_s"])
        if (values["positions_m"].shape, values["rotations_wxyz"].shape) != ((count, 3), (count, 4)):
            raise ValueError("its times and places do not fit")
        tracks = {}
        for number, name in enumerate(values["names"].tolist()):
            mine = values["body"] == number
            tracks[str(name)] = BodyTrack(*(values[key][mine].astype(np.float64) for key in _KEYS[2:]))
    except _DAMAGED as error:
        raise FormatError(damaged(path, error)) from error
    return BodyTracks(tracks)


def save_take_bodies(take: Take, bodies: TakeBodies) -> None:
    """Write the descriptions of a take's rigid bodies.

    Raises:
        SettingsError: a value that is not allowed. StudioError: the disk refuses.
    """
    check_bodies(bodies.bodies, bodies.place)
    write_json(take.path / KNOWN_FILE, TAKE_BODIES.stamped(msgspec.to_builtins(bodies)))


def take_bodies(take: Take) -> TakeBodies:
    """Return the descriptions of a take's rigid bodies.

    Raises:
        FormatError: the file is damaged.
    """
    path = take.path / KNOWN_FILE
    if not path.is_file():
        return TakeBodies()
    try:
        value = TAKE_BODIES.current(json.loads(path.read_text(encoding="utf-8")), path.name)
        bodies = msgspec.convert(value, TakeBodies)
        check_bodies(bodies.bodies, bodies.place)
    except FormatError:
        raise
    except (OSError, ValueError, TypeError, AttributeError, RecursionError, StudioError) as error:
        raise FormatError(damaged(path, error)) from error
    return bodies
