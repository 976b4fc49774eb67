"""Sessions and takes as the folders show them: `sessions/<session>/<take>/`."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.summary import Summary

from studio.engine.errors import TakeError
from studio.take.names import check_name, inside, is_safe_name
from studio.take.raw_records import LIVE_TOPIC, depth_topic
from studio.take.take import Take


@dataclass(frozen=True)
class TakeInfo:
    """One line of the list of takes.

    Attributes:
        path: the take's folder; `session` and `name` are the names of the folders.
        created: ISO 8601, UTC; empty where `problem` is set.
        length_s: first to last frame [s]; None where raw.mcap is missing or unfinished.
        cameras, solves: names; `depth`: names of the cameras whose depth images were recorded too.
        calibrated: a calibration is in use.
        state: recording state of `take.json`, or `damaged`.
        source, performer, notes, rating, starred: of `take.json`.
        problem: why `take.json` cannot be read, else None.
    """

    path: Path
    session: str
    name: str
    created: str = ""
    length_s: float | None = None
    cameras: tuple[str, ...] = ()
    solves: tuple[str, ...] = ()
    depth: tuple[str, ...] = ()
    calibrated: bool = False
    state: str = "damaged"
    source: str = ""
    performer: str = ""
    notes: str = ""
    rating: int | None = None
    starred: bool = False
    problem: str | None = None


def list_takes(sessions_dir: str | Path) -> list[TakeInfo]:
    """Return every take in the folder by session and name; an empty list where there is none. Reads only."""
    found = sorted(Path(sessions_dir).glob("*/*/take.json"))
    return [
        take_info(file.parent)
        for file in found
        if is_safe_name(file.parent.name) and is_safe_name(file.parent.parent.name)
    ]


def find_take(sessions_dir: str | Path, take_id: str) -> Path | None:
    """Return the folder of the take that was given this id when it was recorded, None where there is none."""
    for file in sorted(Path(sessions_dir).glob("*/*/take.json"), reverse=True):
        try:
            if Take.open(file.parent).meta.get("take_id") == take_id:
                return file.parent
        except TakeError:
            continue
    return None


def take_info(path: Path) -> TakeInfo:
    """Return a take's line in the list; a take that cannot be read has a `problem`.

    What was read is kept, and read again where a file is another than before: a list of thousands costs a look
    at each folder.
    """
    info = _read_info(path, tuple(file_stamp(path / name) for name in ("take.json", "raw.mcap")))
    return info if info.problem is not None else replace(info, solves=tuple(Take(path, {}).solve_names()))


Stamp = tuple[int, int, int] | None
MOST_KEPT = 1 << 17
"""Files and folders whose content is kept by their stamp."""


def file_stamp(path: Path) -> Stamp:
    """Return what tells that a file or folder is another than before; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


@lru_cache(maxsize=MOST_KEPT)
def _read_info(path: Path, _: tuple[Stamp, ...]) -> TakeInfo:
    session, name = path.parent.name, path.name
    try:
        take = Take.open(path)
    except TakeError as error:
        return TakeInfo(path, session, name, problem=str(error))
    length_s, topics = _read_index(take.raw_path)
    return TakeInfo(
        path=path,
        session=session,
        name=name,
        created=take.meta["created"],
        length_s=length_s,
        cameras=take.camera_names,
        depth=tuple(camera for camera in take.camera_names if depth_topic(camera) in topics),
        calibrated=take.meta["calibration"] is not None,
        state=take.meta["recording"],
        source=take.meta["source"],
        performer=take.meta.get("performer", ""),
        notes=take.meta.get("notes", ""),
        rating=take.meta.get("rating"),
        starred=take.meta.get("starred", False),
    )


def _read_index(raw_path: Path) -> tuple[float | None, set[str]]:
    """Return the time from the first to the last frame [s] and the topics that have messages, by the file's index.

    None and nothing where the file is missing, unfinished or damaged, or has no frame.
    """
    try:
        with open(raw_path, "rb") as file:
            reader = make_reader(file)
            summary = reader.get_summary()
            topics = set() if summary is None else _topics(summary)
            ends = _ends(reader, topics - {LIVE_TOPIC})
    except (OSError, McapError, ValueError):
        return None, set()
    return (None, set()) if ends is None else ((ends[1] - ends[0]) * 1e-9, topics)


def _topics(summary: Summary) -> set[str]:
    """Return the topics of a file that have messages."""
    found = summary.statistics
    return {
        channel.topic
        for channel in summary.channels.values()
        if found is None or found.channel_message_counts.get(channel.id)
    }


def _ends(reader: McapReader, topics: set[str]) -> tuple[int, int] | None:
    """Return when the first and the last message of some topics came [ns], None where there is none."""
    if not topics:
        return None
    first = next(iter(reader.iter_messages(topics=topics)), None)
    last = next(iter(reader.iter_messages(topics=topics, reverse=True)), None)
    return None if first is None or last is None else (first[2].log_time, last[2].log_time)


def take_path(sessions_dir: str | Path, session: str, name: str) -> Path:
    """Return a take's folder, which need not exist and lies inside `sessions_dir`.

    Raises:
        TakeError: a name that is not allowed.
    """
    return inside(Path(sessions_dir), check_name("session", session), check_name("take", name))


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
