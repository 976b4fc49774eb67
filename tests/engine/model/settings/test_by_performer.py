"""Switches of single performers."""

import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.model.settings.settings import SolveSettings, parse_settings
from tests.refused import refused

DIFFERS = ["performer_2.smoothing=one_euro:before", "performer_2.effectors.left_hand.reach=0.5", "hands=off"]


def test_one_performer_s_settings_leave_the_others_as_they_are():
    settings = parse_settings("finish", DIFFERS)
    first, second = (settings.of_performer(name) for name in ("performer_1", "performer_2"))
    assert first == parse_settings("finish", ["hands=off"])
    assert second == parse_settings("finish", [text.removeprefix("performer_2.") for text in DIFFERS])
    assert SolveSettings.from_json(settings.to_json()) == settings
    again = parse_settings("finish", [f"{key}={text}" for key, text in settings.texts_by_joint().items()])
    assert again.performers == settings.performers


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("performer_2.smoothing=thick", "settings.value"),
        ("performer_2.output_hz=30", "settings.of_performer"),
        ("performer_2.performers=1", "settings.of_performer"),
        ("performer_2=1", "settings.of_performer"),
        ("performer_x.smoothing=none", "settings.unknown_part"),
        ("performers=1", "settings.by_joint"),
    ],
)
def test_what_cannot_differ_is_refused(text, code):
    with pytest.raises(SettingsError) as error:
        parse_settings("studio", [text])
    assert error.value.code == code


def test_a_performer_who_is_not_there_is_told():
    settings = parse_settings("studio", ["performer_3.hands=off"])
    with refused(SettingsError, "settings.unknown_performer"):
        settings.check_performers(["performer_1", "performer_2"])
