"""How long the list of many takes takes: as the folders are read, and by the index.

    .venv/bin/python -m tests.take.list_speed FOLDER [COUNT]

Makes COUNT takes (10,000) of a second in FOLDER, where they stay for the next time.
"""

import shutil
import statistics
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from studio.engine.base.files import write_json
from studio.take.folder.measured import keep_measured
from studio.take.folder.take import Take
from studio.take.library.index import FILE, TakeIndex
from studio.take.library.index_file import read_rest
from studio.take.library.query import parse_query
from studio.take.library.sessions import take_ids, take_info
from tests.take.helpers import recorded_take

PERFORMERS = ("Anna", "Ben", "Chloé", "Dmitri")
TAGS = ("best", "fight", "walk", "again", "face")
PAGE = 60
ROUNDS = 7


def make_takes(sessions: Path, count: int) -> None:
    """Make takes until there are `count`: two cameras, a second, one solve, every fifth measured."""
    rng = np.random.default_rng(1)
    pattern = sessions.parent / f".{sessions.name}-pattern"
    shutil.rmtree(pattern, ignore_errors=True)
    recorded_take(pattern, ["camera_0", "camera_1"], 30)
    begin = datetime(2025, 1, 1, 9, tzinfo=UTC)
    for k in range(count):
        moment = begin + timedelta(hours=k)
        path = sessions / f"{moment:%Y-%m-%d}" / f"take_{k:05d}"
        if (path / "take.json").is_file():
            continue
        shutil.copytree(pattern, path)
        take = Take.open(path)
        tags = [tag for tag in TAGS if rng.uniform() < 0.2]
        told = {"performer": str(rng.choice(PERFORMERS)), "notes": f"scene {k % 40}", "tags": tags}
        take.meta.update(created=moment.isoformat(timespec="seconds"), **told)
        write_json(path / "take.json", take.meta, to_disk=False)
        solve = path / "solves" / "studio"
        solve.mkdir()
        (solve / "poses.npz").write_bytes(b"")
        write_json(solve / "metrics.json", {"jumps": int(rng.integers(4))}, to_disk=False)
        if k % 5 == 0:
            keep_measured(solve, {}, {"truth.csv": {"mpjpe_mm": float(rng.uniform(10, 60))}})
    shutil.rmtree(pattern)


def scan(sessions: Path) -> int:
    """Read every take, as without an index."""
    return len([take_info(sessions / id_) for id_ in take_ids(sessions)])


def took_s(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Median processor time of some work [s]: others may use the machine too."""
    times = []
    for _ in range(rounds):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return statistics.median(times)


def main(folder: str, count: str = "10000") -> None:
    sessions = Path(folder)
    make_takes(sessions, int(count))
    (sessions / FILE).unlink(missing_ok=True)
    index = TakeIndex(sessions, read_rest=lambda *_: None)
    read_s = took_s(lambda: scan(sessions), 1)
    begun = time.perf_counter()
    first_s = took_s(lambda: index.search(limit=PAGE), 1)
    print(f"the first page of a new index came after {time.perf_counter() - begun:.2f} s")
    rest_s = took_s(lambda: read_rest(sessions, sessions / FILE), 1)
    time.sleep(2.5)  # until what was just made counts as settled
    read_rest(sessions, sessions / FILE)
    figures = {
        "all folders read": read_s,
        "first page, no index": first_s,
        "the rest of the index": rest_s,
        "page of the index": took_s(lambda: index.search(limit=PAGE)),
        "page far down": took_s(lambda: index.search(limit=PAGE, offset=int(count) - PAGE)),
        "search in words": took_s(lambda: index.search(parse_query("scene chloe"), limit=PAGE)),
        "search in fields": took_s(
            lambda: index.search(
                parse_query("tag:best performer:anna error:<20mm date:>=2025-06"), limit=PAGE
            )
        ),
        "all of the index": took_s(index.search),
    }
    for name, seconds in figures.items():
        print(f"{name:22} {1e3 * seconds:9.1f} ms   {read_s / seconds:7.1f} times as fast")


if __name__ == "__main__":
    main(*sys.argv[1:])
