"""Results of a test's votes; for the operator only."""

import csv
import io

import numpy as np
from msgspec import Struct, structs

from studio.review.blind.desk import Voter
from studio.review.blind.draw import Showing, showings
from studio.review.blind.model import BlindTest
from studio.review.blind.statistics import VoteShare, bradley_terry, holm, share
from studio.review.blind.store import VoteEvent


class PairResult(Struct):
    """Votes on the pair with this index, without repeats. `of` votes are for a side, `share` of them for `a`.

    Attributes:
        a, b: conditions of the sides.
        share, low, high, p_value: as in `VoteShare`.
        p_holm: the p-value corrected for the number of pairs.
    """

    pair: int
    title: str
    a: str
    b: str
    votes_a: int
    votes_b: int
    no_preference: int
    of: int
    share: float
    low: float
    high: float
    p_value: float
    p_holm: float = 1.0


class Ranked(Struct):
    """A condition and its strength; all strengths sum to 1."""

    condition: str
    strength: float


class SideBias(Struct):
    """Votes for the left side."""

    left: VoteShare


class Consistency(Struct):
    """Repeats in which a voter chose the same animation with exchanged sides, `of` all; None without repeats."""

    same: int
    of: int
    share: float | None
    per_voter: list[float]


class Comment(Struct):
    """A voter's comment on the pair with this index, the condition that they chose, the time (ISO 8601, UTC)."""

    voter: str
    pair: int
    chosen: str
    comment: str
    at: str


class BlindResults(Struct):
    """All figures of a test.

    Attributes:
        closed: when the operator ended it, or empty.
        finished: number of voters who voted on all.
        ranking: conditions, if more than two, the strongest first; no preference counts as half a vote each.
        watched_s: median time for which a pair was on the screen [s]; None without votes.
    """

    test: str
    title: str
    question: str
    closed: str
    voters: int
    finished: int
    votes: int
    pairs: list[PairResult]
    ranking: list[Ranked]
    side_bias: SideBias
    consistency: Consistency
    watched_s: float | None
    comments: list[Comment]


Cast = tuple[Voter, Showing, VoteEvent]


def cast_votes(test: BlindTest, voters: list[Voter]) -> list[Cast]:
    """Return every vote with the pair that its voter saw."""
    out: list[Cast] = []
    for voter in voters:
        shown = showings(test, voter.number)
        out += [(voter, shown[slot], event) for slot, event in sorted(voter.votes.items())]
    return out


def chosen(showing: Showing, event: VoteEvent) -> str:
    """Return the chosen side: `a`, `b` or `none`."""
    if event.choice == "none":
        return "none"
    return "a" if (event.choice == "left") == showing.a_left else "b"


def results(test: BlindTest, voters: list[Voter]) -> BlindResults:
    """Return all figures of a test. Repeats do not count as preferences; they show the voters' consistency."""
    votes = cast_votes(test, voters)
    first = [one for one in votes if not one[1].repeat]
    pairs = [
        _pair(test, index, [one for one in first if one[1].pair == index]) for index in range(len(test.pairs))
    ]
    for pair, corrected in zip(pairs, holm([pair.p_value for pair in pairs]), strict=True):
        pair.p_holm = corrected
    sides = [event.choice for _, _, event in votes if event.choice != "none"]
    return BlindResults(
        test=test.id,
        title=test.title,
        question=test.question,
        closed=test.closed,
        voters=len(voters),
        finished=sum(len(voter.votes) == len(test.slots) for voter in voters),
        votes=len(votes),
        pairs=pairs,
        ranking=_ranking(test, first),
        side_bias=SideBias(share(sides.count("left"), len(sides))),
        consistency=_consistency(votes),
        watched_s=float(np.median([event.watched_s for *_, event in votes])) if votes else None,
        comments=[
            Comment(
                voter=voter.name or f"voter {voter.number + 1}",
                pair=showing.pair,
                chosen=_condition(test, showing, event),
                comment=event.comment,
                at=event.at,
            )
            for voter, showing, event in votes
            if event.comment
        ],
    )


def _condition(test: BlindTest, showing: Showing, event: VoteEvent) -> str:
    which = chosen(showing, event)
    pair = test.pairs[showing.pair]
    return {"a": pair.a.condition, "b": pair.b.condition, "none": "no preference"}[which]


def _pair(test: BlindTest, index: int, votes: list[Cast]) -> PairResult:
    pair = test.pairs[index]
    sides = [chosen(showing, event) for _, showing, event in votes]
    a, b, none = (sides.count(which) for which in ("a", "b", "none"))
    figures = structs.asdict(share(a, a + b))
    return PairResult(
        index, pair.title, pair.a.condition, pair.b.condition, figures.pop("votes"), b, none, **figures
    )


def _ranking(test: BlindTest, votes: list[Cast]) -> list[Ranked]:
    names = sorted({side.condition for pair in test.pairs for side in (pair.a, pair.b)})
    if len(names) < 3:
        return []
    wins = np.zeros((len(names), len(names)))
    for _, showing, event in votes:
        pair = test.pairs[showing.pair]
        a, b = names.index(pair.a.condition), names.index(pair.b.condition)
        gain = {"a": 1.0, "b": 0.0, "none": 0.5}[chosen(showing, event)]
        wins[a, b] += gain
        wins[b, a] += 1.0 - gain
    np.fill_diagonal(wins, 0.0)
    strengths = bradley_terry(wins)
    return [Ranked(names[i], float(strengths[i])) for i in np.argsort(-strengths, kind="stable")]


def _consistency(votes: list[Cast]) -> Consistency:
    by_voter: dict[int, dict[tuple[int, bool], str]] = {}
    for voter, showing, event in votes:
        by_voter.setdefault(voter.number, {})[(showing.pair, showing.repeat)] = chosen(showing, event)
    same = total = 0
    shares = []
    for mine in by_voter.values():
        again = [
            mine[(pair, False)] == which
            for (pair, repeat), which in mine.items()
            if repeat and (pair, False) in mine
        ]
        same, total = same + sum(again), total + len(again)
        if again:
            shares.append(sum(again) / len(again))
    return Consistency(same, total, same / total if total else None, shares)


def votes_csv(test: BlindTest, voters: list[Voter]) -> str:
    """Return every vote as a row of CSV."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        [
            "voter",
            "name",
            "pair",
            "repeat",
            "a",
            "b",
            "a_side",
            "choice",
            "chosen",
            "watched_s",
            "at",
            "comment",
        ]
    )
    for voter, showing, event in cast_votes(test, voters):
        pair = test.pairs[showing.pair]
        writer.writerow(
            [
                voter.number, _plain(voter.name), showing.pair, int(showing.repeat), _plain(pair.a.condition),
                _plain(pair.b.condition), "left" if showing.a_left else "right", event.choice,
                _plain(_condition(test, showing, event)), event.watched_s, event.at, _plain(event.comment),
            ]
        )  # fmt: skip
    return out.getvalue()


def _plain(text: str) -> str:
    """Text that no spreadsheet reads as a formula."""
    return f"'{text}" if text[:1] in "=+-@\t\r" else text
