"""Votes of blind tests as the study reads them, and the decisions that follow."""

from studio.engine.base.errors import FormatError
from studio.lab.study.decision import decisions
from studio.lab.study.results import Results
from studio.lab.study.votes import read_votes
from studio.review.blind.desk import Desk
from studio.review.blind.model import Pair, Rules, Side
from tests.lab.study.test_study import cell_of
from tests.refused import refused


def test_votes_by_condition(tmp_path):
    desk = Desk(tmp_path / "sessions")
    pair = Pair(a=Side("limits off", "s/t", "a"), b=Side("limits on", "s/t", "b"), title="limits")
    test = desk.create(
        "T", "Which?", (pair,), Rules(repeats=0), bake=lambda pairs: [(b"a", b"b") for _ in pairs]
    )
    for _ in range(3):
        desk.vote(test.token, desk.join(test.token), 0, "left", watched_s=1.0)
    folder = tmp_path / "sessions" / "blind"
    votes = read_votes(folder)
    assert read_votes(folder / test.id) == votes
    assert votes["limits on", "limits off"][1] == 3
    assert sum(count for count, _ in votes.values()) == 3
    with refused(FormatError, "study.no_blind_tests"):
        read_votes(tmp_path)


def test_a_component_needs_its_votes():
    cells = [cell_of("previous_pose", 1, seed, 10 + 0.1 * seed) for seed in range(5)]
    cells += [cell_of("limits_relax", 1, seed, 8 + 0.1 * seed) for seed in range(5)]

    def kept(votes):
        rows = decisions(Results(cells), votes)
        return next(row["kept"] for row in rows if row["component"] == "human limits and relax pose")

    assert kept({}) == "yes"
    assert kept({("limits on", "limits off"): (30, 66)}) == "no"
    assert kept({("limits on", "limits off"): (34, 66)}) == "yes"
