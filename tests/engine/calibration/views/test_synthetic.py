"""Ordinary cameras in front of a simulated walker: what is found, and what is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from studio.engine.base.errors import CalibrationError
from studio.engine.base.geometry import invert_transform
from studio.engine.base.sentences import Said
from studio.engine.calibration.views.calibrate import calibrate_views
from studio.engine.calibration.views.judging.result import ViewsResult
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.joints import INDEX
from tests.engine.calibration.views.synthetic import HEIGHT_M, LENS, camera_at, view_of

ANGLES = (0.0, 80.0, 200.0)


def rig(
    cameras: int = 2,
    *,
    knows_lens: bool = False,
    seconds: float = 10.0,
    radius_m: float = 1.2,
    seated: bool = False,
) -> list[View]:
    return [_view(k, knows_lens, seconds, radius_m, seated) for k in range(cameras)]


@cache
def _view(k: int, knows_lens: bool, seconds: float, radius_m: float, seated: bool) -> View:
    ahead = (0.0, 0.12, -0.2)
    return view_of(
        f"camera_{k}", camera_at(ANGLES[k], height_m=1.2 + 0.3 * k), seed=k + 1, seconds=seconds,
        ahead_s=ahead[k], knows_lens=knows_lens, radius_m=radius_m, seated=seated,
    )  # fmt: skip


def codes(result: ViewsResult, camera: str) -> list[str]:
    return [one.code for one in result.cameras[camera].reasons if isinstance(one, Said)]


@pytest.fixture(scope="module")
def found() -> ViewsResult:
    return calibrate_views(rig(3), height_m=HEIGHT_M)


def test_cameras_lenses_and_clocks_are_found(found: ViewsResult) -> None:
    assert found.verdict != "refused", found.reasons
    first = invert_transform(found.cameras["camera_0"].T_stage_camera)
    for k, angle in enumerate(ANGLES):
        camera = found.cameras[f"camera_{k}"]
        true = invert_transform(camera_at(0.0, height_m=1.2)) @ camera_at(angle, height_m=1.2 + 0.3 * k)
        T = first @ camera.T_stage_camera
        assert np.trace(T[:3, :3].T @ true[:3, :3]) > 1 + 2 * np.cos(np.radians(1.5))
        assert np.linalg.norm(T[:3, 3] - true[:3, 3]) < 0.25  # 9 m apart, size included
        assert camera.lens.fx == pytest.approx(LENS.fx, rel=0.03)
        assert camera.ahead_s == pytest.approx((0.0, 0.12, -0.2)[k], abs=0.01)
        assert camera.rests.mean_mrad < 9


def test_the_stage_has_its_floor_under_the_feet_and_the_size_of_the_performer(found: ViewsResult) -> None:
    assert found.performer is not None and found.scale_known
    assert found.performer.height_m == pytest.approx(HEIGHT_M, abs=0.02)
    for k in range(3):
        T = found.cameras[f"camera_{k}"].T_stage_camera
        assert T[2, 3] == pytest.approx(1.2 + 0.3 * k, abs=0.15)
    assert np.nanmedian(found.joints_m[:, INDEX["head"], 2]) == pytest.approx(0.935 * HEIGHT_M, abs=0.06)
    assert found.bones_m["hip_knee"] == pytest.approx(0.245 * HEIGHT_M, abs=0.03)


def test_what_is_uncertain_is_said(found: ViewsResult) -> None:
    sure = found.cameras["camera_1"].uncertain
    assert 0.003 < sure.focal_share < 0.05
    assert 0.005 < sure.place_m < 0.2
    assert 0.0 < sure.ahead_s < 0.01
    assert found.cameras["camera_0"].uncertain.place_m == 0.0


@pytest.fixture(scope="module")
def with_lenses() -> tuple[ViewsResult, list[float]]:
    """Two cameras with known lenses, and the reported progress."""
    done: list[float] = []
    return calibrate_views(rig(knows_lens=True), progress=done.append), done


def test_known_lenses_stay_and_two_cameras_are_enough(with_lenses: tuple[ViewsResult, list[float]]) -> None:
    result, done = with_lenses
    assert result.verdict != "refused", result.reasons
    assert result.cameras["camera_1"].lens == LENS
    assert result.cameras["camera_1"].uncertain.focal_share == 0.0
    assert not result.scale_known
    assert result.performer is not None and result.performer.height_m == pytest.approx(1.75, abs=0.01)
    assert done == sorted(done) and done[-1] == 1.0


def test_the_same_input_gives_the_same_cameras(with_lenses: tuple[ViewsResult, list[float]]) -> None:
    a, b = with_lenses[0], calibrate_views(rig(knows_lens=True))
    for name in a.cameras:
        assert np.array_equal(a.cameras[name].T_stage_camera, b.cameras[name].T_stage_camera)


def test_standing_on_one_spot_asks_for_a_walk() -> None:
    result = calibrate_views(rig(radius_m=0.0))
    assert any("views.focal_on_spot" in codes(result, name) for name in result.cameras)


def test_a_performer_who_stands_still_is_refused() -> None:
    views = [
        replace(
            view,
            pixels=np.repeat(view.pixels[:1], len(view.time_s), axis=0),
            world_m=np.repeat(view.world_m[:1], len(view.time_s), axis=0),
        )
        for view in rig()
    ]
    result = calibrate_views(views)
    assert all(codes(result, name) == ["views.still"] for name in result.cameras)


def test_a_camera_that_is_there_twice_is_refused_and_the_others_are_placed() -> None:
    views = rig(knows_lens=True, seconds=6.0)
    result = calibrate_views([*views, replace(views[0], name="again")])
    assert codes(result, "again") == ["views.same_picture"]
    assert all(result.cameras[view.name].verdict != "refused" for view in views)
    assert result.verdict == "refused"


def test_cameras_beside_each_other_are_refused() -> None:
    views = [view_of(f"camera_{k}", camera_at(a), seed=k) for k, a in enumerate((0.0, 4.0))]
    result = calibrate_views(views)
    assert result.verdict == "refused"
    assert "views.beside" in codes(result, "camera_1")


def test_seated_people_are_refused() -> None:
    result = calibrate_views(rig(seated=True, radius_m=0.3))
    assert result.verdict == "refused"
    assert "views.seated" in codes(result, "camera_0")


def test_pictures_without_knees_are_refused() -> None:
    views = rig()
    confidence = views[1].confidence.copy()
    confidence[:, [INDEX["left_knee"], INDEX["right_knee"]]] = 0.1
    result = calibrate_views([views[0], replace(views[1], confidence=confidence)])
    assert codes(result, "camera_1") == ["views.knees_unseen"]


def test_other_motions_are_refused() -> None:
    views = rig()
    back = views[1]
    other = replace(
        back, pixels=back.pixels[::-1], world_m=back.world_m[::-1], confidence=back.confidence[::-1]
    )
    assert calibrate_views([views[0], other]).verdict == "refused"


def test_one_camera_alone_says_so() -> None:
    result = calibrate_views(rig(1), height_m=HEIGHT_M)
    assert codes(result, "camera_0") == ["views.alone"]
    assert result.verdict == "usable"
    assert result.cameras["camera_0"].T_stage_camera[2, 3] == pytest.approx(1.2, abs=0.4)


def test_nobody_in_the_pictures_is_refused() -> None:
    views = [replace(view, pixels=np.full_like(view.pixels, np.nan)) for view in rig(seconds=4.0)]
    result = calibrate_views(views)
    assert all(codes(result, name) == ["views.few_frames"] for name in result.cameras)


def test_cameras_that_never_saw_the_performer_together_are_refused() -> None:
    views = rig(seconds=6.0)
    result = calibrate_views([views[0], replace(views[1], time_s=views[1].time_s + 100.0)])
    assert result.verdict == "refused"


def test_cameras_of_one_name_are_an_error() -> None:
    view = rig(seconds=2.0)[0]
    with pytest.raises(CalibrationError, match="different names"):
        calibrate_views([view, view])
    with pytest.raises(CalibrationError, match="none"):
        calibrate_views([])
