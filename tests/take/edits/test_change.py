"""Edits of a take are added, changed, removed, undone and redone, by several users at once."""

import threading

import msgspec
import pytest

from studio.engine.base.errors import TakeError
from studio.engine.edits.edit import PinEdit
from studio.take.edits.change import MOST_UNDONE, StaleEditsError, change_edits, redo_edits, undo_edits
from studio.take.edits.kept import read_edits
from tests.refused import refused
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def take(tmp_path):
    return take_with_solves(tmp_path / "monday" / "walk")


def pin(id_="", **values):
    return PinEdit(id=id_, start_s=0.5, end_s=0.5, joint="left_wrist", place_m=(0.0, 0.0, 1.0), **values)


def ids(kept):
    return [one.id for one in kept.edits]


def test_a_new_edit_gets_an_id_of_its_own(take):
    assert ids(change_edits(take, [pin(), pin()])) == ["e1", "e2"]
    change_edits(take, remove=["e2"])
    assert ids(change_edits(take, [pin()])) == ["e1", "e3"]


def test_changes_are_taken_back_and_made_again_in_their_order(take):
    states = [read_edits(take).edits]
    for change in (
        lambda: change_edits(take, [pin("a"), pin("b"), pin("c")]),
        lambda: change_edits(take, [pin("b", note="here")]),
        lambda: change_edits(take, [pin("d")], ["a", "c"]),
        lambda: change_edits(take, [pin("b", on=False)]),
    ):
        states.append(change().edits)
    for state in states[-2::-1]:
        assert undo_edits(take).edits == state
    with refused(TakeError, "edits.nothing_to_undo"):
        undo_edits(take)
    for state in states[1:]:
        assert redo_edits(take).edits == state
    with refused(TakeError, "edits.nothing_to_redo"):
        redo_edits(take)
    undo_edits(take)
    change_edits(take, [pin("e")])
    with refused(TakeError, "edits.nothing_to_redo"):
        redo_edits(take)
    assert read_edits(take).revision == 4 + 4 + 4 + 2


def test_a_change_that_changes_nothing_is_none(take):
    kept = change_edits(take, [pin("a")])
    assert change_edits(take, [pin("a")]) == kept
    assert change_edits(take) == kept


def test_only_the_last_changes_are_kept_for_undo(take):
    for k in range(MOST_UNDONE + 3):
        change_edits(take, [pin("a", note=str(k))])
    assert len(read_edits(take).undo) == MOST_UNDONE


def test_what_another_has_changed_is_not_overwritten(take):
    seen = change_edits(take, [pin("a"), pin("b")]).revision
    other = change_edits(take, [pin("a", note="mine")], revision=seen)
    with refused(StaleEditsError, "edits.stale_edit"):
        change_edits(take, [pin("a", note="yours")], revision=seen)
    with refused(StaleEditsError, "edits.stale_edit"):
        change_edits(take, remove=["a"], revision=seen)
    with refused(StaleEditsError, "edits.stale"):
        undo_edits(take, revision=seen)
    both = change_edits(take, [pin("b", note="yours"), pin("c")], revision=seen)  # other edits
    assert [one.note for one in both.edits] == ["mine", "yours", ""]
    assert undo_edits(take, revision=both.revision).edits == other.edits


def test_no_such_edit(take):
    with refused(TakeError, "edits.none"):
        change_edits(take, remove=["a"])


def test_many_at_once_lose_nothing(take):
    """Programs and threads wait for one another."""
    threads = [threading.Thread(target=lambda k=k: change_edits(take, [pin(f"p{k}")])) for k in range(12)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    kept = read_edits(take)
    assert (sorted(ids(kept)), kept.revision) == (sorted(f"p{k}" for k in range(12)), 12)
    assert msgspec.structs.replace(kept) == read_edits(take)
