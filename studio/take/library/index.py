"""The index of the takes in a folder of sessions: `.index.sqlite`, made of the folders, which are the truth.

Every answer looks at each take's files first, by their stamps, and reads again what is another than before. An index
that is missing, damaged or of another layout is made anew. Where none can be written, it lies in a temporary folder.
"""

import json
import os
import shutil
import sqlite3
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from studio.engine.base.sentences import codes_of, with_codes
from studio.take.folder.measured import measured_figures
from studio.take.library.query import Term
from studio.take.library.search import COLUMNS, row_of, where
from studio.take.library.sessions import TakeInfo, take_ids, take_info

FILE = ".index.sqlite"
VERSION = 2
"""Raised where what is read of a take changes."""

SETTLED_NS = 2_000_000_000
"""What was changed so shortly before it was read may change again without another stamp, as coarse as the clocks of
file systems are: it is read again the next time."""

_BATCH = 500
_WAIT_S = 60.0
_FIELDS = [field.name for field in fields(TakeInfo) if field.name != "path"]
_SAID = "said"
_LAYOUT = f"{VERSION}: {' '.join(_FIELDS)}: {' '.join(COLUMNS)}"
_SCHEMA = f"""
CREATE TABLE takes (id TEXT PRIMARY KEY, names TEXT, stamp TEXT, settled INTEGER, info TEXT, {", ".join(COLUMNS)});
CREATE INDEX newest ON takes (created DESC, id DESC);
CREATE TABLE figures (id TEXT, figure TEXT, value REAL);
CREATE INDEX figures_of ON figures (id);
CREATE TABLE about (layout TEXT);
"""
_KEEP = f"INSERT OR REPLACE INTO takes VALUES ({', '.join('?' * (5 + len(COLUMNS)))})"

T = TypeVar("T")


class TakeIndex:
    """The takes in one folder of sessions, found quickly; safe from any thread and beside other programs.

    `clock_ns` tells the time of day.
    """

    def __init__(self, sessions: Path, *, clock_ns: Callable[[], int] = time.time_ns) -> None:
        self._sessions = sessions
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._elsewhere: Path | None = None

    def search(
        self,
        terms: Sequence[Term] = (),
        *,
        only: Sequence[str] | None = None,
        limit: int | None = None,
        offset: int = 0,
    ) -> tuple[list[TakeInfo], int]:
        """Return the takes that meet all terms, the newest first, and how many there are.

        Args:
            only: ids of takes, `session/name`, to which it is limited.
            limit: so many at most, after the first `offset`; None = all.
        """
        if not self._sessions.is_dir():
            return [], 0
        condition, values = where(terms)
        if only is not None:
            condition += " AND id IN (SELECT value FROM json_each(?))"
            values.append(json.dumps(list(only)))
        page = "ORDER BY created DESC, id DESC LIMIT ? OFFSET ?"

        def ask(db: sqlite3.Connection) -> tuple[list[tuple[str, str]], int]:
            (count,) = db.execute(f"SELECT count(*) FROM takes WHERE {condition}", values).fetchone()
            asked = f"SELECT id, info FROM takes WHERE {condition} {page}"
            return db.execute(asked, [*values, -1 if limit is None else limit, offset]).fetchall(), count

        with self._lock:
            rows, count = self._with_index(ask)
        return [self._info(id_, info) for id_, info in rows], count

    def _info(self, id_: str, info: str) -> TakeInfo:
        values = json.loads(info)
        (values["problem"],) = with_codes([values["problem"]], values.pop(_SAID))
        tuples: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
        }
        return TakeInfo(path=self._sessions / id_, **tuples)

    def _with_index(self, ask: Callable[[sqlite3.Connection], T]) -> T:
        """Return what is asked of the index as the folders are now; it is made anew, or elsewhere, at need."""
        if self._elsewhere is None:
            for _ in range(2):
                try:
                    return self._asked(self._sessions / FILE, ask)
                except sqlite3.DatabaseError:
                    _remove(self._sessions / FILE)
            self._elsewhere = Path(tempfile.mkdtemp(prefix="studio-index-"))
            weakref.finalize(self, shutil.rmtree, self._elsewhere, ignore_errors=True)
        return self._asked(self._elsewhere / FILE, ask)

    def _asked(self, file: Path, ask: Callable[[sqlite3.Connection], T]) -> T:
        with closing(_open(file)) as db:
            self._refresh(db)
            return ask(db)

    def _refresh(self, db: sqlite3.Connection) -> None:
        """Bring the index up to date with the folders."""
        known: dict[str, tuple[str, str, int]] = {
            id_: (names, stamp, settled)
            for id_, names, stamp, settled in db.execute("SELECT id, names, stamp, settled FROM takes")
        }
        gone = set(known)
        waiting: list[tuple[Any, ...]] = []
        for id_ in take_ids(self._sessions):
            folder = f"{self._sessions}/{id_}"
            names, stamp, settled = known.get(id_, ("", "", 0))
            if settled and _stamp(folder, names)[0] == stamp:
                gone.discard(id_)
                continue
            begun_ns = self._clock_ns()
            names = _solve_folders(folder)
            stamp, latest_ns = _stamp(folder, names)
            if not stamp:
                continue
            gone.discard(id_)
            waiting.append((id_, names, stamp, int(latest_ns < begun_ns - SETTLED_NS), Path(folder)))
            if len(waiting) == _BATCH:
                _keep(db, waiting)
                waiting.clear()
        _keep(db, waiting)
        if gone:
            with db:
                db.executemany("DELETE FROM takes WHERE id = ?", [(id_,) for id_ in gone])
                db.executemany("DELETE FROM figures WHERE id = ?", [(id_,) for id_ in gone])


def _open(file: Path) -> sqlite3.Connection:
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


def _remove(file: Path) -> None:
    """Delete an index; one that cannot be deleted stays."""
    for ending in ("", "-wal", "-shm", "-journal"):
        try:
            file.with_name(file.name + ending).unlink(missing_ok=True)
        except OSError:
            return


def _keep(db: sqlite3.Connection, takes: Iterable[tuple[str, str, str, int, Path]]) -> None:
    """Read takes and put them into the index.

    Each is its id, folders of solves, stamp, whether that will do from now on, and folder.
    """
    rows, figures = [], []
    for id_, names, stamp, settled, path in takes:
        info = take_info(path)
        told = json.dumps(
            {name: getattr(info, name) for name in _FIELDS} | {_SAID: codes_of([info.problem or ""])}
        )
        rows.append((id_, names, stamp, settled, told, *row_of(info)))
        for solve in info.solves:
            found = measured_figures(path / "solves" / solve)
            figures.extend((id_, figure, value) for figure, value in found)
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
    """Return what tells that a take's files are others than before, and when the last of them changed [ns].

    A solve's files are written whole and then take their place: its folder tells. Nothing where the folder has no
    `take.json`.
    """
    stamps: list[int] = []
    latest_ns = 0
    for file in ("take.json", "raw.mcap", "solves", *(f"solves/{name}" for name in names.split("/")[:-1])):
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
