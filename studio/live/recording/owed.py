"""Frames that clients of a recording keep, and acknowledgements to them: participants, kept frames, frames on the
disk."""

import threading
from collections import Counter

from studio.take.raw.append import RawState
from studio.take.raw.membership import BEFORE, STRANGER, Key, joined_starts
from studio.take.raw.ranges import Ranges
from studio.wire import ENDED, Ack

MAX_GAPS = 1000


class Owed:
    """The frames of one recording; methods may be called from any thread.

    Args:
        state: of the take's raw file, if it was begun before a restart of the server.
    """

    def __init__(self, take_id: str, state: RawState | None = None) -> None:
        self._take_id = take_id
        self._lock = threading.Lock()
        self._first: dict[Key, int] = {} if state is None else joined_starts(state)
        self._before_restart = frozenset(self._first)
        self._kept: dict[Key, tuple[int, int]] = {}
        self._synced: dict[Key, Ranges] = {}
        self._brought: Counter[str] = Counter()
        self._refused: Counter[tuple[str, str]] = Counter()
        for key, ranges in {} if state is None else state.frames.items():
            self._synced[key] = Ranges()
            for begin, end in ranges:
                self._synced[key].add_range(begin, end)

    def join(self, key: Key, first: int) -> bool:
        """Add a start of a client with its frames from `first` on; return False if it takes part already."""
        with self._lock:
            if key in self._first:
                return False
            self._first[key] = first
            return True

    def joined(self, key: Key) -> bool:
        """Whether this start of a client takes part."""
        with self._lock:
            return key in self._first

    def keeps(self, key: Key, first: int, last: int) -> None:
        """Register the frames that a participating client keeps."""
        with self._lock:
            first = max(first, self._first[key])
            old = self._kept.get(key, (first, last))
            self._kept[key] = (min(first, old[0]), max(last, old[1]))

    def came(self, key: Key, sequence: int) -> None:
        """Register a frame of the take."""
        with self._lock:
            first, last = self._kept.get(key, (0, -1))
            if key in self._before_restart and first <= sequence <= last:
                self._brought[key[0]] += 1

    def brought(self) -> dict[str, int]:
        """Return the number of frames by camera that clients kept while the server was away, and that the take has
        now."""
        with self._lock:
            return dict(self._brought)

    def missing(self, seen: dict[Key, Ranges]) -> dict[str, int]:
        """Return the number of missing frames by camera: between seen ones, or kept by a client."""
        with self._lock:
            kept = dict(self._kept)
        out: dict[str, int] = {}
        for key in {*seen, *kept}:
            there = seen.get(key, Ranges())
            ends = [
                (first, last)
                for first, last in (kept.get(key, (None, None)), (there.first, there.last))
                if first is not None and last is not None
            ]
            if not ends:
                continue
            gaps = there.gaps(min(first for first, _ in ends), max(last for _, last in ends))
            count = sum(end - begin + 1 for begin, end in gaps)
            if count:
                out[key[0]] = out.get(key[0], 0) + count
        return out

    def refuses(self, key: Key, sequence: int) -> bool:
        """Whether a kept frame does not belong to the take; it is then counted."""
        with self._lock:
            first = self._first.get(key)
        if first is not None and sequence >= first:
            return False
        self.refused(key[0], STRANGER if first is None else BEFORE)
        return True

    def refused(self, camera: str, reason: str, count: int = 1) -> None:
        """Count refused frames."""
        with self._lock:
            self._refused[camera, reason] += count

    def refusals(self) -> list[tuple[str, str, int]]:
        """Return camera, reason and number of the refused frames."""
        with self._lock:
            return [(camera, reason, count) for (camera, reason), count in self._refused.items()]

    def synced(self, frames: list[tuple[Key, int]]) -> None:
        """Register frames that are on the disk."""
        with self._lock:
            for key, sequence in frames:
                self._synced.setdefault(key, Ranges()).add(sequence)

    def ack(self, key: Key, first: int, *, ended: bool = False) -> Ack:
        """Return the acknowledgement for a client that keeps frames from `first` on; `ended`: no more are
        recorded."""
        with self._lock:
            first = max(first, self._first.get(key, first))
            return ack_of(self._take_id, key, self._synced.get(key, Ranges()), first, ended=ended)


def ack_of(take_id: str, key: Key, there: Ranges, first: int, *, ended: bool = False) -> Ack:
    """Return the acknowledgement for a client that keeps frames from `first` on, if those in `there` are safe."""
    last = max(first - 1 if there.last is None else there.last, first - 1)
    gaps = there.gaps(first, last)
    if len(gaps) > MAX_GAPS:
        return Ack(take_id, key[1], gaps[MAX_GAPS][0] - 1, gaps[:MAX_GAPS])
    return Ack(take_id, key[1], ENDED if ended else last, gaps)
