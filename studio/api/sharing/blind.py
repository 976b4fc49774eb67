"""Routes of blind tests for the operator: make one, share its link, close it, read the results."""

from typing import Annotated

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import PlainTextResponse, Response
from msgspec import Struct, field, structs
from pydantic import Field

from studio.api.address import address_for_others
from studio.api.cameras.qr import qr_picture
from studio.api.errors import RESPONSES
from studio.api.jobs import Jobs, JobStatus
from studio.api.stage.stage import Request
from studio.api.stage.switches import assignments
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_setting
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.settings.settings import parse_settings
from studio.review.blind import thesis
from studio.review.blind.desk import Desk
from studio.review.blind.model import BlindTest, Interpolation, Pair, Rules, Side, check
from studio.review.blind.results import BlindResults, results, votes_csv
from studio.review.blind.store import OpenedKey, read_key
from studio.take.folder.take import Take
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
    """Rules of a test's vote."""

    allow_none: bool = Field(default=False, description="whether 'no preference' may be chosen")
    ask_name: bool = Field(default=False, description="whether voters may give a name or code")
    repeats: int = Field(default=2, ge=0, le=100, description="pairs that come twice, sides exchanged")
    max_voters: int = Field(default=500, ge=1, le=10_000)
    closes: str = Field(
        default="", description="ISO 8601 with offset, or empty", examples=["2030-01-31T18:00:00+01:00"]
    )
    supervised: bool = Field(default=False, description="everybody sees the pair that the operator shows")
    body: str = Field(default=BODIES[0], description=f"both sides' body: {', '.join(BODIES)}")


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
    """The slot to show in a supervised test."""

    slot: Annotated[int, Field(ge=-1, description="place in the order; -1: nothing yet")]


class ListedTest(BlindTest, frozen=True, kw_only=True):
    """A test as shown to the operator: whether it is open, the path of its link or empty, the numbers of voters, of
    their votes, and of the slots of each voter."""

    open: bool
    path: str
    voters: int
    votes: int
    slot_count: int = field(name="slots")


class ListedTests(Struct):
    """All tests, the newest first, and a sentence for each that cannot be read."""

    tests: list[ListedTest]
    problems: list[str]


def blind_router(finder: Finder, jobs: Jobs, desk: Desk) -> APIRouter:
    """Return the operator's routes of blind tests."""
    router = APIRouter(
        prefix="/api/v1/blind", tags=["blind tests"], responses=RESPONSES, route_class=StructRoute
    )

    def bake(pairs: tuple[Pair, ...], body: str) -> list[tuple[bytes, bytes]]:
        def take_of(side: Side) -> Take:
            take = finder.take(*side.take.split("/", 1))
            finder.solve(take, side.solve)
            return take

        work = [(pair, take_of(pair.a), take_of(pair.b)) for pair in pairs]
        return run_in_process("studio.review.blind.bake:bake_pairs", work, body)

    def create(title: str, question: str, pairs: tuple[Pair, ...], rules: RulesRequest) -> ListedTest:
        made = desk.create(
            title, question, pairs, Rules(**rules.model_dump()), lambda wanted: bake(wanted, rules.body)
        )
        return _line(made, desk)

    @router.get("")
    def get_tests() -> ListedTests:
        """All tests, the newest first, and those that cannot be read."""
        return ListedTests([_line(test, desk) for test in reversed(desk.tests())], desk.problems)

    @router.post("", status_code=201)
    def add_test(request: TestRequest) -> ListedTest:
        """Make a test. Its animations are made now, so later solves or deletions do not change it."""
        for pair in request.pairs:
            for side in (pair.a, pair.b):
                if side.take.count("/") != 1:
                    raise SettingsError(bad_setting("take", side.take, "session/name"))
        pairs = tuple(_pair(pair) for pair in request.pairs)
        return create(request.title, request.question, pairs, request.rules)

    @router.post("/thesis", status_code=202)
    def add_thesis_test(request: ThesisRequest) -> dict[str, list[JobStatus]]:
        """Solve a take in the ways that the thesis compared, then make a test of its pairs; answers the jobs."""
        if request.take.count("/") != 1:
            raise SettingsError(bad_setting("take", request.take, "session/name"))
        take = finder.take(*request.take.split("/", 1))
        pairs = thesis.pairs(request.take, start_s=request.start_s, end_s=request.end_s)
        check(request.title, thesis.QUESTION, pairs, Rules(**request.rules.model_dump()))
        wanted = thesis.solves(tuple(take.calibration().cameras))
        made = [
            jobs.submit(
                "solve",
                request.take,
                name,
                "studio.offline.replay:solve_take",
                take,
                parse_settings(one.preset, assignments(one.changes)),
                name=name,
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
    def get_test(test: str) -> ListedTest:
        """One test: pairs, rules, link, number of voters."""
        return _line(desk.test(test), desk)

    @router.get("/{test}/results")
    def get_results(test: str) -> BlindResults:
        """Votes by pair with shares, intervals and p-values; ranking, side bias, consistency, comments."""
        return results(desk.test(test), desk.voters(test))

    @router.get("/{test}/votes.csv", response_class=PlainTextResponse)
    def get_votes(test: str) -> PlainTextResponse:
        """Every vote as CSV."""
        return PlainTextResponse(votes_csv(desk.test(test), desk.voters(test)), media_type="text/csv")

    @router.get("/{test}/key")
    def get_key(test: str) -> OpenedKey:
        """The key of the animations, with hashes, and whether it still matches the seal."""
        return read_key(finder.sessions, desk.test(test))

    @router.get("/{test}/qr", response_class=Response)
    def get_qr(test: str, http: HttpRequest) -> Response:
        """The voters' link as a QR code, an SVG picture; at the address that other machines reach."""
        found = desk.test(test)
        if not found.token:
            raise SettingsError("blind.no_link", "this test has no link; make a new one first")
        return qr_picture(address_for_others(http).url + f"{VOTE_PATH}/{found.token}")

    @router.post("/{test}/close")
    def close_test(test: str) -> ListedTest:
        """Close a test for votes."""
        return _line(desk.close(test), desk)

    @router.post("/{test}/reopen")
    def reopen_test(test: str) -> ListedTest:
        """Open a test for votes again."""
        return _line(desk.reopen(test), desk)

    @router.post("/{test}/link")
    def renew_link(test: str) -> ListedTest:
        """Make a new link; the old one becomes invalid."""
        return _line(desk.renew_link(test), desk)

    @router.delete("/{test}/link")
    def revoke_link(test: str) -> ListedTest:
        """Delete the link; votes stay."""
        return _line(desk.revoke_link(test), desk)

    @router.put("/{test}/shown")
    def show_slot(test: str, request: ShowRequest) -> ListedTest:
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


def _line(test: BlindTest, desk: Desk) -> ListedTest:
    voters = desk.voters(test.id)
    return ListedTest(
        **structs.asdict(test),
        open=desk.is_open(test),
        path=f"{VOTE_PATH}/{test.token}" if test.token else "",
        voters=len(voters),
        votes=sum(len(voter.votes) for voter in voters),
        slot_count=len(test.slots),
    )
