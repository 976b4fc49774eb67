"""When output frames are due."""

import numpy as np
import pytest

from studio.engine.solve.timing.schedule import ACTIVE_NS, MAX_WAIT_NS, Schedule
from tests.engine.walkers import SECOND

MS = 1_000_000


def feed(schedule, arrivals):
    """Feed (camera, stage time) in order; return which frames became due, and when."""
    newest, out = {}, []
    for camera, stage_ns in arrivals:
        newest[camera] = stage_ns
        out.extend(schedule.due(newest))
    return out


@pytest.mark.parametrize("hz", [30, 60, 120])
def test_each_tick_comes_once_and_in_order(hz):
    rng = np.random.default_rng(hz)
    arrivals = []
    for k in range(90):
        for camera in "ab":
            arrivals.append((camera, SECOND + round(k * SECOND / 30 + rng.normal(0, 3 * MS))))
    ticks = feed(Schedule(hz), arrivals)
    numbers = [round(t * hz / SECOND) for t in ticks]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert all(t == n * SECOND // hz for t, n in zip(ticks, numbers, strict=True)), "multiples of the period"
    assert len(ticks) >= 2.9 * hz


def begun(*cameras):
    """A schedule whose output began with frames at SECOND and continued to just before it."""
    schedule = Schedule(60)
    assert feed(schedule, [(camera, SECOND - 100 * MS) for camera in cameras]) == []
    feed(schedule, [(camera, SECOND) for camera in cameras])
    return schedule


def test_output_begins_once_every_camera_could_speak_and_with_the_first_frame():
    schedule = Schedule(60)
    assert feed(schedule, [("a", SECOND), ("b", SECOND + 20 * MS), ("a", SECOND + 60 * MS)]) == []
    ticks = feed(schedule, [("b", SECOND + 110 * MS), ("a", SECOND + 120 * MS)])
    assert ticks[0] == SECOND and max(ticks) <= SECOND + 110 * MS


def test_it_waits_for_every_active_camera():
    schedule = begun("a", "b")
    assert feed(schedule, [("b", SECOND), ("a", SECOND + 100 * MS)]) == []
    due = schedule.due({"a": SECOND + 100 * MS, "b": SECOND + 50 * MS})
    assert due and max(due) <= SECOND + 50 * MS


def test_it_does_not_wait_for_a_dead_camera():
    schedule = Schedule(60)
    newest = {"a": SECOND, "dead": SECOND}
    schedule.due(newest)
    ticks = []
    for k in range(1, 60):
        newest["a"] = SECOND + round(k * SECOND / 30)
        ticks += schedule.due(newest)
    assert max(ticks) > newest["a"] - 20 * MS
    assert np.diff(ticks).max() < 20 * MS, "the ticks that had waited are made up for"


def test_live_it_waits_for_no_camera_longer_than_the_bound():
    schedule = Schedule(60)
    schedule.due({"a": SECOND, "slow": SECOND}, SECOND)
    newest = {"a": SECOND + 200 * MS, "slow": SECOND}
    due = schedule.due(newest, SECOND + 200 * MS)
    assert due and max(due) <= SECOND + 200 * MS - MAX_WAIT_NS
    assert max(due) > SECOND + 200 * MS - MAX_WAIT_NS - 20 * MS


def test_live_it_never_runs_ahead_of_the_frames():
    schedule = begun("a")
    assert max(schedule.due({"a": SECOND + 40 * MS}, 50 * SECOND)) <= SECOND + 40 * MS


def test_a_long_gap_is_skipped():
    schedule = Schedule(60)
    feed(schedule, [("a", SECOND)])
    ticks = feed(schedule, [("a", 101 * SECOND), ("a", 101 * SECOND + 40 * MS)])
    assert min(ticks) >= 101 * SECOND - 5 * ACTIVE_NS and len(ticks) < 200
    assert max(ticks) > 101 * SECOND


def test_a_short_gap_is_filled():
    ticks = feed(Schedule(60), [("a", SECOND), ("a", SECOND + 700 * MS)])
    assert np.diff(ticks).max() < 20 * MS


def test_nothing_is_due_without_frames_and_nothing_twice():
    assert Schedule(60).due({}) == []
    schedule = begun("a")
    assert schedule.due({"a": SECOND + 17 * MS}) == [SECOND + SECOND // 60]
    assert schedule.due({"a": SECOND + 17 * MS}) == []
    assert schedule.due({"a": SECOND - 100 * MS}) == []


def test_one_frame_of_a_wrong_time_far_ahead_does_not_stop_the_output():
    for cameras in ("a", "ab"):
        schedule, newest, ticks = Schedule(60), {}, []
        for k in range(90):
            for camera in cameras:
                wrong = 3600 * SECOND if (k, camera) == (30, "a") else 0
                newest[camera] = SECOND + round(k * SECOND / 30) + wrong
                ticks += schedule.due(newest)
        assert np.diff(ticks).max() < 20 * MS and max(ticks) < 4 * SECOND
        assert len(ticks) >= 2.9 * 60


def test_output_goes_on_where_time_goes_back():
    schedule = Schedule(60)
    feed(schedule, [("a", 3600 * SECOND), ("a", 3601 * SECOND)])
    ticks = feed(schedule, [("a", 5 * SECOND), ("a", 5 * SECOND + 40 * MS)])
    assert ticks[0] == 5 * SECOND and len(ticks) == 3


def test_a_camera_that_stays_far_ahead_is_followed():
    schedule = Schedule(60)
    feed(schedule, [("a", SECOND), ("b", SECOND)])
    assert feed(schedule, [("a", 20 * SECOND)]) == []
    assert max(feed(schedule, [("a", 20 * SECOND + 40 * MS)])) >= 20 * SECOND


def test_a_schedule_that_looks_ahead_steps_later_and_leaves_nothing_at_the_end():
    arrivals = [("a", SECOND + k * (SECOND // 30 + 1)) for k in range(30)]
    usual, later = Schedule(60), Schedule(60, ahead_ns=SECOND // 60)
    times = feed(usual, arrivals)
    assert feed(later, arrivals) == times[:-1]
    assert later.rest({"a": arrivals[-1][1]}) == times[-1:]


def test_the_end_does_not_wait_for_a_camera_that_lost_the_performer():
    schedule = Schedule(60)
    lost = [("b", SECOND + round(k * SECOND / 30)) for k in range(18)]
    feed(
        schedule,
        sorted([*lost, *(("a", SECOND + round(k * SECOND / 30)) for k in range(30))], key=lambda one: one[1]),
    )
    ends = schedule.rest({"a": 2 * SECOND - 33 * MS, "b": lost[-1][1]})
    assert 2 * SECOND - 55 * MS < ends[-1] <= 2 * SECOND - 33 * MS
    assert np.diff(ends).max() < 17 * MS
