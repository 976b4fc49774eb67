"""Routes of blind tests for the operator: make one, hand out its link, close it, read the results."""

from typing import Annotated, Any

import msgspec
from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import PlainTextResponse, Response
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.find import Finder
from studio.api.jobs import Jobs
from studio.api.qr import qr_picture
from studio.api.stage import Request
from studio.api.switches import assignments
from studio.api.work import bake_work, solve_work
from studio.blind import thesis
from studio.blind.desk import Desk
from studio.blind.model import BlindTest, Interpolation, Pair, Rules, Side, check
from studio.blind.results import results, votes_csv
from studio.blind.store import read_key
from studio.engine.errors import SettingsError
from studio.engine.settings import parse_settings
from studio.worker import run_in_process

VOTE_PATH = "/vote"


class SideRequest(Request):
    """One animation of a pair."""

    condition: str = Field(description="what it stands for; voters never see it", examples=["limits on"])
    take: str = Field(examples=["monday/take_001"])
    solve: str = Field(examples=["studio"])
    key_hz: float = Field(0.0, description="keys a second; 0: the solve's", ge=0, le=120)
    interpolation: Interpolation = "linear"


class PairRequest(Request):
    """Two animations over the same part of their takes."""

    a: SideRequest
    b: SideRequest
    start_s: float = Field(0.0, ge=0)
    end_s: float = Field(0.0, ge=0, description="0: to the end, at most a minute")
    title: str = Field("", max_length=100)


class RulesRequest(Request):
    """How a test is voted on."""

    allow_none: bool = Field(False, description="whether 'no preference' may be chosen")
    ask_name: bool = Field(False, description="whether voters may give a name or code")
    repeats: int = Field(2, ge=0, le=100, description="pairs that come twice, sides exchanged")
    max_voters: int = Field(500, ge=1, le=10_000)
    closes: str = Field(
        "", description="ISO 8601 with offset, or empty", examples=["2030-01-31T18:00:00+01:00"]
    )
    supervised: bool = Field(False, description="everybody sees the pair that the operator shows")


class TestRequest(Request):
    """A new test."""

    title: str = Field(examples=["Which settings for the walk?"])
    question: str = thesis.QUESTION
    pairs: list[PairRequest]
    rules: RulesRequest = RulesRequest()


class ThesisRequest(Request):
    """The thesis's own pairs on one take."""

    take: str = Field(examples=["monday/take_001"])
    title: str = "The thesis's pairs"
    start_s: float = Field(0.0, ge=0)
    end_s: float = Field(0.0, ge=0)
    rules: RulesRequest = RulesRequest()


class ShowRequest(Request):
    """What everybody sees in a supervised test."""

    slot: Annotated[int, Field(ge=-1, description="place in the order; -1: nothing yet")]


def blind_router(finder: Finder, jobs: Jobs, desk: Desk) -> APIRouter:
    """Return the operator's routes of blind tests."""
    router = APIRouter(prefix="/api/v1/blind", tags=["blind tests"], responses=RESPONSES)

    def bake(pairs: tuple[Pair, ...]) -> list[tuple[bytes, bytes]]:
        work = []
        for pair in pairs:
            opened = [finder.take(*side.take.split("/", 1)) for side in (pair.a, pair.b)]
            files = [
                finder.solve(take, side.solve) for take, side in zip(opened, (pair.a, pair.b), strict=True)
            ]
            work.append((files, [take.path for take in opened], msgspec.to_builtins(pair)))
        return run_in_process(bake_work, work)

    def create(title: str, question: str, pairs: tuple[Pair, ...], rules: RulesRequest) -> dict[str, Any]:
        return _line(desk.create(title, question, pairs, Rules(**rules.model_dump()), bake), desk)

    @router.get("")
    def get_tests() -> dict[str, Any]:
        """All tests, the newest first, and what cannot be read."""
        return {"tests": [_line(test, desk) for test in reversed(desk.tests())], "problems": desk.problems}

    @router.post("", status_code=201)
    def add_test(request: TestRequest) -> dict[str, Any]:
        """Make a test. Its animations are made now: later solves or deletions do not touch it."""
        for pair in request.pairs:
            for side in (pair.a, pair.b):
                if side.take.count("/") != 1:
                    raise SettingsError(f"take={side.take!r} is not allowed; allowed: session/name")
        pairs = tuple(_pair(pair) for pair in request.pairs)
        return create(request.title, request.question, pairs, request.rules)

    @router.post("/thesis", status_code=202)
    def add_thesis_test(request: ThesisRequest) -> dict[str, Any]:
        """Solve a take in the ways that the thesis compared, then make a test of its pairs; answers the jobs."""
        if request.take.count("/") != 1:
            raise SettingsError(f"take={request.take!r} is not allowed; allowed: session/name")
        take = finder.take(*request.take.split("/", 1))
        pairs = thesis.pairs(request.take, start_s=request.start_s, end_s=request.end_s)
        check(request.title, thesis.QUESTION, pairs, Rules(**request.rules.model_dump()))
        wanted = thesis.solves(tuple(take.calibration().cameras))
        made = [
            jobs.submit(
                "solve",
                request.take,
                name,
                solve_work,
                take.path,
                parse_settings(one.preset, assignments(one.changes)).to_json(),
                name,
                False,
            )
            for name, one in wanted.items()
            if name not in take.solve_names()
        ]
        last = jobs.call(
            "blind test",
            request.take,
            request.title,
            lambda: create(request.title, thesis.QUESTION, pairs, request.rules),
        )
        return {"jobs": [jobs.get(job.id) for job in (*made, last)]}

    @router.get("/{test}")
    def get_test(test: str) -> dict[str, Any]:
        """One test: pairs, rules, link, how many voted."""
        return _line(desk.test(test), desk)

    @router.get("/{test}/results")
    def get_results(test: str) -> dict[str, Any]:
        """Votes by pair with shares, intervals and p-values; ranking, side bias, consistency, comments."""
        return results(desk.test(test), desk.voters(test))

    @router.get("/{test}/votes.csv", response_class=PlainTextResponse)
    def get_votes(test: str) -> PlainTextResponse:
        """Every vote as CSV."""
        return PlainTextResponse(votes_csv(desk.test(test), desk.voters(test)), media_type="text/csv")

    @router.get("/{test}/key")
    def get_key(test: str) -> dict[str, Any]:
        """Which animation is which, with hashes, and whether the seal of the beginning still holds."""
        return read_key(finder.sessions, desk.test(test))

    @router.get("/{test}/qr", response_class=Response)
    def get_qr(test: str, http: HttpRequest) -> Response:
        """The voters' link as a QR code, an SVG picture; the host is the one that this was asked of."""
        found = desk.test(test)
        if not found.token:
            raise SettingsError("this test has no link; make a new one first")
        return qr_picture(str(http.base_url).rstrip("/") + f"{VOTE_PATH}/{found.token}")

    @router.post("/{test}/close")
    def close_test(test: str) -> dict[str, Any]:
        """Take no more votes."""
        return _line(desk.close(test), desk)

    @router.post("/{test}/reopen")
    def reopen_test(test: str) -> dict[str, Any]:
        """Take votes again."""
        return _line(desk.reopen(test), desk)

    @router.post("/{test}/link")
    def renew_link(test: str) -> dict[str, Any]:
        """Make a new link; the old one leads nowhere from now on."""
        return _line(desk.renew_link(test), desk)

    @router.delete("/{test}/link")
    def revoke_link(test: str) -> dict[str, Any]:
        """Take the link away; votes stay."""
        return _line(desk.revoke_link(test), desk)

    @router.put("/{test}/shown")
    def show_slot(test: str, request: ShowRequest) -> dict[str, Any]:
        """Show everybody a pair of a supervised test."""
        return _line(desk.show(test, request.slot), desk)

    return router


def _pair(request: PairRequest) -> Pair:
    return Pair(
        a=Side(**request.a.model_dump()),
        b=Side(**request.b.model_dump()),
        start_s=request.start_s,
        end_s=request.end_s,
        title=request.title,
    )


def _line(test: BlindTest, desk: Desk) -> dict[str, Any]:
    """A test as the operator sees it."""
    voters = desk.voters(test.id)
    return {
        **msgspec.to_builtins(test),
        "open": desk.is_open(test),
        "path": f"{VOTE_PATH}/{test.token}" if test.token else "",
        "voters": len(voters),
        "votes": sum(len(voter.votes) for voter in voters),
        "slots": len(test.slots),
    }
