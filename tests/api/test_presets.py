"""Saved presets: kept over a restart, used by live settings and solves, renamed, removed and put back."""

from collections.abc import Callable
from pathlib import Path

import pytest

from studio.engine.base.errors import SettingsError
from studio.take.library.presets import FILE, Presets
from tests.api.conftest import Studio
from tests.refused import refused


def test_a_preset_is_saved_used_renamed_and_removed(
    start_studio: Callable[..., Studio], tmp_path: Path
) -> None:
    http = start_studio(tmp_path).http
    wanted = {"preset": "studio", "set": {"smoothing": "one_euro:after", "effectors.left_hand.reach": "0.9"}}
    saved = http.put("/presets/sword fight", json=wanted)
    assert saved.json() == {"name": "sword fight", **wanted}
    catalogue = http.get("/switches").json()
    assert catalogue["saved"] == ["sword fight"]
    assert catalogue["presets"]["sword fight"]["smoothing"] == "one_euro:after"
    live = http.put("/settings", json={"preset": "sword fight", "set": {"hands": "off"}}).json()
    assert (live["preset"], live["set"]) == ("sword fight", {"hands": "off"})
    assert http.patch("/presets/sword fight", json={"name": "duel"}).json()["name"] == "duel"
    assert [preset["name"] for preset in http.get("/presets").json()] == ["duel"]
    gone = http.delete("/presets/duel").json()
    assert http.get("/presets").json() == []
    assert http.delete("/presets/duel").status_code == 404
    again = http.put("/presets/duel", json={"preset": gone["preset"], "set": gone["set"]})
    assert again.json() == {"name": "duel", **wanted}
    assert Presets(tmp_path).settings("duel", ["hands=off"]).smoothing == "one_euro:after"


@pytest.mark.parametrize("name", ["studio", "..", "a/b", " "])
def test_a_name_that_is_not_allowed_is_refused(tmp_path: Path, name: str) -> None:
    with refused(SettingsError, "preset.own_name", "settings.preset_name"):
        Presets(tmp_path).save(name, Presets(tmp_path).settings("raw"))


def test_unknown_presets_list_what_there_is(tmp_path: Path) -> None:
    presets = Presets(tmp_path)
    presets.save("mine", presets.settings("raw"))
    with refused(
        SettingsError, "settings.unknown_preset", allowed=["raw", "thesis", "studio", "finish", "mine"]
    ):
        presets.settings("yours")
    with refused(SettingsError, "preset.own"):
        presets.remove("studio")
    with refused(SettingsError, "preset.taken"):
        presets.save("other", presets.settings("raw"))
        presets.rename("other", "mine")


def test_a_damaged_file_is_said_and_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("{")
    with refused(SettingsError, "settings.presets_unreadable"):
        Presets(tmp_path).save("mine", Presets(tmp_path).settings("raw"))
    assert (tmp_path / FILE).read_text() == "{"
