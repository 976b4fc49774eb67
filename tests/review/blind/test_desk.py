"""The desk: votes are kept, changed, resumed after a restart; links are revoked; wrong requests are refused."""

from datetime import timedelta

import pytest

from studio.engine.base.errors import SettingsError, TakeError
from studio.review.blind import store
from studio.review.blind.desk import Desk, NoSuchTest, VotingClosed
from studio.review.blind.draw import showings
from studio.review.blind.model import Rules
from studio.review.blind.results import results, votes_csv
from tests.refused import refused
from tests.review.blind.tests_made import Now, bake, made, pairs


def vote_for(desk: Desk, token: str, key: str, condition: str) -> None:
    """Vote for a condition on every slot."""
    test, voter = desk.voter(token, key)
    for slot, shown in enumerate(showings(test, voter.number)):
        pair = test.pairs[shown.pair]
        a_wanted = pair.a.condition == condition
        desk.vote(token, key, slot, "left" if a_wanted == shown.a_left else "right", watched_s=4.0)


def test_votes_survive_a_restart_and_a_line_cut_off(tmp_path) -> None:
    desk, test = made(tmp_path)
    keys = [desk.join(test.token) for _ in range(3)]
    for key in keys:
        vote_for(desk, test.token, key, "on")
    file = store.folder_of(tmp_path, test.id) / "votes.jsonl"
    file.write_bytes(file.read_bytes() + b'{"voter": 1, "at": "2026')  # the power went
    again = Desk(tmp_path, now=Now())
    again.vote(test.token, keys[0], 0, "left")
    once_more = Desk(tmp_path, now=Now())
    assert len(once_more.voters(test.id)) == 3
    _, voter = once_more.voter(test.token, keys[0])
    assert voter.votes[0].choice == "left" and len(voter.votes) == len(test.slots)


def test_a_vote_is_changed_not_doubled(tmp_path) -> None:
    desk, test = made(tmp_path, repeats=0)
    key = desk.join(test.token)
    for choice in ("left", "left", "right"):
        desk.vote(test.token, key, 2, choice)
    found = results(test, desk.voters(test.id))
    assert found.votes == 1 and sum(pair.votes_a + pair.votes_b for pair in found.pairs) == 1


def test_results_name_conditions_and_consistency(tmp_path) -> None:
    desk, test = made(tmp_path, repeats=2)
    for number in range(10):
        key = desk.join(test.token)
        vote_for(desk, test.token, key, "on" if number < 8 else "off")
    found = results(test, desk.voters(test.id))
    assert found.finished == 10 and found.consistency.share == 1.0
    for pair in found.pairs:
        assert (pair.votes_a, pair.votes_b) == (2, 8) and pair.share == 0.2
        assert pair.p_holm >= pair.p_value
    assert len(votes_csv(test, desk.voters(test.id)).splitlines()) == 1 + 10 * 8


def test_formulas_in_comments_are_texts_in_the_csv(tmp_path) -> None:
    desk, test = made(tmp_path)
    key = desk.join(test.token)
    desk.vote(test.token, key, 0, "left", comment="=HYPERLINK(1)")
    assert "'=HYPERLINK(1)" in votes_csv(test, desk.voters(test.id))


def test_links_secrets_and_closing(tmp_path) -> None:
    now = Now()
    desk, test = made(tmp_path, now=now, closes="2026-01-02T00:00:00+00:00", max_voters=2)
    key = desk.join(test.token)
    desk.join(test.token)
    with pytest.raises(VotingClosed):
        desk.join(test.token)
    for token, secret in (("", key), ("wrong", key), (test.token, "wrong"), (test.token, "")):
        with pytest.raises(NoSuchTest):
            desk.vote(token, secret, 0, "left")
    renewed = desk.renew_link(test.id)
    with pytest.raises(NoSuchTest):
        desk.vote(test.token, key, 0, "left")
    desk.vote(renewed.token, key, 0, "left")
    desk.close(test.id)
    with pytest.raises(VotingClosed):
        desk.vote(renewed.token, key, 1, "left")
    desk.reopen(test.id)
    now.time += timedelta(days=1)
    with pytest.raises(VotingClosed):
        desk.vote(renewed.token, key, 1, "left")
    desk.revoke_link(test.id)
    with pytest.raises(NoSuchTest):
        desk.by_token("")


@pytest.mark.parametrize(
    ("slot", "choice", "comment"),
    [(-1, "left", ""), (99, "left", ""), (0, "none", ""), (0, "a", ""), (0, "left", "x" * 1001)],
)
def test_votes_that_are_not_allowed(tmp_path, slot: int, choice: str, comment: str) -> None:
    desk, test = made(tmp_path)
    key = desk.join(test.token)
    with pytest.raises(SettingsError):
        desk.vote(test.token, key, slot, choice, comment=comment)
    assert results(test, desk.voters(test.id)).votes == 0


def test_the_seal_holds_until_somebody_changes_the_key(tmp_path) -> None:
    desk, test = made(tmp_path)
    assert store.read_key(tmp_path, test).seal_holds
    assert desk.animation(test, 0, "a") == bake(test.pairs)[0][0]
    folder = store.folder_of(tmp_path, test.id)
    (folder / "key.json").write_text((folder / "key.json").read_text().replace("on_1", "on_2"))
    assert not store.read_key(tmp_path, test).seal_holds
    (folder / "animations/1_b.glb").write_bytes(b"another")
    with refused(TakeError, "blind.animation_changed"):
        desk.animation(test, 1, "b")


@pytest.mark.parametrize(
    "rules", [{"repeats": 7}, {"max_voters": 0}, {"closes": "tomorrow"}, {"closes": "2030-01-01"}]
)
def test_rules_that_make_no_sense(tmp_path, rules: dict) -> None:
    with refused(SettingsError, *(f"blind.{rule}" for rule in rules)):
        made(tmp_path, **rules)
    assert not (tmp_path / "blind").exists()


def test_a_test_without_pairs_or_with_two_of_a_kind(tmp_path) -> None:
    desk = Desk(tmp_path, now=Now())
    same = pairs(1)[0]
    for wrong in ((), (type(same)(a=same.a, b=same.a),)):
        with pytest.raises(SettingsError):
            desk.create("t", "q", wrong, Rules(repeats=0), bake)


def test_an_animation_that_cannot_be_made_leaves_nothing(tmp_path) -> None:
    def fail(_pairs) -> list[tuple[bytes, bytes]]:
        raise TakeError("no such solve")

    with pytest.raises(TakeError):
        Desk(tmp_path, now=Now()).create("t", "q", pairs(2), Rules(), fail)
    assert not (tmp_path / "blind").exists()


def test_a_damaged_test_is_told_and_the_others_work(tmp_path) -> None:
    _, test = made(tmp_path)
    broken = tmp_path / "blind" / "test_x"
    broken.mkdir()
    (broken / "test.json").write_text("{")
    desk = Desk(tmp_path, now=Now())
    assert [one.id for one in desk.tests()] == [test.id] and "test_x" in desk.problems[0]


def test_a_room_follows_the_operator(tmp_path) -> None:
    desk, test = made(tmp_path, supervised=True)
    assert desk.show(test.id, 3).shown == 3
    with pytest.raises(SettingsError):
        desk.show(test.id, 99)
    other, alone = made(tmp_path / "other")
    with refused(SettingsError, "blind.not_supervised"):
        other.show(alone.id, 0)
