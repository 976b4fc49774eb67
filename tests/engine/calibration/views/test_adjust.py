"""The parts of the calibration of ordinary cameras: derivatives, samples, clocks, sides, triangulation."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import invert_transform
from studio.engine.calibration.views.adjusting.rig import UNKNOWNS, CameraRig
from studio.engine.calibration.views.adjusting.sides import find_swaps
from studio.engine.calibration.views.seen.tracks import make_track, sample
from studio.engine.calibration.views.seen.view import COLUMNS, NUMBER, OTHER_SIDE
from studio.engine.calibration.views.starting.clocks import compare
from studio.engine.calibration.views.starting.first import common_instants
from studio.engine.model.cameras.lens import usual_lens
from studio.engine.model.joints import MIRROR
from tests.engine.calibration.views.synthetic import LENS, camera_at, view_of, walker

ANGLES = (0.0, 95.0, 190.0)


def true_rig(*, ahead_s: float = 0.0) -> CameraRig:
    T = np.stack([invert_transform(camera_at(angle)) for angle in ANGLES])
    count = len(ANGLES)
    return CameraRig(
        T[:, :3, :3], T[:, :3, 3], np.full(count, LENS.fx), np.zeros(count), np.full(count, ahead_s),
        np.zeros((count, 2)),
    )  # fmt: skip


def test_derivatives_are_those_of_small_steps() -> None:
    rig = replace(true_rig(), bends=np.full(3, 0.05), centres=np.array([[3.0, -2.0]] * 3))
    points, speed = walker(np.array([1.0]))[0, COLUMNS], np.zeros((17, 2))
    shown, by_point, by_camera = rig.changes(1, points, speed)
    assert shown == pytest.approx(rig.show(points)[0][1])
    for k in range(3):
        step = np.eye(3)[k] * 1e-5
        assert by_point[..., k] == pytest.approx(
            (rig.show(points + step)[0][1] - rig.show(points - step)[0][1]) / 2e-5, abs=1e-3
        )
    for k in [k for k in range(UNKNOWNS) if k != 8]:  # the clock moves what was seen, not what is shown
        steps = np.zeros((3, UNKNOWNS))
        steps[1, k] = 1e-6
        more, less = rig.changed(steps), rig.changed(-steps)
        assert by_camera[..., k] == pytest.approx(
            (more.show(points)[0][1] - less.show(points)[0][1]) / 2e-6, abs=1e-2
        )


def test_rays_meet_in_the_point_that_cameras_show_in_spite_of_one_wrong_landmark() -> None:
    rig = true_rig()
    points = walker(np.array([1.0, 2.0]))[:, COLUMNS]
    shown, _ = rig.show(points)
    weight = np.full(shown.shape[:-1], 1 / 25.0)
    assert rig.meeting(shown, weight) == pytest.approx(points, abs=1e-6)
    rig4 = CameraRig(*(np.concatenate([value, value[:1]]) for value in vars(rig).values()))
    shown4 = np.concatenate([shown, shown[:1] + 80.0])
    found = rig4.meeting(shown4, np.concatenate([weight, weight[:1]]))
    assert np.linalg.norm(found - points, axis=-1).max() < 0.06  # 80 pixels are 0.36 m
    weight[1:] = 0.0
    assert np.isnan(rig.meeting(shown, weight)).all()


def test_samples_between_frames_have_place_and_speed_of_the_motion() -> None:
    view = view_of("a", camera_at(0.0), seconds=2.0, error_m=0.0)
    track = make_track(view)
    times = np.array([0.513, 1.04])
    found = sample(track, times)
    exact = view_of("a", camera_at(0.0), seconds=2.0, ahead_s=0.013, error_m=0.0)
    row = 15  # 0.5 s
    assert found.points[0] == pytest.approx(exact.pixels[row, COLUMNS] - [639.5, 359.5], abs=3.0)
    ahead = sample(track, times + 0.01)
    assert found.speed == pytest.approx((ahead.points - found.points) / 0.01, abs=90.0)  # of longer lines
    assert (found.weight > 0).all()
    gone = sample(track, np.array([-1.0, 5.0]))
    assert (gone.weight == 0).all() and (gone.points == 0).all()


@pytest.mark.parametrize("ahead_s", [-0.4, 0.0, 0.73])
def test_the_clock_offset_is_found_from_the_guessed_bodies_alone(ahead_s: float) -> None:
    a = make_track(view_of("a", camera_at(0.0), seed=1))
    b = make_track(view_of("b", camera_at(120.0), seed=2, ahead_s=ahead_s))
    together = compare(a, b)
    assert together.ahead_s == pytest.approx(ahead_s, abs=0.04)
    assert together.correlation > 0.5


def test_arms_and_legs_that_a_camera_exchanges_are_found() -> None:
    tracks = [make_track(view_of(str(k), camera_at(a), seed=k)) for k, a in enumerate(ANGLES)]
    wrong = np.zeros((len(tracks[1].time_s), 17), dtype=np.bool_)
    legs = [NUMBER[f"{s}_{j}"] for s in ("left", "right") for j in ("hip", "knee", "ankle", "toe")]
    wrong[100:160, legs] = True
    tracks[1] = tracks[1].exchanged(wrong)
    found = find_swaps(true_rig(), tracks, tracks[0].time_s)
    assert not found[0].any() and not found[2].any()
    assert (found[1] == wrong).mean() > 0.98


def test_the_other_side_of_each_joint_is_the_canonical_mirror() -> None:
    assert (COLUMNS[OTHER_SIDE] == MIRROR[COLUMNS]).all()


def test_a_usual_lens_sees_65_degrees_along_the_longer_side() -> None:
    view = view_of("a", camera_at(0.0), seconds=1.0)
    assert usual_lens(view.width, view.height).fx == pytest.approx(640 / np.tan(np.radians(32.5)))


@pytest.mark.parametrize("hz", [15.0, 24.0, 25.0, 30.0, 60.0])
def test_instants_lie_everywhere_between_frames(hz: float) -> None:
    track = make_track(view_of("a", camera_at(0.0), seconds=10.0))
    count = round(20.0 * hz)
    rows = np.arange(count) % len(track.time_s)
    track = replace(
        track, time_s=np.arange(count) / hz, points=track.points[rows], seen=track.seen[rows],
        sigma=track.sigma[rows], world_m=track.world_m[rows],
    )  # fmt: skip
    times = common_instants([track, track], np.zeros(2), 240)
    assert abs(np.exp(2j * np.pi * hz * times).mean()) < 0.15
