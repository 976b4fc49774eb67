"""The player: time, range, loop, steps, another solve of the same take; what it hands to the view."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from studio.api.stage.shown import ReplayStatus, SecondFigure
from studio.engine.animation.clip.resample import frames_of
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.metrics.own import own_figures
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.web.playback.clip import Clip
from studio.web.playback.curves import curves, spans, thinned
from studio.web.playback.player import Player
from studio.web.playback.second import Second
from tests.api.camera import wait_until
from tests.poses_factory import make_poses
from tests.refused import refused
from tests.web.playback.takes import FRAMES, take_with_solves


class Screen:
    """Keeps what is to be shown."""

    def __init__(self) -> None:
        self.shown: list[tuple] = []
        self.live = threading.Event()

    def show_replay(self, result, ghost, trail, calibration, depth, names, robots) -> None:
        self.shown.append((result, ghost, trail))

    def show_live(self) -> None:
        self.live.set()


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def swinging_arm(frames: int, *, thrown: tuple[int, ...] = ()) -> Poses:
    """An arm that swings once a second by 60 degrees either way; in frames where it is thrown, 40 degrees off."""
    angle = np.radians(60.0) * np.sin(2 * np.pi * np.arange(frames) / 60.0)
    angle[list(thrown)] += np.radians(40.0)
    local = np.zeros((frames, 52, 4))
    local[..., 0] = 1.0
    arm = OUTPUT_INDEX["LeftArm"]
    local[:, arm, 0], local[:, arm, 2] = np.cos(angle / 2), np.sin(angle / 2)
    return make_poses(local)


@pytest.fixture
def take(tmp_path):
    return take_with_solves(tmp_path / "monday" / "one")


@pytest.fixture
def player():
    """A player, its screen and its clock."""
    screen, clock = Screen(), Clock()
    made = Player(screen, clock=clock)
    yield made, screen, clock
    made.close()


def test_it_plays_in_time_and_loops(player, take):
    play, screen, clock = player
    play.open(Clip.load(take, "studio"))
    wait_until(lambda: len(screen.shown) > 0, "the first frame is shown")
    play.change(playing=True)
    clock.now = 1.0
    assert play.status().frame == 60
    play.change(speed=0.5)
    clock.now = 2.0
    assert play.status().frame == 90
    clock.now = 4.0  # past the end: begins again
    assert play.status().frame == 29 and play.status().playing
    wait_until(
        lambda: screen.shown[-1][0].positions_m is not None and len(screen.shown) > 1, "frames are shown"
    )


def test_without_loop_it_stops_at_the_end_and_plays_again_from_the_start(player, take):
    play, _, clock = player
    play.open(Clip.load(take, "studio"))
    play.change(loop=False, first=10, last=50, frame=10, playing=True)
    clock.now = 5.0
    assert play.status().frame == 50
    wait_until(lambda: not play.status().playing, "it stops")
    play.change(playing=True)
    assert play.status().frame == 10


def test_steps_stay_within_the_take(player, take):
    play, _, _ = player
    play.open(Clip.load(take, "studio"))
    play.change(step=-10)
    assert play.status().frame == 0
    play.change(step=3)
    assert play.status().frame == 3
    play.change(frame=10_000)
    assert play.status().frame == FRAMES - 1


def test_another_solve_keeps_the_place(player, take):
    play, screen, _ = player
    play.open(Clip.load(take, "studio"))
    play.change(frame=40, first=20, last=80)
    clip = Clip.load(take, "live")
    play.open(clip, ghost=Second.solve(Clip.load(take, "studio"), clip))
    status = play.status()
    assert (status.frame, status.first, status.last) == (40, 20, 80)
    assert status.ghost == SecondFigure("monday/one", "studio") and not status.has_trace
    wait_until(lambda: screen.shown and screen.shown[-1][1] is not None, "the ghost is shown")
    result, ghost, trail = screen.shown[-1]
    np.testing.assert_array_equal(result.positions_m, ghost.positions_m)
    np.testing.assert_array_equal(trail[1][-1], result.positions_m)


def test_it_lets_go_of_a_reference_that_is_removed(player, take):
    play, _, _ = player
    clip = Clip.load(take, "studio")
    motion = Reference(clip.poses.time_s, canonical_positions(clip.poses))
    play.open(clip, Second.reference(clip.take, "truth.csv", motion))
    play.let_go(clip.take, "other.csv")
    play.let_go("monday/two", "truth.csv")
    assert play.status().ghost == SecondFigure("monday/one", reference="truth.csv")
    play.let_go(clip.take, "truth.csv")
    assert play.status().ghost is None and play.status().open


def test_closing_shows_the_live_stage(player, take):
    play, screen, _ = player
    play.open(Clip.load(take, "studio"))
    wait_until(lambda: len(screen.shown) > 0, "the first frame is shown")
    play.close_clip()
    assert screen.live.wait(30.0) and play.status() == ReplayStatus(open=False)
    with refused(SettingsError, "replay.nothing"):
        play.change(playing=True)


@pytest.mark.parametrize(
    "wrong", [{"speed": 0.0}, {"speed": float("nan")}, {"first": 5, "last": 2}, {"last": 10_000}]
)
def test_wrong_values_change_nothing(player, take, wrong):
    play, _, _ = player
    play.open(Clip.load(take, "studio"))
    before = play.status()
    with refused(SettingsError, "replay.speed", "replay.range"):
        play.change(**wrong)
    assert play.status() == before


def test_a_clip_shows_what_the_cameras_said(take):
    clip = Clip.load(take, "studio")
    step = clip.step(15)
    assert step.frame_set.cameras == ("left", "right")
    np.testing.assert_array_equal(step.positions_m, clip.poses.positions_m[15])
    assert not step.fused.used[1].any() and step.fused.used[0].all()
    assert Clip.load(take, "live").step(15).frame_set.cameras == ()


def test_a_damaged_solve_is_told(take):
    (take.solve_folder("studio") / "poses.npz").write_bytes(b"nothing")
    with pytest.raises(FormatError):
        Clip.load(take, "studio")


def test_curves_name_joints_cameras_and_reasons(take):
    clip = Clip.load(take, "studio")
    found = curves(clip, "LeftHand")
    assert found.frame == list(range(FRAMES))
    assert found.position_m["z"][25] == pytest.approx(clip.poses.positions_m[25, 9, 2], abs=1e-4)
    assert found.cameras == {"left": [], "right": [(10, 19, "spike")]}
    assert found.used == {"left": [(0, FRAMES - 1)], "right": [(0, 9), (20, FRAMES - 1)]}
    assert set(found.stance) == {"left", "right"}
    with refused(SettingsError, "replay.no_joint", joint="Tail"):
        curves(clip, "Tail")


def test_pops_are_what_is_off_course_and_not_what_is_fast(take):
    """A hand that swings at 3 m/s, over the thesis's 10 cm in 4/30 s, has none until it is thrown off."""
    clip = Clip.load(take, "live")
    swinging = swinging_arm(121)
    fast = replace(clip, poses=swinging)
    speed = np.array(curves(fast, "LeftHand").speed_m_s)
    assert speed.max() > 2.5 and curves(fast, "LeftHand").pops == []
    thrown = replace(clip, poses=swinging_arm(121, thrown=(60, 61)))
    ((first, last),) = curves(thrown, "LeftHand").pops
    assert first <= 60 and 61 <= last
    assert curves(thrown, "RightHand").pops == []
    events = [one for one in own_figures(thrown.poses)["cleanup_events"] if one["kind"] == "joint_pop"]
    (event,) = [one for one in events if one["unit"] == "cm"]  # of the arm
    assert event["joint"] in ("left_wrist", "left_hand")
    assert [first / 60, last / 60] == pytest.approx([event["start_s"], event["end_s"]], abs=1 / 60)


def test_pops_are_found_where_frames_are_missing_elsewhere(take):
    clip, poses = Clip.load(take, "live"), swinging_arm(181, thrown=(120, 121))
    kept = np.r_[0:40, 55:181]
    whole = {
        name: getattr(poses, name)[kept]
        for name in ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    }
    found = curves(replace(clip, poses=replace(poses, **whole)), "LeftHand").pops
    assert any(first <= 105 and 106 <= last for first, last in found)


def test_spans():
    assert spans(np.array([1, 1, 0, 1, 0], dtype=bool)) == [(0, 1), (3, 3)]
    assert spans(np.zeros(3, dtype=bool)) == []
    flags = np.array([1, 0, 1, 0, 0, 1], dtype=bool)
    assert spans(flags, gap=1) == [(0, 2), (5, 5)] and spans(flags, gap=2) == [(0, 5)]


def test_thinned_curves_keep_every_spike():
    values = np.random.default_rng(1).normal(size=(36_000, 4))
    values[12_345, 2], values[20_001, 0] = 50.0, -50.0
    frames = thinned(values, 2000)
    assert {0, 12_345, 20_001, 35_999} <= set(frames.tolist()) and 1500 < len(frames) <= 2100
    assert (np.diff(frames) > 0).all()
    assert thinned(values[:50], 2000).tolist() == list(range(50))


def test_a_preview_replaces_what_is_around_the_playhead_until_another_solve_is_opened(player, take):
    play, screen, _ = player
    with refused(SettingsError, "replay.not_replayed"):
        play.part("monday/one")
    clip = Clip.load(take, "studio")
    play.open(clip)
    play.change(frame=60)
    start_s, end_s, _ = play.part("monday/one")
    times = clip.poses.time_s
    assert times[0] < start_s < times[60] < end_s <= times[-1] + 0.5
    part = frames_of(clip.poses, slice(50, 80))
    moved = replace(part, positions_m=part.positions_m + 1.0)
    play.show_part("monday/two", moved)
    assert play.clip is clip
    play.show_part("monday/one", moved)
    wanted = clip.poses.positions_m[60] + 1.0
    wait_until(
        lambda: bool(screen.shown) and np.allclose(screen.shown[-1][0].positions_m, wanted), "it is shown"
    )
    shown = play.clip.poses.positions_m
    np.testing.assert_array_equal(shown[50:80], clip.poses.positions_m[50:80] + 1.0)
    np.testing.assert_array_equal(shown[:50], clip.poses.positions_m[:50])
    np.testing.assert_array_equal(shown[80:], clip.poses.positions_m[80:])
    play.open(clip)
    assert play.clip is clip
