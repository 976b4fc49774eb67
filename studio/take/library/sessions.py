"""Sessions and takes on disk: `sessions/<session>/<take>/`."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from functools import lru_cache
from pathlib import Path

from mcap.reader import McapReader, make_reader

from studio.engine.base.errors import TakeError
from studio.take.folder.meta import TakeMeta
from studio.take.folder.names import check_name, inside, is_safe_name
from studio.take.folder.take import Take
from studio.take.raw.append import hello_of
from studio.take.raw.index import topics_of
from studio.take.raw.reader import DAMAGE
from studio.take.raw.records import LATE_KEY, LIVE_TOPIC, depth_topic
from studio.take.raw.span import RawSpan
from studio.take.video.kept import video_bytes


@dataclass(frozen=True)
class TakeInfo:
    """One line of the list of takes.

    Attributes:
        path: the take's folder; `session` and `name` are the names of the folders.
        created: ISO 8601, UTC; empty if `problem` is set.
        length_s: first to last frame [s]; None if raw.mcap is missing or unfinished.
        calibration_s: length of the calibration part before the performance [s]; None = no such part.
        cameras, solves: names; `depth`: names of the cameras with recorded depth images.
        video_bytes: size of its videos [bytes]; 0 = it has none.
        calibrated: a calibration is in use.
        state: recording state of `take.json`, or `damaged`.
        source, performer, notes, tags, rating, starred: of `take.json`.
        performers: of its solves of several; empty for one.
        performer_names: the operator's names, by performer.
        problem: why `take.json` cannot be read, else None.
    """

    path: Path
    session: str
    name: str
    created: str = ""
    length_s: float | None = None
    calibration_s: float | None = None
    cameras: tuple[str, ...] = ()
    solves: tuple[str, ...] = ()
    depth: tuple[str, ...] = ()
    calibrated: bool = False
    state: str = "damaged"
    source: str = ""
    performer: str = ""
    notes: str = ""
    tags: tuple[str, ...] = ()
    rating: int | None = None
    starred: bool = False
    problem: str | None = None
    video_bytes: int = 0
    performers: tuple[str, ...] = ()
    performer_names: dict[str, str] = field(default_factory=dict)


def take_ids(sessions_dir: str | Path) -> Iterator[str]:
    """Yield `session/name` of the folders in which takes may lie, in order; `take.json` is not checked.

    Yields nothing if there is no such folder. Links to folders count.
    """
    for session in _folders(str(sessions_dir)):
        for name in _folders(f"{sessions_dir}/{session}"):
            yield f"{session}/{name}"


def _folders(folder: str) -> list[str]:
    """Return the names of the folders in a folder that may name a session or a take, in order."""
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.name for entry in entries if _is_safe(entry.name) and entry.is_dir())
    except OSError:  # a link to nothing, or a folder that was removed meanwhile
        return []


_is_safe = lru_cache(maxsize=1 << 17)(is_safe_name)


def find_take(sessions_dir: str | Path, take_id: str) -> Path | None:
    """Return the folder of the take with this id, None if there is none.

    Of several copies, it is the one at the place named in its `take.json`; None if that is not unique.
    """
    found: list[tuple[Path, bool]] = []
    for file in sorted(Path(sessions_dir).glob("*/*/take.json")):
        try:
            meta = Take.open(file.parent).meta
        except TakeError:
            continue
        if meta.get("take_id") == take_id:
            place = (file.parent.parent.name, file.parent.name)
            found.append((file.parent, place == (meta["session"], meta["name"])))
    if len(found) > 1:
        found = [one for one in found if one[1]]
    return found[0][0] if len(found) == 1 else None


def take_info(path: Path) -> TakeInfo:
    """Return a take's line in the list, from its files; a take that cannot be read has a `problem`."""
    session, name = path.parent.name, path.name
    try:
        take = Take.open(path)
    except TakeError as error:
        return TakeInfo(path, session, name, problem=error.sentence)
    length_s, topics = _read_index(take.raw_path)
    return TakeInfo(
        path=path,
        session=session,
        name=name,
        created=take.meta["created"],
        length_s=length_s,
        calibration_s=take.meta["calibration_s"],
        cameras=take.camera_names,
        solves=tuple(take.solve_names()),
        depth=tuple(camera for camera in take.camera_names if depth_topic(camera) in topics),
        calibrated=take.meta["calibration"] is not None,
        state=take.meta["recording"],
        source=take.meta["source"],
        performer=take.meta.get("performer", ""),
        notes=take.meta.get("notes", ""),
        tags=take_tags(take.meta),
        rating=take.meta.get("rating"),
        starred=take.meta.get("starred", False),
        video_bytes=video_bytes(path),
        performers=tuple(take.all_performers()),
        performer_names=take.meta.get("performer_names", {}),
    )


def take_tags(meta: TakeMeta) -> tuple[str, ...]:
    """Return the tags in a `take.json`; none if it has none, or something else in their place."""
    tags = meta.get("tags")
    return tuple(tag for tag in tags if isinstance(tag, str)) if isinstance(tags, list) else ()


def _read_index(raw_path: Path) -> tuple[float | None, set[str]]:
    """Return the time from the first to the last frame [s] and the topics with messages, from the file's index.

    None and nothing if the file is missing, unfinished or damaged, or has no frame.
    """
    try:
        with open(raw_path, "rb") as file:
            reader = make_reader(file)
            summary = reader.get_summary()
            topics = set() if summary is None else topics_of(summary)
            late = summary is not None and any(LATE_KEY in c.metadata for c in summary.channels.values())
            ends = _span(reader) if late else _ends(reader, topics - {LIVE_TOPIC})
    except DAMAGE:
        return None, set()
    return (None, set()) if ends is None else ((ends[1] - ends[0]) * 1e-9, topics)


def _span(reader: McapReader) -> tuple[int, int] | None:
    """Return the first and the last time of a file with late frames, which may arrive long after its end [ns]."""
    span = RawSpan()
    keys: dict[int, tuple[str, str]] = {}
    for _, channel, message in reader.iter_messages(log_time_order=False):
        if channel.topic == LIVE_TOPIC:
            span.event(message.log_time)
            continue
        if channel.id not in keys:
            hello = hello_of(channel)
            keys[channel.id] = (channel.topic, "") if hello is None else (hello.name, hello.boot_id)
        late = LATE_KEY in channel.metadata
        span.frame(keys[channel.id], message.log_time, message.publish_time, late=late)
    return span.ends()


def _ends(reader: McapReader, topics: set[str]) -> tuple[int, int] | None:
    """Return the times of the first and the last message of some topics [ns], None without messages."""
    if not topics:
        return None
    first = next(iter(reader.iter_messages(topics=topics)), None)
    last = next(iter(reader.iter_messages(topics=topics, reverse=True)), None)
    return None if first is None or last is None else (first[2].log_time, last[2].log_time)


def take_path(sessions_dir: str | Path, session: str, name: str) -> Path:
    """Return a take's folder inside `sessions_dir`, which need not exist.

    Raises:
        TakeError: a name that is not allowed.
    """
    return inside(Path(sessions_dir), check_name("session", session), check_name("take", name))


def session_of_today() -> str:
    """Return the default session of a take: the local date, `2026-01-31`."""
    return datetime.now().astimezone().strftime("%Y-%m-%d")


def new_take_path(sessions_dir: str | Path, session: str, prefix: str = "take") -> Path:
    """Return the folder of the next take of a session, `<prefix>_001`, then 002, ...; it does not exist.

    Raises:
        TakeError: a name that is not allowed.
    """
    folder = inside(Path(sessions_dir), check_name("session", session))
    check_name("take", f"{prefix}_001")
    used = [0]
    if folder.is_dir():
        tails = [f.name[len(prefix) + 1 :] for f in folder.iterdir() if f.name.startswith(f"{prefix}_")]
        used += [int(tail) for tail in tails if tail.isascii() and tail.isdigit()]
    return take_path(sessions_dir, session, f"{prefix}_{max(used) + 1:03d}")
