"""`studio splice` makes a take of parts of others."""

import json

import pytest

from studio.engine.model.poses import Poses
from studio.take.folder.take import Take
from tests.commands.program import one_line, studio
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def take(tmp_path):
    return take_with_solves(tmp_path / "monday" / "walk")


def test_parts_become_a_take_that_remembers_them(take, tmp_path):
    out, file = tmp_path / "monday" / "cut", tmp_path / "parts.json"
    words = (f"{take.path}@0.1-1", str(take.path), "--blend", "0.3", "--near", "0", "--times", "2")
    done = studio("splice", *words, "--out", out, "--json", file, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    made = Take.open(out)
    assert (made.meta["source"], made.solve_names()) == ("splice", ["spliced"])
    parts = made.meta.get("parts", [])
    assert [one["take"] for one in parts] == ["monday/walk"] * 4
    assert (parts[0]["start_s"], parts[0]["end_s"]) == pytest.approx((0.1, 1.0), abs=0.02)
    assert json.loads(file.read_text())["parts"] == parts
    lasts_s = sum(one["end_s"] - one["start_s"] for one in parts) - 3 * 0.3
    assert Poses.load(out / "solves" / "spliced" / "poses.npz").time_s[-1] == pytest.approx(lasts_s, abs=0.1)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("nowhere",), 1),
        (("walk@5-", "walk"), 2),
        (("walk", "--blend", "99"), 2),
        (("walk", "--times", "0"), 2),
    ],
)
def test_what_is_wrong_is_told_in_one_line(take, tmp_path, words, code):
    out = tmp_path / "cut"
    one_line(studio("splice", *words, "--out", out, cwd=take.path.parent), code)
    assert not out.exists()
