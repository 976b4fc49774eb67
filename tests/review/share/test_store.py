"""Links to replays: kept, listed, opened only by their secret, revoked."""

from datetime import UTC, datetime, timedelta

import pytest

from studio.engine.base.errors import TakeError
from studio.review.share.store import NoSuchShare, Shares
from tests.refused import refused


def add(shares: Shares, title: str = "Walk"):
    return shares.add(b"<p>", title=title, take="monday/one", solve="studio", start_s=None, end_s=2.0)


def test_a_link_opens_its_file_and_survives_a_restart(tmp_path) -> None:
    share = add(Shares(tmp_path))
    again = Shares(tmp_path)
    assert again.list() == [share] and again.by_token(share.token) == share
    assert again.page(share) == b"<p>" and share.size_bytes == 3


def test_secrets_differ_and_cannot_be_guessed_from_the_id(tmp_path) -> None:
    shares = Shares(tmp_path)
    made = [add(shares) for _ in range(20)]
    assert len({share.token for share in made}) == 20 and all(len(share.token) >= 32 for share in made)
    for wrong in ("", made[0].id, made[0].token[:-1], made[0].token + "x", "ü"):
        with pytest.raises(NoSuchShare):
            shares.by_token(wrong)


def test_a_link_that_is_taken_back_leads_nowhere(tmp_path) -> None:
    shares = Shares(tmp_path)
    kept, gone = add(shares), add(shares)
    shares.remove(gone.id)
    assert shares.list() == [kept]
    with pytest.raises(NoSuchShare):
        shares.by_token(gone.token)
    with pytest.raises(NoSuchShare):
        shares.remove(gone.id)
    with pytest.raises(NoSuchShare):
        shares.restore(kept.id)
    assert shares.restore(gone.id) == shares.by_token(gone.token) == gone


def test_what_was_taken_back_is_deleted_after_a_day(tmp_path) -> None:
    clock = [datetime(2030, 1, 1, tzinfo=UTC)]
    shares = Shares(tmp_path, now=lambda: clock[0])
    gone = add(shares)
    shares.remove(gone.id)
    clock[0] += timedelta(hours=23)
    add(shares)
    assert (tmp_path / "shares" / f"{gone.id}.html").exists()
    clock[0] += timedelta(hours=2)
    add(shares)
    assert not (tmp_path / "shares" / f"{gone.id}.html").exists()
    with pytest.raises(NoSuchShare):
        shares.restore(gone.id)


def test_the_same_is_found_again_unless_the_solve_is_newer(tmp_path) -> None:
    shares = Shares(tmp_path)
    solved = datetime.now(UTC)
    share = add(shares)
    made = datetime.fromisoformat(share.created)
    what = {"title": "Walk", "take": "monday/one", "solve": "studio", "start_s": None, "end_s": 2.0}
    assert shares.same(**what, since=solved) == share  # even if both were made within a second
    assert shares.same(**what, since=made) == share
    assert shares.same(**what, since=made + timedelta(seconds=1)) is None
    assert shares.same(**{**what, "end_s": None}, since=made) is None


def test_what_is_damaged_is_passed_over_and_names_stay_inside(tmp_path) -> None:
    shares = Shares(tmp_path)
    share = add(shares)
    (tmp_path / "shares" / "broken.json").write_text('{"id": 1}')
    (tmp_path / "shares" / "foreign.json").write_text("[")
    assert shares.list() == [share]
    (tmp_path / "shares" / f"{share.id}.html").unlink()
    with refused(NoSuchShare, "share.gone"):
        shares.page(share)
    with pytest.raises((NoSuchShare, TakeError)):
        shares.remove("../" + share.id)
