"""The index of takes gives the same answers as a scan of the folders, whatever happened to them."""

import json
import os
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from studio.engine.base.errors import StudioError
from studio.take.folder.measured import keep_measured, measured_figures
from studio.take.folder.take import Take
from studio.take.library import index_file
from studio.take.library.index import AT_ONCE, FILE, ReadSoFar, TakeIndex
from studio.take.library.index_file import SETTLED_NS, read_rest
from studio.take.library.query import folded, parse_query
from studio.take.library.sessions import TakeInfo, take_ids, take_info
from studio.take.library.slate import Slate, change_slate
from studio.take.library.trash import list_trash, restore, throw_away, throw_solve_away
from tests.take.helpers import recorded_take

LATER_NS = 10 * SETTLED_NS


def folders(sessions: Path) -> list[Path]:
    """Folders of takes."""
    return [sessions / id_ for id_ in take_ids(sessions) if (sessions / id_ / "take.json").is_file()]


def scan(sessions: Path) -> list[TakeInfo]:
    """All takes as their folders have them, in the order of the list."""
    found = [take_info(path) for path in folders(sessions)]
    return sorted(found, key=lambda info: (info.created, f"{info.session}/{info.name}"), reverse=True)


def error_of(info: TakeInfo) -> list[float]:
    return [
        value
        for solve in info.solves
        for name, value in measured_figures(info.path / "solves" / solve)
        if name == "error"
    ]


def anywhere(info: TakeInfo) -> str:
    return folded(f"{info.session}/{info.name} {info.notes} {info.performer} {' '.join(info.tags)}")


def day(text: str) -> float:
    return datetime.fromisoformat(text).astimezone().timestamp()


def made(info: TakeInfo) -> float:
    return datetime.fromisoformat(info.created).timestamp() if info.created else float("nan")


SEARCHES: dict[str, Callable[[TakeInfo], bool]] = {
    "": lambda info: True,
    "take_1": lambda info: "take_1" in anywhere(info),
    "ELEVE": lambda info: "eleve" in anywhere(info),
    "-jump": lambda info: "jump" not in anywhere(info),
    "tag:best": lambda info: "best" in map(folded, info.tags),
    "-tag:best,fight": lambda info: not {"best", "fight"} & set(map(folded, info.tags)),
    'performer:"anna b"': lambda info: "anna b" in folded(info.performer),
    "session:day": lambda info: "day" in info.session,
    "solve:studio is:solved": lambda info: "studio" in info.solves,
    "camera:camera_1": lambda info: "camera_1" in info.cameras,
    "is:starred rating:>=3": lambda info: info.starred and (info.rating or 0) >= 3,
    "is:damaged": lambda info: info.problem is not None,
    "length:>0.1s": lambda info: info.length_s is not None and info.length_s > 0.1,
    "date:2026-02": lambda info: day("2026-02-01") <= made(info) < day("2026-03-01"),
    "date:>2026-02": lambda info: made(info) >= day("2026-03-01"),
    "error:<2cm": lambda info: any(value < 20 for value in error_of(info)),
    "-error:<20": lambda info: not any(value < 20 for value in error_of(info)),
}
NAMES = st.sampled_from(["take_1", "take_2", "jump", "élève", "%_'"])
TEXTS = st.sampled_from(["", "Anna B", "Élève", 'jump "high"', "50 % _'"])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Takes to be copied: one camera, two cameras, longer."""
    place = tmp_path_factory.mktemp("recorded")
    return [
        recorded_take(place / name, cameras, count).path
        for name, cameras, count in (("a", ["camera_0"], 3), ("b", ["camera_0", "camera_1"], 9))
    ]


class Library(RuleBasedStateMachine):
    """A folder of sessions to which things are done, and its index; `ahead_ns`: how far its clock is ahead."""

    recorded: list[Path]
    place: Path
    ahead_ns = 0

    @initialize()
    def begin(self) -> None:
        self.sessions = self.place / f"sessions_{time.monotonic_ns()}"
        self.sessions.mkdir()
        self.index = TakeIndex(self.sessions, clock_ns=lambda: time.time_ns() + self.ahead_ns)
        self.written = 0

    def teardown(self) -> None:
        shutil.rmtree(self.sessions, ignore_errors=True)

    def pick(self, number: int) -> Path | None:
        takes = folders(self.sessions)
        return takes[number % len(takes)] if takes else None

    @rule(
        which=st.integers(0, 1),
        session=st.sampled_from(["day", "2026-02-03"]),
        name=NAMES,
        month=st.integers(1, 4),
    )
    def create(self, which: int, session: str, name: str, month: int) -> None:
        path = self.sessions / session / name
        if not path.exists():
            shutil.copytree(self.recorded[which], path)
            take = Take.open(path)
            take.meta["created"] = f"2026-{month:02d}-10T12:00:00+00:00"
            take.save_meta()

    @rule(
        number=st.integers(0, 9), session=st.sampled_from([None, "day", "other"]), name=st.none() | NAMES,
        notes=st.none() | TEXTS, performer=st.none() | TEXTS, rating=st.none() | st.integers(0, 5),
        starred=st.none() | st.booleans(), tags=st.none() | st.sampled_from([(), ("best",), ("Fight", "best")]),
    )  # fmt: skip
    def edit(self, number: int, session: str | None, name: str | None, **values: object) -> None:
        path = self.pick(number)
        if path is None or take_info(path).problem:
            return
        to = self.sessions / (session or path.parent.name) / (name or path.name)
        if to != path and to.exists():
            return
        change_slate(self.sessions, path.parent.name, path.name, Slate(session=session, name=name, **values))

    @rule(number=st.integers(0, 9))
    def throw(self, number: int) -> None:
        path = self.pick(number)
        if path is not None:
            throw_away(self.sessions, path.parent.name, path.name)

    @rule()
    def put_back(self) -> None:
        for thrown in list_trash(self.sessions)[:1]:
            if not thrown.solve or (self.sessions / thrown.session / thrown.name / "take.json").is_file():
                try:
                    restore(self.sessions, thrown.id)
                except Exception as error:  # the take is damaged by now
                    assert "take.json" in str(error)

    @rule(
        number=st.integers(0, 9),
        solve=st.sampled_from(["studio", "finish"]),
        error=st.sampled_from([None, 12.0, 30.0]),
    )
    def measure(self, number: int, solve: str, error: float | None) -> None:
        path = self.pick(number)
        if path is not None:
            folder = path / "solves" / solve
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "poses.npz").write_bytes(b"")
            if error is not None:
                keep_measured(folder, {"jitter_mm": 1.0}, {"truth.csv": {"mpjpe_mm": error}})

    @rule(number=st.integers(0, 9))
    def throw_solve(self, number: int) -> None:
        path = self.pick(number)
        if path is not None and not take_info(path).problem and take_info(path).solves:
            throw_solve_away(self.sessions, path.parent.name, path.name, take_info(path).solves[0])

    @rule(
        number=st.integers(0, 9),
        how=st.sampled_from(["damage", "note", "cut", "remove", "move", "unsolve", "copy"]),
    )
    def change_outside(self, number: int, how: str) -> None:
        path = self.pick(number)
        if path is None:
            return
        self.written += 1
        file = path / "take.json"
        if how == "damage":
            file.write_text("{" + " " * self.written)
        elif how == "note" and not take_info(path).problem:
            meta = json.loads(file.read_text())
            file.write_text(json.dumps({**meta, "notes": "jump" + "!" * self.written}))
        elif how == "cut" and (path / "raw.mcap").is_file():
            data = (path / "raw.mcap").read_bytes()
            (path / "raw.mcap").write_bytes(data[: max(len(data) - self.written, 0)])
        elif how == "remove":
            shutil.rmtree(path)
        elif how == "move":
            path.rename(path.parent / f"moved_{self.written}")
        elif how == "unsolve":
            shutil.rmtree(path / "solves", ignore_errors=True)
        elif how == "copy":
            shutil.copytree(path.parent, self.sessions / f"copy_{self.written}")

    @rule(how=st.sampled_from(["lost", "damaged", "empty", "other version", "anew"]))
    def harm_the_index(self, how: str) -> None:
        file = self.sessions / FILE
        if how == "lost" or not file.exists():
            file.unlink(missing_ok=True)
        elif how == "damaged":
            data = bytearray(file.read_bytes())
            data[50:] = b"\xff" * (len(data) - 50)
            file.write_bytes(bytes(data))
        elif how == "empty":
            file.write_bytes(b"")
        elif how == "other version":
            db = sqlite3.connect(file)
            with db:
                db.execute("UPDATE about SET layout = 'older'")
                db.execute("DELETE FROM takes")
            db.close()
        self.index = TakeIndex(self.sessions, clock_ns=lambda: time.time_ns() + self.ahead_ns)

    @invariant()
    def answers_as_a_scan(self) -> None:
        if not hasattr(self, "index"):
            return
        takes = scan(self.sessions)
        for text, is_wanted in SEARCHES.items():
            wanted = [info for info in takes if is_wanted(info)]
            assert self.index.search(parse_query(text)) == (wanted, len(wanted), None), text
        assert self.index.search(limit=2, offset=1) == (takes[1:3], len(takes), None)
        some = [f"{info.session}/{info.name}" for info in takes[:2]]
        assert self.index.search(only=[*some, "day/nobody"]) == (takes[:2], len(some), None)


@pytest.mark.parametrize("ahead_ns", [0, LATER_NS], ids=["read again", "by their stamps"])
def test_the_index_answers_as_a_scan_of_the_folders(
    tmp_path: Path, recorded: list[Path], ahead_ns: int
) -> None:
    machine = type("Library", (Library,), {"recorded": recorded, "place": tmp_path, "ahead_ns": ahead_ns})
    case = machine.TestCase
    case.settings = settings(
        max_examples=5, stateful_step_count=15, deadline=None, suppress_health_check=list(HealthCheck)
    )
    case("runTest").runTest()


def test_what_is_settled_is_read_once(tmp_path: Path, recorded: list[Path], monkeypatch) -> None:
    for name in ("one", "two"):
        shutil.copytree(recorded[0], tmp_path / "day" / name)
    read: list[str] = []

    def counted(path: Path) -> TakeInfo:
        read.append(path.name)
        return take_info(path)

    monkeypatch.setattr(index_file, "take_info", counted)
    later = TakeIndex(tmp_path, clock_ns=lambda: time.time_ns() + LATER_NS)
    assert later.search().count == 2 and sorted(read) == ["one", "two"]
    read.clear()
    assert TakeIndex(tmp_path, clock_ns=lambda: time.time_ns() + LATER_NS).search()[1] == 2
    assert not read
    change_slate(tmp_path, "day", "two", Slate(notes="changed"))
    assert [info.notes for info in later.search(parse_query("changed"))[0]] == ["changed"] and read == ["two"]


def test_what_was_just_changed_is_read_again(tmp_path: Path, recorded: list[Path], monkeypatch) -> None:
    """A file may change again within the same tick of its file system's clock."""
    shutil.copytree(recorded[0], tmp_path / "day" / "one")
    monkeypatch.setattr(index_file, "_stamp", lambda take, names: ("always the same", time.time_ns()))
    takes = TakeIndex(tmp_path)
    takes.search()
    change_slate(tmp_path, "day", "one", Slate(notes="again"))
    assert takes.search(parse_query("again"))[1] == 1


def test_a_take_that_goes_away_while_it_is_read_is_left_out(
    tmp_path: Path, recorded: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("one", "two"):
        shutil.copytree(recorded[0], tmp_path / "sessions" / "day" / name)
    read = Take.all_performers

    def moved_meanwhile(take: Take) -> list[str]:
        if take.path.name == "one":
            shutil.move(take.path, tmp_path / "elsewhere")
            list((take.path / "solves").iterdir())  # as whoever had begun to list it
        return read(take)

    monkeypatch.setattr(Take, "all_performers", moved_meanwhile)
    takes = TakeIndex(tmp_path / "sessions")
    assert [info.name for info in takes.search()[0]] == ["two"]
    assert not takes.search(parse_query("one"))[0]


def test_an_index_that_cannot_be_written_lies_elsewhere(tmp_path: Path, recorded: list[Path]) -> None:
    shutil.copytree(recorded[0], tmp_path / "day" / "one")
    (tmp_path / FILE / "in the way").mkdir(parents=True)
    takes = TakeIndex(tmp_path)
    assert takes.search()[1] == 1 and takes.search()[1] == 1
    assert (tmp_path / FILE / "in the way").is_dir()


def test_nothing_is_written_where_there_are_no_sessions(tmp_path: Path) -> None:
    assert TakeIndex(tmp_path / "missing").search() == ([], 0, None)
    assert not (tmp_path / "missing").exists()


def many_takes(sessions: Path, count: int) -> list[str]:
    """Make takes with nothing but a name, the newest last; return their ids, the newest first."""
    ids = []
    for k in range(count):
        created = f"2026-02-01T{k // 60:02d}:{k % 60:02d}:00+00:00"
        path = sessions / "day" / f"take_{k:03d}"
        take = Take.create(
            path, session="day", name=path.name, source="import", created=created, notes=f"scene {k}"
        )
        os.utime(take.path / "take.json", ns=(k * 10**9, k * 10**9))
        ids.append(f"day/take_{k:03d}")
    return ids[::-1]


class Gated:
    """Reads the rest of an index once it may; `begun` and `ended` count."""

    def __init__(self) -> None:
        self.may, self.ended, self.begun = threading.Semaphore(0), threading.Semaphore(0), 0

    def __call__(self, sessions: Path, file: Path) -> None:
        self.begun += 1
        self.may.acquire()
        read_rest(sessions, file)
        self.ended.release()


def ids_of(takes: list[TakeInfo]) -> list[str]:
    return [f"{info.session}/{info.name}" for info in takes]


def test_the_newest_takes_come_at_once_and_the_others_later(tmp_path: Path) -> None:
    count = 3 * AT_ONCE
    ids, gate = many_takes(tmp_path, count), Gated()
    takes = TakeIndex(tmp_path, read_rest=gate)
    first = takes.search(limit=10)
    assert ids_of(first.takes) == ids[:10] and first[1:] == (AT_ONCE, ReadSoFar(AT_ONCE, count))
    oldest = takes.search(only=[ids[-1]])  # what somebody works with is read before the others
    assert ids_of(oldest.takes) == [ids[-1]] and oldest.reading == ReadSoFar(2 * AT_ONCE, count)
    found = takes.search(parse_query('note:"scene 1"'))  # each answer reads some, while the rest waits
    assert found.reading is None and gate.begun == 1
    gate.may.release()
    assert gate.ended.acquire(timeout=60)
    assert ids_of(takes.search().takes) == ids


def test_what_is_read_later_is_in_the_next_answer(tmp_path: Path) -> None:
    count = 4 * AT_ONCE
    ids, gate = many_takes(tmp_path, count), Gated()
    takes = TakeIndex(tmp_path, read_rest=gate, clock_ns=lambda: time.time_ns() + LATER_NS)
    assert takes.search(parse_query("note:scene")).reading == ReadSoFar(AT_ONCE, count)
    shutil.rmtree(tmp_path / ids[-1])  # not read yet, and gone
    change_slate(tmp_path, "day", "take_001", Slate(notes="changed"))
    gate.may.release()
    assert gate.ended.acquire(timeout=60)
    found = takes.search()
    assert ids_of(found.takes) == ids[:-1] and found[1:] == (count - 1, None)
    assert found.takes == scan(tmp_path)


def test_the_rest_is_read_in_a_process(tmp_path: Path) -> None:
    count = 2 * AT_ONCE + 1
    many_takes(tmp_path, count)
    takes = TakeIndex(tmp_path)
    assert takes.search().reading == ReadSoFar(AT_ONCE, count)
    assert takes._reading is not None
    takes._reading.join(timeout=300)
    assert takes.search()[1:] == (count, None)


def test_reading_that_broke_off_goes_on_with_the_next_answer(tmp_path: Path, caplog) -> None:
    def broken(sessions: Path, file: Path) -> None:
        raise StudioError("read_rest broke off")

    count = 2 * AT_ONCE + 1
    many_takes(tmp_path, count)
    takes = TakeIndex(tmp_path, read_rest=broken)
    for done in (AT_ONCE, 2 * AT_ONCE, count):
        assert takes.search().reading == (ReadSoFar(done, count) if done < count else None)
        if takes._reading is not None:
            takes._reading.join()
    assert "not all read" in caplog.text
