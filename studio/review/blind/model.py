"""A blind test: a question and pairs of animations, with rules; its JSON is `test.json`."""

from datetime import UTC, datetime
from typing import Any, Literal

import msgspec

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.performers.bodies import BODIES, check_body

FORMAT_VERSION = 1
MAX_PAIRS = 100
MAX_TEXT = 500
MAX_SECONDS = 60.0

Interpolation = Literal["linear", "held", "cubic"]


class Side(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One animation of a pair.

    Attributes:
        condition: name in the results, such as `limits on`; voters never see it.
        take: id, session/name; solve: name of the solve.
        key_hz: keys per second of the shown animation; 0 keeps the solve's.
        interpolation: between those keys: `linear`, `held` (none) or `cubic`.
    """

    condition: str
    take: str
    solve: str
    key_hz: float = 0.0
    interpolation: Interpolation = "linear"


class Pair(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Two animations over the same time; start_s and end_s are from the takes' first frame, end 0 = to the end."""

    a: Side
    b: Side
    start_s: float = 0.0
    end_s: float = 0.0
    title: str = ""


class Rules(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Rules of the vote.

    Attributes:
        allow_none: whether "no preference" may be chosen.
        ask_name: whether voters are asked for a name or code; it stays optional.
        repeats: number of pairs shown twice, sides exchanged, to measure a voter's consistency.
        max_voters: maximum number of voters; the test is full for later ones.
        closes: ISO 8601 with its offset, or empty; later votes are refused.
        supervised: everybody sees the pair that the operator shows.
        body: the mannequin's, on both sides of all pairs.
    """

    allow_none: bool = False
    ask_name: bool = False
    repeats: int = 2
    max_voters: int = 500
    closes: str = ""
    supervised: bool = False
    body: str = BODIES[0]


class BlindTest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stored test.

    Attributes:
        id: name in the API; token: the secret in the voters' link, empty once revoked.
        title, question: texts shown to voters.
        seed: of all draws of orders and sides.
        repeated: indices of the pairs shown twice.
        created: ISO 8601, UTC; closed: when the operator ended it, or empty.
        animations: SHA-256 of the two GLB files of every pair, in the order a, b.
        seal: SHA-256 of the key file.
        shown: in a supervised test, the slot that everybody sees; -1 = none yet.
    """

    id: str
    token: str
    title: str
    question: str
    pairs: tuple[Pair, ...]
    rules: Rules
    seed: int
    repeated: tuple[int, ...]
    created: str
    closed: str = ""
    animations: tuple[tuple[str, str], ...] = ()
    seal: str = ""
    shown: int = -1
    format_version: int = FORMAT_VERSION

    @property
    def slots(self) -> tuple[tuple[int, bool], ...]:
        """All slots of a voter, each once: (pair, whether it is the repeat)."""
        return (*((i, False) for i in range(len(self.pairs))), *((i, True) for i in self.repeated))

    def is_open(self, now: datetime) -> bool:
        """Whether votes are accepted."""
        closes = self.rules.closes
        return bool(self.token) and not self.closed and (not closes or now < datetime.fromisoformat(closes))


def check(title: str, question: str, pairs: tuple[Pair, ...], rules: Rules) -> None:
    """Raise SettingsError for an invalid test."""
    for name, text in (("title", title), ("question", question)):
        if not 1 <= len(text.strip()) <= MAX_TEXT:
            raise SettingsError(
                "blind.text_length",
                "{name} has {n} characters; allowed: 1 to {most}",
                name=name,
                n=len(text),
                most=MAX_TEXT,
            )
    if not 1 <= len(pairs) <= MAX_PAIRS:
        raise SettingsError(
            "blind.pairs_count", "a test has {n} pairs; allowed: 1 to {most}", n=len(pairs), most=MAX_PAIRS
        )
    for number, pair in enumerate(pairs, start=1):
        _check_pair(number, pair)
    check_body(rules.body)
    if not 0 <= rules.repeats <= len(pairs):
        raise SettingsError(
            "blind.repeats",
            "repeats={n} is not allowed; allowed: 0 to {most}, the pairs",
            n=rules.repeats,
            most=len(pairs),
        )
    if not 1 <= rules.max_voters <= 10_000:
        raise SettingsError(
            "blind.max_voters", "max_voters={n} is not allowed; allowed: 1 to 10000", n=rules.max_voters
        )
    if rules.closes:
        try:
            closes = datetime.fromisoformat(rules.closes)
        except ValueError:
            closes = datetime.min
        if closes.tzinfo is None:
            raise SettingsError(
                "blind.closes",
                "closes={time!r} is no time; such as {such}",
                time=rules.closes,
                such=datetime.now(UTC).isoformat(timespec="minutes"),
            )


def _check_pair(number: int, pair: Pair) -> None:
    if not 0 <= pair.start_s < MAX_SECONDS * 600 or not 0 <= pair.end_s < MAX_SECONDS * 600:
        raise SettingsError(
            "blind.pair_times",
            "pair {n}: start_s={start:g}, end_s={end:g} are not allowed; from 0",
            n=number,
            start=pair.start_s,
            end=pair.end_s,
        )
    if pair.end_s and pair.end_s - pair.start_s < 0.5:
        raise SettingsError(
            "blind.pair_too_short",
            "pair {number} lasts {seconds:g} s; allowed: half a second or more",
            number=number,
            seconds=pair.end_s - pair.start_s,
        )
    for side in (pair.a, pair.b):
        if not 1 <= len(side.condition.strip()) <= 100:
            raise SettingsError(
                "blind.condition",
                "pair {n}: a condition has 1 to 100 characters, such as 'limits on'",
                n=number,
            )
        if side.key_hz and not 1 <= side.key_hz <= 120:
            raise SettingsError(
                "blind.key_rate",
                "pair {n}: key_hz={rate:g} is not allowed; allowed: 0 or 1 to 120",
                n=number,
                rate=side.key_hz,
            )
    if pair.a == pair.b:
        raise SettingsError(
            "blind.pair_same_twice", "pair {number} has the same animation on both sides", number=number
        )


def from_json(value: Any) -> BlindTest:
    """Return the test in a decoded `test.json`.

    Raises:
        FormatError: it is not a test.
    """
    try:
        return msgspec.convert(value, BlindTest)
    except msgspec.ValidationError as error:
        raise FormatError("blind.not_a_test", "not a blind test: {error}", error=error) from error
