"""Several simulated performers: where they are, who hides whom, and what numbers devices give them."""

from pathlib import Path

import numpy as np
import pytest

import studio
from studio.__main__ import main
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import INDEX
from studio.simulator.crowd.meeting import GOING_S, MEETINGS, T_POSE_S, meet
from studio.simulator.crowd.seen import see_crowd
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig
from studio.take.raw.frames import camera_frames
from tests.refused import refused
from tests.simulator.crowd_people import beginning
from tests.simulator.short_demo import short_demo

HIPS = INDEX["hips"]
PASSING_S = 30.0
"""They pass each other every 3.5 seconds."""


@pytest.fixture(scope="module")
def demo():
    motion, _ = stage_motion("demo", calibration=False)
    return motion


@pytest.mark.parametrize("meeting", MEETINGS)
@pytest.mark.parametrize("count", [2, 3])
def test_performers_keep_apart_and_begin_on_their_sides(demo, meeting, count):
    together = meet([demo] * count, meeting)
    performing = round((together.calibration_s + T_POSE_S + 2 * GOING_S) * 120) + 1
    hips = np.array([motion.positions_m[:, HIPS, :2] for motion in together.motions])
    begins = hips[:, performing, 0]
    assert (np.diff(begins) > 0).all() or count > 2
    for a in range(count):
        for b in range(a):
            assert np.linalg.norm(hips[a, performing:] - hips[b, performing:], axis=1).min() > 0.2
    assert together.enters_s == (0.0, *[together.calibration_s + GOING_S] * (count - 1))


def test_a_hand_lifts_the_other_s_arm(demo):
    together = meet([demo, demo], "lifting")
    one, other = (motion.positions_m[-demo.frame_count :] for motion in together.motions)
    apart_m = np.linalg.norm(one[:, INDEX["left_hand"]] - other[:, INDEX["right_wrist"]], axis=1)
    assert np.percentile(apart_m, 90) < 0.05
    above_m = other[:, INDEX["right_wrist"], 2] - other[:, INDEX["right_shoulder"], 2]
    assert above_m.min() < -0.2 and above_m.max() > 0.2
    for joints, motion in ((one, demo), (other, demo)):  # arms keep their lengths
        lengths = np.linalg.norm(joints[:, INDEX["right_elbow"]] - joints[:, INDEX["right_shoulder"]], axis=1)
        assert lengths == pytest.approx(np.linalg.norm(motion.offsets_m[INDEX["right_elbow"]]), rel=0.05)


def test_cameras_lose_who_is_hidden_and_give_new_numbers(demo):
    together = meet([beginning(demo, PASSING_S)] * 2, "passing")
    exchanged = 0
    for seen in see_crowd(together, standard_rig(2), seed=3):
        before = seen.taken_s < together.enters_s[1]
        counts = np.array([len(bodies) for bodies in seen.bodies])
        assert counts[before].max() == 1 and counts[~before].max() == 2
        assert (counts[~before] == 1).any()  # one behind the other
        numbers = {(body.who, body.number) for bodies in seen.bodies for body in bodies}
        assert len(numbers) > 2
        exchanged += len(numbers) - len({number for _, number in numbers})
        for bodies in seen.bodies:
            assert len({body.number for body in bodies}) == len(bodies)
    assert exchanged  # at times both have the same number


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> Path:
    """A take of two performers, made by the command."""
    path = tmp_path_factory.mktemp("two") / "take"
    with short_demo(6.0):
        assert main([*TWO, str(path)]) == 0
    return path


TWO = ("simulate", "demo", "demo", "--cameras", "2", "--meeting", "apart", "--out")


def test_a_take_of_two_has_both_and_their_truth(two):
    take = studio.open_take(two)
    frames = camera_frames(take.raw_path)
    assert {len(frame.bodies()) for mine in frames.values() for frame in mine} == {1, 2}
    truths = sorted(path.name for path in two.parent.glob("*.csv"))
    assert truths == ["take.truth.performer_1.csv", "take.truth.performer_2.csv"]
    assert main([*TWO, str(two)]) == 1  # it exists


def test_the_library_solves_both(two):
    take = studio.open_take(two)
    studio.calibrate(take)
    first = studio.solve(take, "studio")
    second = studio.load_poses(take, "studio", "performer_2")
    assert first.frame_count >= second.frame_count > 0
    same = np.searchsorted(first.time_s, second.time_s)
    apart_m = np.linalg.norm((first.positions_m[same] - second.positions_m)[:, 0, :2], axis=1)
    assert apart_m.min() > 0.2


def test_what_shows_one_performer_says_so(tmp_path: Path):
    with refused(SettingsError, "simulator.one_performer", tracker="rgb"):
        studio.simulate(["demo", "demo"], tmp_path / "take", tracker="rgb")
    with refused(SettingsError, "value.unknown"):
        studio.simulate(["demo", "demo"], tmp_path / "take", meeting="dancing")
