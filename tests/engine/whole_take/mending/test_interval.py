"""A pin shows from when to when cameras were wrong, and how: on an arm whose true path is known."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.evidence import Erring
from studio.engine.whole_take.mending.interval import erring, fading, likelier
from studio.engine.whole_take.mending.shifts import shift_of
from tests.live.performer import calibration, joints_m

COUNT, PIN, CAMERAS = 150, 75, 3
BEGIN, END = 55, 100
WRIST = INDEX["left_wrist"]
ARM = [INDEX["left_elbow"], WRIST, INDEX["left_hand"]]
TRUE = np.array([joints_m(0.5 * STEP_S * k) for k in range(COUNT)])
PERFORMER = calibration(["camera_0"]).performer
AXES = np.tile(np.eye(3), (COUNT, 1, 1))
NOISE = np.ones((COUNT, CAMERAS, JOINT_COUNT))


def seen(true: np.ndarray = TRUE) -> np.ndarray:
    rng = np.random.default_rng(2)
    return true[:, None] + 0.01 * rng.normal(size=(COUNT, CAMERAS, JOINT_COUNT, 3))


def found(tracks: np.ndarray, at: int = PIN, true: np.ndarray = TRUE) -> Erring:
    place = np.zeros((COUNT, 3))
    place[at] = true[at, WRIST] + [0.01, -0.01, 0.01]
    return erring(tracks, NOISE, WRIST, slice(at, at + 1), place, AXES, PERFORMER)


@pytest.mark.parametrize("at", [PIN, BEGIN, END - 1], ids=["within", "first", "last"])
def test_a_limb_that_is_shifted_is_found_with_its_shift(at: int):
    tracks, shift = seen(), np.array([0.12, -0.1, 0.12])
    tracks[BEGIN:END, :, ARM] += shift
    error = found(tracks, at)
    assert error.is_seen and error.follows and error.joints == tuple(ARM)
    assert abs(error.rows.start - BEGIN) <= 1 and abs(error.rows.stop - END) <= 1
    errs = np.ones((error.rows.stop - error.rows.start, CAMERAS), dtype=bool)
    told = shift_of(error, tracks, NOISE, errs, AXES, PERFORMER)
    np.testing.assert_allclose(told, shift, atol=0.025)


def test_a_wrist_that_is_taken_for_another_joint_says_nothing_for_as_long():
    tracks = seen()
    tracks[BEGIN:END, :, ARM[1:]] = tracks[BEGIN:END, :, [INDEX["spine"]]]
    error = found(tracks)
    assert error.is_seen and not error.follows and error.joints == (WRIST, INDEX["left_hand"])
    assert abs(error.rows.start - BEGIN) <= 1 and abs(error.rows.stop - END) <= 1


@pytest.mark.parametrize(("arm", "walk_m_s"), [(0.08, 1.0), (0.5, 0.0)], ids=["walks", "stands"])
def test_a_wrist_that_is_taken_for_the_spine_is_neither_shifted_nor_held(arm: float, walk_m_s: float):
    """A shifted wrist's bone keeps about its length while the arm moves slowly, and the spine may stand still."""
    true = np.array([joints_m(arm * STEP_S * (k - BEGIN)) for k in range(COUNT)])
    true += STEP_S * np.arange(COUNT)[:, None, None] * np.array([walk_m_s, 0.0, 0.0])
    tracks = seen(true)
    tracks[BEGIN:END, :, ARM[1:]] = tracks[BEGIN:END, :, [INDEX["spine"]]]
    error = found(tracks, true=true)
    assert error.is_seen and not error.follows
    assert abs(error.rows.start - BEGIN) <= 1 and abs(error.rows.stop - END) <= 1


def test_a_joint_that_is_held_in_its_place_is_let_go_from_jump_to_jump():
    """Its bone keeps about its length all the time."""
    tracks = seen()
    for joint in ARM[1:]:
        tracks[BEGIN:END, :, joint] = tracks[BEGIN, :, joint]
    error = found(tracks, END - 1)
    assert error.is_seen and not error.follows
    assert abs(error.rows.start - BEGIN) <= 2 and abs(error.rows.stop - END) <= 2


def test_a_joint_that_stands_still_is_held_there_unless_much_tells_of_a_shift():
    """One end of the shift, before a pin, is outside the known part around the pin."""
    true = np.array([joints_m(0.05 * STEP_S * k) for k in range(COUNT)])
    for size_m, follows in ((0.085, False), (0.2, True)):
        tracks = seen(true)
        tracks[:END, :, ARM] += size_m * np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0)
        error = found(tracks, true=true)
        assert error.is_seen and error.follows == follows
        assert error.rows.stop == END


@pytest.mark.parametrize(("cost", "wins"), [(-489.0, True), (-40.0, False)], ids=["sure", "weak"])
def test_a_sure_shift_is_likelier_than_a_joint_that_is_held(cost: float, wins: bool):
    """With sides exchanged, a limb may look shifted that otherwise stands still for a moment."""
    rows, no_shift = slice(BEGIN, END), np.zeros(3)
    held = Erring(rows, (WRIST,), no_shift, in_body=False, follows=False, cost=-1067.0, held=True)
    shift = Erring(rows, (WRIST,), no_shift + 0.1, in_body=False, follows=True, cost=cost)
    assert likelier(shift, held) == wins and likelier(held, shift) != wins
    assert likelier(shift, replace(held, held=False, cost=0.0))


@pytest.mark.parametrize("away", [[0.0, 0.0, 0.15], [0.1, 0.1, 0.0]], ids=["up", "aside"])
def test_a_pin_of_which_nothing_else_tells_fades_before_and_after_it(away: list[float]):
    tracks, at = seen(), slice(PIN, PIN + 1)
    place = np.zeros((COUNT, 3))
    place[PIN] = TRUE[PIN, WRIST] + away
    assert not erring(tracks, NOISE, WRIST, at, place, AXES, PERFORMER).is_seen
    error, share = fading(tracks, WRIST, at, place)
    np.testing.assert_allclose(error.shift_m, -np.array(away), atol=0.02)
    assert share[PIN - error.rows.start] == 1.0 and share[0] < 0.02 and share[-1] < 0.02
    assert np.abs(np.diff(share)).max() < 0.11  # no frame jumps
