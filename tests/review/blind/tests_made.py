"""Blind tests for the tests: conditions, votes, and animations of a few bytes where motion does not matter."""

from datetime import UTC, datetime
from pathlib import Path

from studio.review.blind.desk import Desk
from studio.review.blind.model import BlindTest, Pair, Rules, Side


def side(condition: str, solve: str = "studio") -> Side:
    """A side of the take monday/one."""
    return Side(condition=condition, take="monday/one", solve=solve)


def pairs(count: int = 6) -> tuple[Pair, ...]:
    """Pairs of two conditions, distinguished by their solves."""
    return tuple(Pair(a=side("off", f"off_{i}"), b=side("on", f"on_{i}")) for i in range(count))


def bake(wanted: tuple[Pair, ...]) -> list[tuple[bytes, bytes]]:
    """Two files of one size for each pair."""
    return [
        (f"animation {pair.a.solve:>20}".encode(), f"animation {pair.b.solve:>20}".encode())
        for pair in wanted
    ]


class Now:
    """A clock that the test sets."""

    def __init__(self) -> None:
        self.time = datetime(2026, 1, 1, 12, tzinfo=UTC)

    def __call__(self) -> datetime:
        return self.time


def made(
    sessions: Path, *, count: int = 6, now: Now | None = None, **rules: object
) -> tuple[Desk, BlindTest]:
    """A desk with one test."""
    desk = Desk(sessions, now=now or Now())
    return desk, desk.create("Walks", "Which looks better?", pairs(count), Rules(**rules), bake)
