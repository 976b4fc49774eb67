"""Votes of the studio's own blind tests, by chosen and rejected condition."""

from pathlib import Path

from studio.engine.base.errors import FormatError
from studio.review.blind.desk import Desk
from studio.review.blind.results import results
from studio.review.blind.store import FOLDER

Votes = dict[tuple[str, str], tuple[int, int]]
"""(condition, other) -> number of votes for the condition, and of all choices."""


def read_votes(folder: Path) -> Votes:
    """Return all votes of the blind tests in a folder: `sessions/blind`, or the folder of one test.

    Raises:
        FormatError: no blind test there.
    """
    folder = folder.resolve()
    one = (folder / "test.json").is_file()
    sessions = folder.parent.parent if one else folder.parent
    if (folder.parent if one else folder).name != FOLDER:
        raise FormatError(
            "study.no_blind_tests",
            "{path} holds no blind tests; give sessions/{file}, or the folder of one test",
            path=folder,
            file=FOLDER,
        )
    desk = Desk(sessions)
    tests = [test for test in desk.tests() if not one or test.id == folder.name]
    if not tests:
        raise FormatError(
            "study.no_blind_test", "no blind test in {path}; make one on the operator's page", path=folder
        )
    votes: Votes = {}
    for test in tests:
        for pair in results(test, desk.voters(test.id)).pairs:
            a, b, for_a, for_b = pair.a, pair.b, pair.votes_a, pair.votes_b
            for mine, other, count in ((a, b, for_a), (b, a, for_b)):
                before = votes.get((mine, other), (0, 0))
                votes[mine, other] = (before[0] + count, before[1] + for_a + for_b)
    return votes
