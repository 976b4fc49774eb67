"""The stage clock: the reference camera's clock, latency corrections, cameras that leave and come back."""

import numpy as np
import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.solve.timing.clock import shifted
from studio.live.cameras.clocks import Anchor, StageClock
from studio.live.cameras.roster import MAX_CAMERAS, Roster
from studio.wire import ClockSample
from tests.live.performer import hello
from tests.refused import refused

SECOND = 1_000_000_000


def exchange(ahead_ns: int, server_ns: int) -> ClockSample:
    """An exchange without delay of a camera whose clock is ahead of the server's."""
    return ClockSample(server_ns + ahead_ns, server_ns, server_ns, server_ns + ahead_ns)


@pytest.fixture
def roster():
    """Cameras a (the reference, 10 s ahead of the server) and b (3 s ahead), their clocks known."""
    roster = Roster()
    assert roster.join(hello("a"), keep_clock=False)
    assert not roster.join(hello("b"), keep_clock=False)
    roster.measured("a", exchange(10 * SECOND, 100 * SECOND))
    roster.measured("b", exchange(3 * SECOND, 100 * SECOND))
    return roster


def test_the_reference_cameras_clock_is_the_stage_clock(roster):
    assert roster.clock_of("a") == ClockModel()
    assert roster.clock_of("b").stage_ns(103 * SECOND) == 110 * SECOND
    assert roster.clock.server_to_stage_ns(100 * SECOND) == 110 * SECOND


def test_latency_corrections_move_the_other_cameras(roster):
    roster.set_corrections({"a": 5_000_000, "b": 12_000_000})
    assert roster.clock_of("a") == ClockModel()
    assert roster.clock_of("b").stage_ns(103 * SECOND) == 110 * SECOND + 7_000_000
    assert roster.clock.correction_ns("b") == 7_000_000


def test_a_correction_that_cannot_be_a_latency_is_not_used(roster):
    roster.set_corrections({"b": 40 * SECOND})
    assert roster.clock_of("b").stage_ns(103 * SECOND) == 110 * SECOND


def test_a_better_clock_of_the_reference_moves_the_others(roster):
    changed = roster.measured("a", exchange(10 * SECOND + 400_000, 104 * SECOND))
    assert [camera.name for camera in changed] == ["b"]
    assert roster.clock_of("b").stage_ns(107 * SECOND) == 114 * SECOND + 400_000


def test_the_stage_clock_goes_on_when_the_reference_leaves_and_restarts(roster):
    roster.cameras["a"].leave("gone", error=False)
    roster.measured("b", exchange(3 * SECOND + 1_000_000, 110 * SECOND))
    assert roster.clock_of("b").stage_ns(113 * SECOND + 1_000_000) == 120 * SECOND
    assert not roster.join(hello("a", boot_id="boot-2"), keep_clock=False)
    roster.measured("a", exchange(77 * SECOND, 120 * SECOND))
    assert roster.clock_of("a").stage_ns(197 * SECOND) == 130 * SECOND


def test_a_camera_that_comes_to_an_empty_stage_gives_its_clock(roster):
    for camera in roster.cameras.values():
        camera.leave("gone", error=False)
    assert not roster.join(hello("b", boot_id="boot-2"), keep_clock=True)
    roster.cameras["b"].leave("gone", error=False)
    assert roster.join(hello("b", boot_id="boot-3"), keep_clock=False)
    assert roster.reference == "b"


def test_no_stage_time_before_the_reference_has_a_clock():
    clock = StageClock()
    clock.set_anchor("a", "boot-1")
    assert clock.server_to_stage_ns(5) is None
    assert clock.camera_to_stage("b", "boot-1", ClockModel(offset_ns=1)) is None
    clock.follow(shifted(ClockModel(), -2 * SECOND))
    assert clock.server_to_stage_ns(5 * SECOND) == 7 * SECOND


def test_a_camera_on_the_servers_machine_becomes_the_reference_unless_one_was_chosen():
    roster = Roster()
    roster.join(hello("far"), keep_clock=False)
    assert roster.join(hello("near"), keep_clock=False, local=True) and roster.reference == "near"
    assert not roster.join(hello("second"), keep_clock=False, local=True)
    assert roster.choose("far") and roster.reference == "far"
    assert not roster.join(hello("third"), keep_clock=False, local=True) and roster.reference == "far"
    with refused(SettingsError, "camera.none"):
        roster.choose("nobody")


def test_the_reference_stays_within_a_recording():
    roster = Roster()
    roster.join(hello("far"), keep_clock=False)
    assert not roster.join(hello("near"), keep_clock=True, local=True) and roster.reference == "far"


def test_a_restored_stage_clock_is_not_spoilt_by_late_arrivals():
    roster = Roster()
    roster.restore(Anchor("a", "boot-1"), ClockModel(offset_ns=10 * SECOND))
    roster.join(hello("a"), keep_clock=True)
    queued = CameraFrame("a", 1, 110 * SECOND, np.zeros((21, 3)), np.zeros(21))
    roster.arrived(queued, 103 * SECOND)  # three seconds late
    assert roster.clock.server_to_stage_ns(100 * SECOND) == 110 * SECOND
    assert roster.clock_of("a") == ClockModel()
    roster.measured("a", exchange(10 * SECOND + 500_000, 104 * SECOND))
    assert roster.clock.server_to_stage_ns(100 * SECOND) == 110 * SECOND + 500_000


def test_names_that_come_and_go_do_not_fill_the_memory():
    roster = Roster()
    for number in range(3 * MAX_CAMERAS):
        roster.join(hello(f"c{number}"), keep_clock=False)
        roster.cameras[f"c{number}"].leave("gone", error=False)
    assert len(roster.cameras) <= MAX_CAMERAS
