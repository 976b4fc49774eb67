"""The watch over the cameras: it notices a bump within five seconds, and nothing else."""

import numpy as np
import pytest

from studio.engine.calibration.quality.watch import ALARM_M, CameraWatch
from studio.engine.model.frames import FrameSet
from studio.engine.model.joints import JOINT_COUNT, MIRROR

RATE_HZ = 60


def moments(cameras: int, seconds: float, change=None):
    """Yield a performer who walks about as noisy cameras see it, with `change(camera, time_s, joints)` applied."""
    rng = np.random.default_rng(1)
    body = rng.uniform(-0.5, 0.5, (JOINT_COUNT, 3))
    for i in range(round(seconds * RATE_HZ)):
        time_s = i / RATE_HZ
        joints = body + np.array([np.sin(time_s), np.cos(time_s), 1.0])
        seen = joints + rng.normal(0, 0.02, (cameras, JOINT_COUNT, 3))
        seen[rng.random((cameras, JOINT_COUNT)) < 0.05] = np.nan
        if change is not None:
            seen = np.array([change(k, time_s, mine) for k, mine in enumerate(seen)])
        names = tuple(f"camera_{k}" for k in range(cameras))
        yield FrameSet(
            round(time_s * 1e9), names, seen, np.ones((cameras, JOINT_COUNT)), np.zeros((cameras, 3))
        )


def alarms(frames) -> dict[str, float]:
    """When each camera is first reported as moved [s]."""
    watch, first = CameraWatch(), {}
    for frame in frames:
        if watch.add(frame):
            for name in watch.moved():
                first.setdefault(name, frame.stage_time_ns * 1e-9)
    return first


def bump(camera: int, at_s: float, metres: float):
    return lambda k, time_s, joints: (
        joints + np.array([metres, 0, 0]) if k == camera and time_s >= at_s else joints
    )


@pytest.mark.parametrize("cameras", [3, 4])
@pytest.mark.parametrize("camera", [0, 1])
def test_the_bumped_camera_is_named_within_five_seconds(cameras, camera):
    found = alarms(moments(cameras, 10, bump(camera, 4.0, 0.1)))
    assert list(found) == [f"camera_{camera}"]
    assert 4.0 < found[f"camera_{camera}"] < 9.0


def test_of_two_cameras_both_are_named():
    assert set(alarms(moments(2, 10, bump(1, 4.0, 0.1)))) == {"camera_0", "camera_1"}


def test_nothing_moved_nothing_said():
    assert not alarms(moments(3, 10))
    assert not alarms(moments(2, 10, bump(1, 4.0, ALARM_M / 2)))
    assert not alarms(moments(1, 5))


def glance(k, time_s, joints):
    return joints + np.array([0.3, 0, 0]) if k == 1 and 4 < time_s < 5.2 else joints


def test_what_passes_by_is_no_bump():
    assert not alarms(moments(3, 10, glance))


def apart(frames) -> list[tuple[float, str]]:
    """Each time a camera is reported as disagreeing with the others: when [s], and which camera."""
    watch = CameraWatch()
    return [
        (frame.stage_time_ns * 1e-9, name) for frame in frames if watch.add(frame) for name in watch.apart()
    ]


def test_what_passes_by_is_told_while_it_does():
    assert apart(moments(3, 10, glance)) == [(pytest.approx(5.0, abs=0.1), "camera_1")]
    assert not apart(moments(3, 10))


def test_left_and_right_exchanged_is_no_bump():
    def turned(k, time_s, joints):
        return joints[MIRROR] if k == 1 and time_s > 3 else joints

    assert not alarms(moments(3, 10, turned))


def test_unseen_performer_and_other_cameras_are_no_bump():
    gone = list(moments(3, 4, lambda k, time_s, joints: joints * np.nan if time_s > 2 else joints))
    two = [
        FrameSet(f.stage_time_ns + 4 * 10**9, f.cameras, f.positions, f.confidence, f.camera_positions)
        for f in moments(2, 4)
    ]
    assert not alarms(gone + two)
