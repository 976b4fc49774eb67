"""The index of the takes in a folder of sessions: `.index.sqlite`, derived from the folders, which are authoritative.

Every answer first checks the stamps of each take's files and reads changed takes again. If there are many, the newest
are read at once and the others in a separate process; until then an answer reports how many are read. An index that
is missing, damaged or of another layout is made again. If none can be written, it lies in a temporary folder.
"""

import json
import logging
import shutil
import sqlite3
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import with_codes
from studio.take.library.index_file import (
    SAID,
    find_stale,
    forget_takes,
    open_index,
    read_takes,
    remove_index,
)
from studio.take.library.query import Term
from studio.take.library.search import where
from studio.take.library.sessions import TakeInfo
from studio.worker import run_in_process

FILE = ".index.sqlite"
AT_ONCE = 60
"""Number of takes that are read before an answer: what a page shows of the list."""

_log = logging.getLogger(__name__)

T = TypeVar("T")


class ReadSoFar(NamedTuple):
    """How many takes are in the index, and how many there are."""

    done: int
    of: int


class Found(NamedTuple):
    """Takes that a search found, the newest first, the total that it finds, and the progress of reading.

    `reading` is None once all takes have been read; else takes are missing from the answer.
    """

    takes: list[TakeInfo]
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]  # hides tuple.count
    reading: ReadSoFar | None = None


def _read_in_process(sessions: Path, file: Path) -> None:
    run_in_process("studio.take.library.index_file:read_rest", sessions, file, spare=False)


class TakeIndex:
    """The takes in one folder of sessions, found quickly; safe from any thread and alongside other programs.

    Args:
        sessions: the folder.
        clock_ns: returns the time of day.
        read_rest: reads what an index lacks, as `read_rest` of `index_file`; called in a thread.
    """

    def __init__(
        self,
        sessions: Path,
        *,
        clock_ns: Callable[[], int] = time.time_ns,
        read_rest: Callable[[Path, Path], None] = _read_in_process,
    ) -> None:
        self._sessions = sessions
        self._clock_ns = clock_ns
        self._read_rest = read_rest
        self._lock = threading.Lock()
        self._elsewhere: Path | None = None
        self._reading: threading.Thread | None = None

    def search(
        self,
        terms: Sequence[Term] = (),
        *,
        only: Sequence[str] | None = None,
        limit: int | None = None,
        offset: int = 0,
    ) -> Found:
        """Return the takes that meet all terms.

        Args:
            only: ids of takes, `session/name`, to which it is limited; they are read first.
            limit: maximum number, after the first `offset`; None = all.
        """
        if not self._sessions.is_dir():
            return Found([], 0)
        condition, values = where(terms)
        if only is not None:
            condition += " AND id IN (SELECT value FROM json_each(?))"
            values.append(json.dumps(list(only)))
        page = "ORDER BY created DESC, id DESC LIMIT ? OFFSET ?"

        def ask(db: sqlite3.Connection, file: Path) -> Found:
            reading = self._refresh(db, file, frozenset(only or ()))
            (count,) = db.execute(f"SELECT count(*) FROM takes WHERE {condition}", values).fetchone()
            asked = f"SELECT id, info FROM takes WHERE {condition} {page}"
            rows = db.execute(asked, [*values, -1 if limit is None else limit, offset]).fetchall()
            return Found([self._info(id_, info) for id_, info in rows], count, reading)

        with self._lock:
            return self._with_index(ask)

    def _info(self, id_: str, info: str) -> TakeInfo:
        values = json.loads(info)
        (values["problem"],) = with_codes([values["problem"]], values.pop(SAID))
        tuples: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
        }
        return TakeInfo(path=self._sessions / id_, **tuples)

    def _with_index(self, ask: Callable[[sqlite3.Connection, Path], T]) -> T:
        """Return the answer of `ask` on the index, which is made again, or elsewhere, if needed."""
        if self._elsewhere is None:
            for _ in range(2):
                try:
                    return _asked(self._sessions / FILE, ask)
                except sqlite3.DatabaseError:
                    remove_index(self._sessions / FILE)
            self._elsewhere = Path(tempfile.mkdtemp(prefix="studio-index-"))
            weakref.finalize(self, shutil.rmtree, self._elsewhere, ignore_errors=True)
        return _asked(self._elsewhere / FILE, ask)

    def _refresh(self, db: sqlite3.Connection, file: Path, wanted: frozenset[str]) -> ReadSoFar | None:
        """Bring the index up to date with the folders, or begin to; return the progress, None if complete."""
        stale = find_stale(db, self._sessions)
        forget_takes(db, stale.gone)
        unread = sorted(stale.unread, key=lambda id_: id_ not in wanted)
        now = max(AT_ONCE, sum(id_ in wanted for id_ in unread))
        read_takes(db, self._sessions, [*unread[:now], *stale.unsettled[:AT_ONCE]], self._clock_ns)
        later = len(unread[now:])
        if later or len(stale.unsettled) > AT_ONCE:
            self._begin_rest(file)
        return ReadSoFar(stale.count - later, stale.count) if later else None

    def _begin_rest(self, file: Path) -> None:
        """Start to read the rest, unless that is under way."""
        if self._reading is not None and self._reading.is_alive():
            return

        def read() -> None:
            try:
                self._read_rest(self._sessions, file)
            except (StudioError, sqlite3.DatabaseError) as error:
                _log.warning(
                    "the takes of %s are not all read, the next list goes on: %s", self._sessions, error
                )

        self._reading = threading.Thread(target=read, name="reading takes", daemon=True)
        self._reading.start()


def _asked(file: Path, ask: Callable[[sqlite3.Connection, Path], T]) -> T:
    with closing(open_index(file)) as db:
        return ask(db, file)
