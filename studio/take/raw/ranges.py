"""Sets of frame numbers as ranges, for present and missing frames of a camera."""

from bisect import bisect_right
from collections.abc import Iterator


class Ranges:
    """A set of whole numbers, stored as sorted ranges with both ends included."""

    def __init__(self) -> None:
        self._begins: list[int] = []
        self._ends: list[int] = []

    def __contains__(self, number: int) -> bool:
        at = bisect_right(self._begins, number) - 1
        return at >= 0 and number <= self._ends[at]

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield the ranges in order."""
        return zip(list(self._begins), list(self._ends), strict=True)

    @property
    def count(self) -> int:
        """Number of elements."""
        return sum(end - begin + 1 for begin, end in self)

    @property
    def first(self) -> int | None:
        return self._begins[0] if self._begins else None

    @property
    def last(self) -> int | None:
        return self._ends[-1] if self._ends else None

    def add(self, number: int) -> bool:
        """Add a number; return False if it is in the set already."""
        at = bisect_right(self._begins, number) - 1
        if at >= 0 and number <= self._ends[at]:
            return False
        joins_before = at >= 0 and self._ends[at] == number - 1
        joins_after = at + 1 < len(self._begins) and self._begins[at + 1] == number + 1
        if joins_before and joins_after:
            self._ends[at] = self._ends.pop(at + 1)
            self._begins.pop(at + 1)
        elif joins_before:
            self._ends[at] = number
        elif joins_after:
            self._begins[at + 1] = number
        else:
            self._begins.insert(at + 1, number)
            self._ends.insert(at + 1, number)
        return True

    def add_range(self, begin: int, end: int) -> None:
        """Add a range, both ends included, after all others."""
        if self._ends and begin <= self._ends[-1]:
            raise ValueError(f"range from {begin} does not lie behind {self._ends[-1]}")
        self._begins.append(begin)
        self._ends.append(end)

    def gaps(self, first: int, last: int) -> list[tuple[int, int]]:
        """Return the ranges of numbers from `first` to `last` that are missing."""
        out: list[tuple[int, int]] = []
        at = first
        for begin, end in self:
            if end < at:
                continue
            if begin > last:
                break
            if begin > at:
                out.append((at, begin - 1))
            at = end + 1
        if at <= last:
            out.append((at, last))
        return out
