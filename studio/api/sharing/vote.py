"""Routes for a voter's browser: the test without its conditions, animations, votes.

Every route has the test's token in its path, and each voter has a secret. Answers for the two sides of a pair have
the same headers, sizes and names; the assignment of sides is not sent.
"""

import time
from collections import deque
from typing import Annotated

from fastapi import APIRouter, Header, Request
from fastapi.responses import Response
from msgspec import UNSET, Struct, UnsetType, structs
from pydantic import BaseModel, ConfigDict, Field

from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute
from studio.review.blind.desk import Desk, NoSuchTest, TooMany, Voter
from studio.review.blind.draw import showings
from studio.review.blind.model import BlindTest

API_PREFIX = "/api/v1/vote"
MAX_PER_10_S = 60
"""Maximum requests in ten seconds of a voter, or of an address before joining; animations do not count."""

VoterKey = Annotated[
    str, Header(alias="X-Voter", description="the secret that joining answered", max_length=64)
]
_HEADERS = {"Cache-Control": "no-store", "X-Robots-Tag": "noindex", "Referrer-Policy": "no-referrer"}


class _VoteBody(BaseModel):
    model_config = ConfigDict(extra="forbid")


class JoinRequest(_VoteBody):
    """A new voter; the name is optional."""

    name: str = Field("", max_length=60)


class VoteRequest(_VoteBody):
    """A vote on the pair at a place of the voter's order."""

    choice: str = Field(description="left, right or none", max_length=10)
    watched_s: float = Field(0.0, ge=0, le=1e6)
    comment: str = Field("", max_length=1000)


class OwnVote(Struct):
    """A voter's own vote on a pair: `left`, `right` or `none`, and what they wrote."""

    choice: str
    comment: str


class OwnVotes(Struct):
    """A voter's votes by place in their order, and the next place without one; None: they voted on all."""

    votes: dict[str, OwnVote]
    next: int | None


class OpenedTest(Struct):
    """The public part of a test, for everybody with the link, and for a voter `OwnVotes`.

    Attributes:
        pairs: number of pairs that a voter sees, repeats included.
        shown: the place that everybody sees, -1: none yet; None where the test is not supervised.
        open: whether votes are accepted.
    """

    title: str
    question: str
    pairs: int
    allow_none: bool
    ask_name: bool
    supervised: bool
    shown: int | None
    open: bool
    votes: dict[str, OwnVote] | UnsetType = UNSET
    next: int | UnsetType | None = UNSET


class Limiter:
    """Counts requests by client."""

    def __init__(self, most: int = MAX_PER_10_S) -> None:
        self._most = most
        self._times: dict[str, deque[float]] = {}

    def check(self, who: str) -> None:
        """Raise TooMany after too many requests of one client."""
        now = time.monotonic()
        if len(self._times) > 10_000:
            self._times = {
                name: times for name, times in self._times.items() if times and now - times[-1] < 10.0
            }
        times = self._times.setdefault(who, deque(maxlen=self._most))
        if len(times) == self._most and now - times[0] < 10.0:
            raise TooMany("blind.too_many_requests", "too many requests; wait a few seconds")
        times.append(now)


def vote_router(desk: Desk) -> APIRouter:
    """Return the voters' routes."""
    router = APIRouter(tags=["voting"], responses=RESPONSES, route_class=StructRoute)
    limiter, joins = Limiter(), Limiter(300)

    @router.post(API_PREFIX + "/{token}/join", status_code=201)
    def join(token: str, request: JoinRequest, http: Request) -> dict[str, str]:
        """Become a voter; the answer holds the secret for the header `X-Voter`."""
        joins.check(http.client.host if http.client else "")
        return {"voter": desk.join(token, request.name)}

    @router.get(API_PREFIX + "/{token}")
    def get_vote(token: str, response: Response, voter: VoterKey = "") -> OpenedTest:
        """The test, and the voter's own votes so far."""
        response.headers.update(_HEADERS)
        if not voter:
            return _public(desk.by_token(token), desk)
        limiter.check(voter)
        test, known = desk.voter(token, voter)
        own = _own(test, known)
        return structs.replace(_public(test, desk), votes=own.votes, next=own.next)

    @router.get(API_PREFIX + "/{token}/{slot}/{side}", response_class=Response)
    def get_animation(token: str, slot: int, side: str, voter: VoterKey) -> Response:
        """The animation on the `left` or `right` at a place of the voter's order: a GLB file."""
        test, showing = desk.showing(token, voter, slot)
        if side not in ("left", "right"):
            raise NoSuchTest("blind.side", "there is no such side; allowed: left, right")
        which = "a" if (side == "left") == showing.a_left else "b"
        data = desk.animation(test, showing.pair, which)
        return Response(data, media_type="model/gltf-binary", headers=_HEADERS)

    @router.put(API_PREFIX + "/{token}/{slot}")
    def put_vote(token: str, slot: int, request: VoteRequest, voter: VoterKey) -> OwnVotes:
        """Vote, or change a vote; it is stored when this answers. The same vote sent twice counts once."""
        limiter.check(voter)
        desk.vote(
            token, voter, slot, request.choice, watched_s=request.watched_s, comment=request.comment.strip()
        )
        test, known = desk.voter(token, voter)
        return _own(test, known)

    return router


def _public(test: BlindTest, desk: Desk) -> OpenedTest:
    return OpenedTest(
        title=test.title,
        question=test.question,
        pairs=len(test.slots),
        allow_none=test.rules.allow_none,
        ask_name=test.rules.ask_name,
        supervised=test.rules.supervised,
        shown=test.shown if test.rules.supervised else None,
        open=desk.is_open(test),
    )


def _own(test: BlindTest, voter: Voter) -> OwnVotes:
    votes = {str(slot): OwnVote(event.choice, event.comment) for slot, event in sorted(voter.votes.items())}
    count = len(showings(test, voter.number))
    return OwnVotes(votes, next((slot for slot in range(count) if slot not in voter.votes), None))
