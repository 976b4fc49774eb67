"""Performers of a take are named and exchanged in its `take.json`."""

import pytest

from studio.engine.base.errors import TakeError
from studio.engine.model.performers.exchange import Exchange
from studio.take.folder.performers import exchanges_of, shown_name
from studio.take.library.sessions import take_info
from studio.take.library.slate import Slate, change_slate
from tests.refused import refused
from tests.web.playback.takes import take_of_two


@pytest.fixture
def take(tmp_path):
    return take_of_two(tmp_path / "monday" / "fight")


def change(take, **values):
    return change_slate(take.path.parents[1], "monday", "fight", Slate(**values))


def test_a_performer_is_found_by_both_names(take):
    changed = change(take, performer_names={"performer_2": " Ana ", "performer_1": ""})
    assert changed.meta["performer_names"] == {"performer_2": "Ana"}
    assert shown_name(changed.meta, "performer_2") == "Ana"
    assert shown_name(changed.meta, "performer_1") == "performer_1"
    assert changed.performer_folder("studio", "Ana") == changed.performer_folder("studio", "performer_2")
    with refused(TakeError, "take.no_performer"):
        changed.performer_folder("studio", "Bob")
    info = take_info(changed.path)
    assert info.performers == ("performer_1", "performer_2")
    assert info.performer_names == {"performer_2": "Ana"}


def test_exchanges_are_kept_in_the_order_in_which_they_were_made(take):
    made = (Exchange(9.0, ("performer_1", "performer_2")), Exchange(3.5, ("performer_2", "performer_1")))
    assert exchanges_of(change(take, exchanges=made).meta) == made
    assert exchanges_of(change(take, notes="as before").meta) == made
    assert exchanges_of(change(take, exchanges=()).meta) == ()


@pytest.mark.parametrize(
    ("values", "code"),
    [
        ({"performer_names": {"performer_1": "Ana", "performer_2": "ANA"}}, "performers.same_name"),
        ({"performer_names": {"performer_1": "performer_2"}}, "performers.same_name"),
        ({"performer_names": {"somebody": "Ana"}}, "performers.unknown"),
        ({"performer_names": {"performer_1": "a/b"}}, "name.not_allowed"),
        ({"exchanges": (Exchange(1.0, ("performer_1", "performer_1")),)}, "performers.exchange"),
        ({"exchanges": (Exchange(float("nan"), ("performer_1", "performer_2")),)}, "performers.exchange"),
        ({"exchanges": (Exchange(1.0, ("performer_1", "Ana")),)}, "performers.unknown"),
        ({"exchanges": (Exchange(1.0, ("performer_1", "performer_2")),) * 201}, "performers.exchanges"),
    ],
)
def test_what_is_not_allowed_is_told(take, values, code):
    with refused(TakeError, code):
        change(take, **values)
    assert "exchanges" not in take.open(take.path).meta
