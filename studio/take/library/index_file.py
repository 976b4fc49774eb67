"""The file of the index of takes, `.index.sqlite`: its layout, its stale entries, the reading of takes into it."""

import json
import os
import sqlite3
import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple

from studio.engine.base.sentences import codes_of
from studio.take.folder.measured import measured_figures
from studio.take.library.search import COLUMNS, row_of
from studio.take.library.sessions import TakeInfo, take_ids, take_info

VERSION = 2
"""Version of the layout; increase it when other data of a take is read."""

SETTLED_NS = 2_000_000_000
"""Minimum time between a change and its reading [ns]. File systems have coarse clocks: a take read sooner may change
again without another stamp, so it is read again the next time."""

_BATCH = 50
_WAIT_S = 60.0
FIELDS = [field.name for field in fields(TakeInfo) if field.name != "path"]
SAID = "said"
"""Key of the codes that belong to a take's problem."""
_FIGURES = "of each performer"
_LAYOUT = f"{VERSION}: {_FIGURES}: {' '.join(FIELDS)}: {' '.join(COLUMNS)}"
_SCHEMA = f"""
CREATE TABLE takes (id TEXT PRIMARY KEY, names TEXT, stamp TEXT, settled INTEGER, info TEXT, {", ".join(COLUMNS)});
CREATE INDEX newest ON takes (created DESC, id DESC);
CREATE TABLE figures (id TEXT, figure TEXT, value REAL);
CREATE INDEX figures_of ON figures (id);
CREATE TABLE about (layout TEXT);
"""
_KEEP = f"INSERT OR REPLACE INTO takes VALUES ({', '.join('?' * (5 + len(COLUMNS)))})"


class Stale(NamedTuple):
    """What an index lacks, ids as `session/name`.

    Attributes:
        unread: takes that are not in it, or have changed, the newest first by their files.
        unsettled: takes read so soon after a change that another one may not show.
        gone: takes that are no longer there.
        count: how many takes there are.
    """

    unread: list[str]
    unsettled: list[str]
    gone: list[str]
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]  # hides tuple.count


def find_stale(db: sqlite3.Connection, sessions: Path) -> Stale:
    """Return the differences between an index and the folders."""
    known: dict[str, tuple[str, str, int]] = {
        id_: (names, stamp, settled)
        for id_, names, stamp, settled in db.execute("SELECT id, names, stamp, settled FROM takes")
    }
    gone, count = set(known), 0
    unread: list[tuple[int, str]] = []
    unsettled: list[str] = []
    for id_ in take_ids(sessions):
        folder = f"{sessions}/{id_}"
        names, stamp, settled = known.get(id_, ("", "", 0))
        if stamp and _stamp(folder, names)[0] == stamp:
            if not settled:
                unsettled.append(id_)
        else:
            made_ns = _made_ns(folder)
            if made_ns is None:
                continue
            unread.append((made_ns, id_))
        gone.discard(id_)
        count += 1
    return Stale([id_ for _, id_ in sorted(unread, reverse=True)], unsettled, sorted(gone), count)


def read_rest(sessions: Path, file: Path) -> None:
    """Read all takes that an index lacks into it, the newest first; each batch is available at once.

    Raises:
        sqlite3.DatabaseError: the index is damaged, or was removed meanwhile.
    """
    with closing(open_index(file)) as db:
        stale = find_stale(db, sessions)
        ids = [*stale.unread, *stale.unsettled]
        for begin in range(0, len(ids), _BATCH):
            read_takes(db, sessions, ids[begin : begin + _BATCH])


def read_takes(
    db: sqlite3.Connection,
    sessions: Path,
    ids: Iterable[str],
    clock_ns: Callable[[], int] = time.time_ns,
) -> None:
    """Read takes into an index; `clock_ns` returns the time of day."""
    waiting = []
    for id_ in ids:
        folder = f"{sessions}/{id_}"
        begun_ns = clock_ns()
        names = _solve_folders(folder)
        stamp, latest_ns = _stamp(folder, names)
        if stamp:
            waiting.append((id_, names, stamp, int(latest_ns < begun_ns - SETTLED_NS), Path(folder)))
    _keep(db, waiting)


def forget_takes(db: sqlite3.Connection, ids: Iterable[str]) -> None:
    """Remove takes from an index."""
    gone = [(id_,) for id_ in ids]
    if gone:
        with db:
            db.executemany("DELETE FROM takes WHERE id = ?", gone)
            db.executemany("DELETE FROM figures WHERE id = ?", gone)


def open_index(file: Path) -> sqlite3.Connection:
    """Return a connection to an index of this layout; another one is emptied first.

    Raises:
        sqlite3.DatabaseError: it is damaged, or cannot be written.
    """
    db = sqlite3.connect(file, timeout=_WAIT_S)
    try:
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("PRAGMA synchronous = NORMAL")
        tables = {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if "about" not in tables or db.execute("SELECT layout FROM about").fetchone() != (_LAYOUT,):
            with db:
                db.execute("BEGIN IMMEDIATE")
                for name in tables:
                    db.execute(f'DROP TABLE "{name}"')
                for statement in filter(str.strip, _SCHEMA.split(";")):
                    db.execute(statement)
                db.execute("INSERT INTO about VALUES (?)", (_LAYOUT,))
    except sqlite3.Error:
        db.close()
        raise
    return db


def remove_index(file: Path) -> None:
    """Delete an index; one that cannot be deleted stays."""
    for ending in ("", "-wal", "-shm", "-journal"):
        try:
            file.with_name(file.name + ending).unlink(missing_ok=True)
        except OSError:
            return


def _keep(db: sqlite3.Connection, takes: Iterable[tuple[str, str, str, int, Path]]) -> None:
    """Read takes and put them into the index, except those that disappear meanwhile.

    Each is its id, folders of solves, stamp, whether that is settled, and folder.
    """
    rows, figures = [], []
    for id_, names, stamp, settled, path in takes:
        try:
            info = take_info(path)
            measured = [found for solve in info.solves for found in measured_figures(path / "solves" / solve)]
        except FileNotFoundError:
            continue  # moved to the trash, or renamed: the next answer finds it
        told = json.dumps(
            {name: getattr(info, name) for name in FIELDS} | {SAID: codes_of([info.problem or ""])}
        )
        rows.append((id_, names, stamp, settled, told, *row_of(info)))
        figures.extend((id_, figure, value) for figure, value in measured)
    if not rows:
        return
    with db:
        db.execute("BEGIN IMMEDIATE")
        db.executemany("DELETE FROM figures WHERE id = ?", [(row[0],) for row in rows])
        db.executemany(_KEEP, rows)
        db.executemany("INSERT INTO figures VALUES (?, ?, ?)", figures)


def _solve_folders(take: str) -> str:
    """Return the names of a take's folders of solves, each followed by a slash."""
    try:
        return "".join(
            f"{name}/" for name in sorted(os.listdir(f"{take}/solves")) if not name.startswith(".")
        )
    except OSError:
        return ""


def _stamp(take: str, names: str) -> tuple[str, int]:
    """Return a text that changes with a take's files, and the time of their last change [ns].

    A solve's files are replaced as a whole, so its folder shows a change; the folder of the videos is touched.
    Returns "" and 0 if the folder has no `take.json`.
    """
    stamps: list[int] = []
    latest_ns = 0
    for file in (
        "take.json",
        "raw.mcap",
        "video",
        "solves",
        *(f"solves/{name}" for name in names.split("/")[:-1]),
    ):
        try:
            found = os.stat(f"{take}/{file}")
        except OSError:
            if file == "take.json":
                return "", 0
            stamps.append(0)
            continue
        latest_ns = max(latest_ns, found.st_mtime_ns, found.st_ctime_ns)
        stamps += (found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)
    return repr(stamps), latest_ns


def _made_ns(take: str) -> int | None:
    """Return about when a take was made, by its files [ns]; None if the folder is no take."""
    try:
        made_ns = os.stat(f"{take}/take.json").st_mtime_ns
    except OSError:
        return None
    try:
        return os.stat(f"{take}/raw.mcap").st_mtime_ns
    except OSError:
        return made_ns
