"""The bars of the calibration of ordinary cameras, on real videos, in which the landmarks are found first."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.sentences import Said
from studio.engine.calibration.views.calibrate import calibrate_views
from studio.engine.calibration.views.seen.view import View
from tests.engine.calibration.views.recordings import error_of, folder_of, truth_of, views_of

TURN_DEG, PLACE_M, JOINTS_M = 2.5, 0.15, 0.008


def watched(video: Path) -> View:
    """Return what the pose network reads in a video."""
    av = pytest.importorskip("av")
    poses = pytest.importorskip("studio.engine.seeing.pictures.poses")
    finder = poses.PoseFinder("full")
    times, pixels, visibility, world, size = [], [], [], [], (1, 1)
    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        for frame in container.decode(stream):
            picture = frame.to_ndarray(format="rgb24")
            found = finder.find(picture)
            size = picture.shape[1::-1]
            times.append(float(frame.pts * stream.time_base))
            pixels.append(np.full((33, 2), np.nan) if found is None else found.pixels)
            visibility.append(np.zeros(33) if found is None else found.visibility)
            world.append(np.full((33, 3), np.nan) if found is None else found.world_m)
    arrays = [np.array([value]) for value in (pixels, visibility, world)]
    return views_of(np.array(times), arrays[0], arrays[1], arrays[2], [video.stem], size)[0]


@pytest.mark.long
def test_a_person_on_a_treadmill(test_data: Path) -> None:
    folder = folder_of(test_data, "pose2sim_single")
    views = [
        watched(folder / f"{name}.mp4") for name in json.loads((folder / "truth/cameras.json").read_text())
    ]
    truth = truth_of(test_data, "pose2sim_single")
    known = [replace(view, lens=truth.lenses[view.name]) for view in views]
    points = np.random.default_rng(0).uniform(
        (-1.5, -0.5, 0.0), (-0.5, 0.5, 1.7), (500, 3)
    )  # about the treadmill
    for given in (known, views):
        result = calibrate_views(given)
        found = error_of(result, truth, points)
        assert found.turn_deg < TURN_DEG and found.place_m < PLACE_M, found
        assert found.joints_m < JOINTS_M, found
        said = {
            one.code for camera in result.cameras.values() for one in camera.reasons if isinstance(one, Said)
        }
        assert ("views.focal_on_spot" in said) == (given is views), (
            "unknown focal lengths: it must ask for a walk"
        )


@pytest.mark.long
def test_a_seated_person_is_refused(test_data: Path) -> None:
    folder = folder_of(test_data, "seated_2")
    result = calibrate_views([watched(video) for video in sorted(folder.glob("*.mp4"))])
    for camera in result.cameras.values():
        assert camera.verdict == "refused"
        assert [one.code for one in camera.reasons if isinstance(one, Said)] == ["views.knees_unseen"]
