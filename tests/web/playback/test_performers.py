"""Replay of a take of several performers: all are shown, one has the curves, and doubt is told."""

import numpy as np
import pytest

from studio.engine.base.errors import TakeError
from studio.web.playback.clip import Clip
from studio.web.playback.curves import curves
from studio.web.playback.player import Player
from studio.web.playback.second import Second
from tests.refused import refused
from tests.web.playback.takes import DOUBT_S, FRAMES, LATE_S, take_of_two

LATE = round(LATE_S * 60)


@pytest.fixture
def take(tmp_path):
    return take_of_two(tmp_path / "monday" / "fight", solves=("studio", "other"))


def test_everybody_who_is_there_is_in_a_frame(take):
    clip = Clip.load(take, "studio")
    assert clip.poses.frame_count == FRAMES
    before, after = clip.step(LATE - 1), clip.step(LATE)
    assert [one.performer for one in before.each()] == [1]
    assert [one.performer for one in after.each()] == [1, 2]
    assert {number: len(trail) for number, trail in clip.trails(LATE + 9, 90).items()} == {
        1: LATE + 10,
        2: 10,
    }


def test_one_of_them_has_the_curves(take):
    take.meta["performer_names"] = {"performer_2": "Ana"}
    take.save_meta()
    clip = Clip.load(take, "studio", "Ana")
    assert clip.performer == "performer_2" and clip.poses.frame_count == FRAMES
    assert [one.performer for one in clip.step(0).each()] == [1]  # the one of the curves is not there yet
    assert [one.performer for one in clip.step(LATE).each()] == [2, 1]
    found = curves(clip, "LeftHand")
    assert found.away == [(0, LATE - 1)]
    span = tuple(round(part * 60) for part in DOUBT_S)
    assert found.undecided == {"performer_1": [], "Ana": [span]}
    assert all(first >= LATE for first, _ in found.stance["left"] + found.stance["right"])
    with refused(TakeError, "take.no_performer"):
        Clip.load(take, "studio", "Bob")


def test_the_second_figure_has_everybody_too(take):
    clip = Clip.load(take, "studio", "performer_2")
    beside = Second.solve(Clip.load(take, "other").chosen("performer_2"), clip)
    step = beside.step(float(clip.poses.time_s[LATE + 5]))
    assert [one.performer for one in step.each()] == [2, 1]
    for mine, other in zip(clip.step(LATE + 5).each(), step.each(), strict=True):
        assert np.allclose(mine.positions_m, other.positions_m)


class Screen:
    def show_replay(self, result, ghost, trails, calibration, depth, names, robots) -> None:
        pass

    def show_live(self) -> None:
        pass


def test_the_status_says_who_there_is(take):
    player = Player(Screen())
    try:
        player.open(Clip.load(take, "studio"))
        player.change(frame=50)
        player.open(Clip.load(take, "studio", "performer_2"))
        status = player.status()
        assert status.performer == "performer_2" and status.frame == 50
        assert [one.performer for one in status.performers] == ["performer_1", "performer_2"]
        assert len({one.colour for one in status.performers}) == 2
        assert len(player.space_m()) > 0 and np.ptp(player.space_m()[:, 0]) > 1.2
    finally:
        player.close()
