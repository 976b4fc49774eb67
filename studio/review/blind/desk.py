"""The desk: open tests, their voters, and every vote. Thread-safe."""

import hashlib
import secrets
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from studio.engine.base.errors import SettingsError, StudioError, TakeError
from studio.engine.base.value_sentences import bad_setting
from studio.review.blind import store
from studio.review.blind.draw import Showing, showings
from studio.review.blind.model import BlindTest, Pair, Rules, check
from studio.review.blind.store import VoteEvent

CHOICES = ("left", "right", "none")
MAX_COMMENT = 1000
MAX_NAME = 60
MAX_WATCHED_S = 3600.0
CACHED = 64

Bake = Callable[[tuple[Pair, ...]], list[tuple[bytes, bytes]]]
"""Function that makes the two animations of each pair."""


class NoSuchTest(StudioError):
    """An invalid link or key; voters get no further details."""


class VotingClosed(StudioError):
    """The test accepts no votes, or no more voters."""


class TooMany(StudioError):
    """Too many requests from one client."""


@dataclass
class Voter:
    """A voter: number, name, and the newest vote of each slot."""

    number: int
    name: str = ""
    votes: dict[int, VoteEvent] = field(default_factory=dict)


@dataclass
class _OpenTest:
    test: BlindTest
    voters: list[Voter] = field(default_factory=list)
    by_key: dict[str, Voter] = field(default_factory=dict)


class Desk:
    """All tests in a folder of sessions."""

    def __init__(self, sessions: Path, *, now: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._sessions = sessions
        self._now = now
        self._lock = threading.RLock()
        self._open: dict[str, _OpenTest] = {}
        self._cache: OrderedDict[tuple[str, int, str], bytes] = OrderedDict()
        tests, self.problems = store.load_all(sessions)
        for test in tests:
            self._open[test.id] = self._replayed(test)

    def _replayed(self, test: BlindTest) -> _OpenTest:
        """Return a test with the votes cast before a restart."""
        opened = _OpenTest(test)
        for event in store.read_events(self._sessions, test.id):
            if event.slot < 0 and event.voter == len(opened.voters):
                self._seat(opened, event)
            elif 0 <= event.voter < len(opened.voters) and 0 <= event.slot < len(test.slots):
                opened.voters[event.voter].votes[event.slot] = event
        return opened

    @staticmethod
    def _seat(opened: _OpenTest, event: VoteEvent) -> Voter:
        voter = Voter(event.voter, event.name)
        opened.voters.append(voter)
        opened.by_key[event.key_hash] = voter
        return voter

    # --- the operator's side

    def create(
        self, title: str, question: str, pairs: tuple[Pair, ...], rules: Rules, bake: Bake
    ) -> BlindTest:
        """Make a test and its animations; return it, open for votes.

        Raises:
            SettingsError: an invalid test.
            StudioError: an animation cannot be made, or the disk refuses.
        """
        check(title, question, pairs, rules)
        repeated = sorted(secrets.SystemRandom().sample(range(len(pairs)), rules.repeats))
        test = BlindTest(
            id=f"test_{self._now():%Y%m%d_%H%M%S}_{secrets.token_hex(2)}",
            token=secrets.token_urlsafe(24),
            title=title.strip(),
            question=question.strip(),
            pairs=pairs,
            rules=rules,
            seed=secrets.randbits(48),
            repeated=tuple(repeated),
            created=self._now().isoformat(timespec="seconds"),
        )
        test = store.create(self._sessions, test, bake(pairs))
        with self._lock:
            self._open[test.id] = _OpenTest(test)
        return test

    def tests(self) -> list[BlindTest]:
        """Return all tests, the oldest first."""
        with self._lock:
            return [opened.test for opened in self._open.values()]

    def test(self, test_id: str) -> BlindTest:
        """Return a test.

        Raises:
            TakeError: there is none.
        """
        return self._of(test_id).test

    def voters(self, test_id: str) -> list[Voter]:
        """Return a copy of a test's voters with their votes.

        Raises:
            TakeError: there is no such test.
        """
        with self._lock:
            return [Voter(v.number, v.name, dict(v.votes)) for v in self._of(test_id).voters]

    def close(self, test_id: str) -> BlindTest:
        """Close the test for votes."""
        return self._change(test_id, closed=self._now().isoformat(timespec="seconds"))

    def reopen(self, test_id: str) -> BlindTest:
        """Open the test for votes again."""
        return self._change(test_id, closed="")

    def renew_link(self, test_id: str) -> BlindTest:
        """Give the test a new link; the old one becomes invalid, votes stay."""
        return self._change(test_id, token=secrets.token_urlsafe(24))

    def revoke_link(self, test_id: str) -> BlindTest:
        """Delete the link."""
        return self._change(test_id, token="")

    def show(self, test_id: str, slot: int) -> BlindTest:
        """Show a slot of a supervised test to all voters.

        Raises:
            SettingsError: the test is not supervised, or there is no such slot.
        """
        test = self.test(test_id)
        if not test.rules.supervised:
            raise SettingsError(
                "blind.not_supervised", "this test is not supervised: every voter goes on at their own pace"
            )
        if not -1 <= slot < len(test.slots):
            raise SettingsError(
                "blind.slot_or_none",
                "slot={n} is not allowed; allowed: 0 to {most}, -1 shows none",
                n=slot,
                most=len(test.slots) - 1,
            )
        return self._change(test_id, shown=slot)

    def _change(self, test_id: str, **changes: str | int) -> BlindTest:
        with self._lock:
            opened = self._of(test_id)
            changed = msgspec.structs.replace(opened.test, **changes)
            store.save(self._sessions, changed)
            opened.test = changed
            return changed

    def _of(self, test_id: str) -> _OpenTest:
        with self._lock:
            if test_id not in self._open:
                raise TakeError(
                    "blind.no_such_test",
                    "there is no blind test {test!r}; there are: {others}",
                    test=test_id,
                    others=", ".join(self._open) or "none",
                )
            return self._open[test_id]

    # --- the voter's side

    def by_token(self, token: str) -> BlindTest:
        """Return the test of a link.

        Raises:
            NoSuchTest: none.
        """
        with self._lock:
            for opened in self._open.values():
                if opened.test.token and secrets.compare_digest(opened.test.token.encode(), token.encode()):
                    return opened.test
        raise NoSuchTest(
            "blind.link_unknown", "this link leads to no test; ask who gave it to you for a new one"
        )

    def is_open(self, test: BlindTest) -> bool:
        """Whether votes are accepted now."""
        return test.is_open(self._now())

    def join(self, token: str, name: str = "") -> str:
        """Register a new voter; return the secret that identifies them later.

        Raises:
            NoSuchTest: a wrong link.
            VotingClosed: the test is over or full.
            StudioError: the disk refuses.
        """
        with self._lock:
            test = self.by_token(token)
            opened = self._open[test.id]
            self._check_open(test)
            if len(opened.voters) >= test.rules.max_voters:
                raise VotingClosed("blind.full", "this test has all the voters it needs; thank you")
            key = secrets.token_urlsafe(18)
            given = name.strip()[:MAX_NAME] if test.rules.ask_name else ""
            event = VoteEvent(len(opened.voters), self._time(), key_hash=_hash(key), name=given)
            store.append_event(self._sessions, test.id, event)
            self._seat(opened, event)
            return key

    def voter(self, token: str, key: str) -> tuple[BlindTest, Voter]:
        """Return the test of a link and the voter of a secret.

        Raises:
            NoSuchTest: either is wrong.
        """
        with self._lock:
            test = self.by_token(token)
            voter = self._open[test.id].by_key.get(_hash(key))
        if voter is None:
            raise NoSuchTest("blind.not_joined", "you have not joined this test; open the link again")
        return test, voter

    def vote(
        self, token: str, key: str, slot: int, choice: str, *, watched_s: float = 0.0, comment: str = ""
    ) -> None:
        """Store a vote, which replaces the voter's last one on this slot; it is on disk when this returns.

        Raises:
            NoSuchTest: a wrong link or secret.
            VotingClosed: the test is over.
            SettingsError: a vote that is not allowed.
            StudioError: the disk refuses.
        """
        with self._lock:
            test, voter = self.voter(token, key)
            self._check_open(test)
            allowed = CHOICES if test.rules.allow_none else CHOICES[:2]
            if choice not in allowed:
                raise SettingsError(bad_setting("choice", choice, allowed))
            if not 0 <= slot < len(test.slots):
                raise SettingsError(
                    "blind.slot",
                    "slot={n} is not allowed; allowed: 0 to {most}",
                    n=slot,
                    most=len(test.slots) - 1,
                )
            if len(comment) > MAX_COMMENT:
                raise SettingsError(
                    "blind.comment_too_long",
                    "the comment has {n} characters; allowed: {most}",
                    n=len(comment),
                    most=MAX_COMMENT,
                )
            watched = min(max(watched_s, 0.0), MAX_WATCHED_S) if watched_s == watched_s else 0.0
            event = VoteEvent(
                voter.number,
                self._time(),
                slot=slot,
                choice=choice,
                watched_s=round(watched, 1),
                comment=comment,
            )
            store.append_event(self._sessions, test.id, event)
            voter.votes[slot] = event

    def showing(self, token: str, key: str, slot: int) -> tuple[BlindTest, Showing]:
        """Return the pair at a position in a voter's order.

        Raises:
            NoSuchTest: a wrong link or secret, or no such position.
        """
        test, voter = self.voter(token, key)
        shown = showings(test, voter.number)
        if not 0 <= slot < len(shown):
            raise NoSuchTest("blind.no_such_pair", "there is no such pair in this test")
        return test, shown[slot]

    def animation(self, test: BlindTest, pair: int, side: str) -> bytes:
        """Return the GLB file of a side, `a` or `b`.

        Raises:
            TakeError: it is missing or was changed.
        """
        wanted = (test.id, pair, side)
        with self._lock:
            if wanted in self._cache:
                self._cache.move_to_end(wanted)
                return self._cache[wanted]
        data = store.animation(self._sessions, test, pair, side)
        with self._lock:
            self._cache[wanted] = data
            while len(self._cache) > CACHED:
                self._cache.popitem(last=False)
        return data

    def _check_open(self, test: BlindTest) -> None:
        if not self.is_open(test):
            raise VotingClosed("blind.over", "this test is over; thank you")

    def _time(self) -> str:
        return self._now().isoformat(timespec="seconds")


def _hash(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest()
