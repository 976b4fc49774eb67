"""Cameras that were given a little off are refined on body and floor; uncertain refinements are refused."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import make_transform
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.seeing.cameras.refine import refine_cameras
from studio.simulator.body.performers import SCORING, TUNING
from tests.engine.seeing.cameras import given_cameras
from tests.engine.seeing.cameras.given_cameras import HZ, a_little_off, apart_m, errors, refined, watched
from tests.engine.seeing.cameras.hands_at_body import hands_at_body, short_washing

SECONDS = 4.6
"""The T-pose and the beginning of washing."""

LATE = 60
"""Number of images of the T-pose that can be left out: a body is found without them, too."""

ENOUGH = 90
"""Number of image sets that are enough to refine cameras that stand where they are given."""


@pytest.fixture(scope="module")
def washing():
    """A person who begins to wash the face in front of two Kinect v2."""
    return watched(TUNING[0], short_washing(TUNING[0]), seconds=SECONDS)


def lifted(placed, name, metres):
    """The cameras, one of them placed higher than it stands."""
    T = placed[name]
    return placed | {name: make_transform(T[:3, :3], T[:3, 3] + np.array([0.0, 0.0, metres]))}


def test_cameras_and_hands_are_nearer_the_truth(washing):
    given = a_little_off(washing.placed, 3)
    found = refined(washing, given)
    placed = {name: found.calibration.cameras[name].T_stage_camera for name in given}
    assert found.refused is None and set(found.moves) == set(given)
    assert apart_m(placed, washing.placed) < 0.4 * apart_m(given, washing.placed)
    for name, move in found.moves.items():
        assert move.metres == pytest.approx(np.linalg.norm(placed[name][:3, 3] - given[name][:3, 3]))
        assert f"{name} by {move.metres * 1e3:.1f} mm and {move.degrees:.2f} degrees" in found.line()
    late = replace(washing, sets=washing.sets[LATE:], truth=washing.truth[LATE:])
    before, after = (errors(late, cameras, 3.3 - LATE / HZ) for cameras in (given, placed))
    assert after.wrists_m < before.wrists_m - 0.004 and after.limbs_m < before.limbs_m - 0.003


def test_exact_cameras_stay_within_millimetres(washing):
    found = refined(replace(washing, sets=washing.sets[:ENOUGH]), washing.placed)
    placed = {name: found.calibration.cameras[name].T_stage_camera for name in washing.placed}
    assert found.refused is None and apart_m(placed, washing.placed) < 0.005
    assert max(move.metres for move in found.moves.values()) < 0.01


def test_a_camera_that_stands_elsewhere_is_refused(washing):
    found = refined(washing, lifted(washing.placed, "camera_1", 0.12))
    assert found.moves == {} and found.refused is not None
    assert "camera_1" in found.refused and "measure the cameras again" in found.line()


def test_too_little_to_see_is_refused(washing):
    calibration = Calibration("camera_0", {n: CameraCalibration(T) for n, T in washing.placed.items()})
    images = [image for one in washing.sets[:20] for image in one.values()]
    found = refine_cameras(images, washing.cameras, calibration)
    assert found.calibration is calibration and found.moves == {}
    assert "camera_0, camera_1 saw too little of the performer" in found.line()


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_draws_of_camera_errors_no_longer_matter():
    runs = [after for *_, after, _ in given_cameras.runs(range(1, 11), SCORING)]
    assert len(runs) == 50 and sum(run.within for run in runs) >= 48


@pytest.mark.long
def test_motions_put_hands_at_the_body():
    for performer in SCORING:
        assert 15 < hands_at_body(performer).duration_s < 30
