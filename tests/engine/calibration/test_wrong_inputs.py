"""What cannot be calibrated is refused with its reason, and nothing wrong is accepted."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.quality.halves import Halves
from studio.engine.calibration.quality.verdict import Facts, verdict
from studio.engine.model.joints import MIRROR
from tests.engine.calibration.synthetic import RIGS, Options, record


@pytest.fixture(scope="module")
def frames():
    return record(21, RIGS[2])[0]


@pytest.fixture(scope="module")
def right(frames):
    """The calibration of these frames."""
    return calibrate(frames)


def long(*values):
    """Values of a test's parameters for the long form only; the short form has others."""
    return pytest.param(*values, marks=pytest.mark.long)


def changed(frames, camera, change):
    """The same frames with one camera's positions changed by `change(index, positions)`."""
    mine = [replace(frame, positions=change(i, frame.positions)) for i, frame in enumerate(frames[camera])]
    return {**frames, camera: mine}


def refused(frames, reason, camera="camera_1"):
    found = calibrate(frames).cameras[camera]
    assert found.verdict == "refused"
    assert any(reason in text for text in found.reasons), found.reasons


@pytest.mark.parametrize(
    ("camera", "relabelled"),
    [("camera_0", True), ("camera_1", False), long("camera_0", False), long("camera_1", True)],
)
def test_mirrored_stream(frames, camera, relabelled):
    order = MIRROR if relabelled else slice(None)
    refused(changed(frames, camera, lambda _, p: (p * [-1, 1, 1])[order]), "mirror")


@pytest.mark.parametrize("rig", [1, 2, long(4)])
def test_all_streams_mirrored_alike(rig):
    frames = record(25, RIGS[rig])[0]
    for camera in list(frames):
        frames = changed(frames, camera, lambda _, p: p * [-1, 1, 1])
    refused(frames, "mirror", "camera_0")


@pytest.mark.parametrize("camera", ["camera_0", "camera_1"])
def test_upside_down_camera(frames, camera):
    refused(changed(frames, camera, lambda _, p: p * [-1, -1, 1]), "tilted", camera)


def test_performer_who_stands_still():
    refused(record(22, RIGS[2], Options(duration_s=20), walking=False)[0], "too little spread")


def test_one_stream_twice(frames):
    refused({**frames, "camera_1": frames["camera_0"]}, "the reference camera's own")


def test_millimetres(frames):
    refused(changed(frames, "camera_1", lambda _, p: p * 1000), "disagree")


def test_two_performers(frames):
    other = record(23, RIGS[2])[0]["camera_1"][::-1]
    refused(
        changed(frames, "camera_1", lambda i, p: other[i % len(other)].positions - np.array([0.5, 0, 0])),
        "disagree",
    )


def test_bystander_in_half_of_the_walk(frames):
    other = record(24, RIGS[2])[0]["camera_1"][::-1]
    refused(
        changed(frames, "camera_1", lambda i, p: p if i < 500 else other[i % len(other)].positions),
        "blocks differ",
    )


def test_camera_bumped_while_walking(frames):
    c, s = np.cos(0.2), np.sin(0.2)
    bump = make_transform(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([0.1, 0, 0]))
    refused(
        changed(frames, "camera_1", lambda i, p: p if i < 500 else transform_points(bump, p)), "blocks differ"
    )


@pytest.mark.parametrize(("rig", "at"), [(2, 200), long(2, 800), long(3, 200), (3, 800)])
@pytest.mark.parametrize(("metres", "degrees"), [(0.05, 1.0), long(0.08, 3.0)])
def test_camera_bumped_is_named_however_early_or_late(frames, rig, at, metres, degrees):
    frames = frames if rig == 2 else record(27, RIGS[rig])[0]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    bump = make_transform(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([metres, 0, 0]))
    found = calibrate(changed(frames, "camera_1", lambda i, p: p if i < at else transform_points(bump, p)))
    refused = [name for name, camera in found.cameras.items() if camera.verdict == "refused"]
    assert refused == ["camera_1"]


def test_two_seconds_only(frames):
    refused({**frames, "camera_1": frames["camera_1"][:60]}, "joint pairs")


def test_camera_without_frames(frames):
    refused({**frames, "camera_1": []}, "no frames")


def test_camera_that_saw_nobody(frames):
    refused(changed(frames, "camera_1", lambda _, p: np.full_like(p, np.nan)), "joint pairs")


def test_reference_that_saw_nobody(frames):
    refused(changed(frames, "camera_0", lambda _, p: np.full_like(p, np.nan)), "joint pairs")


DEGENERATE = {
    "all at the lens": lambda _, p: p * 0,
    "all in one point": lambda _, p: np.tile(p[:1], (21, 1)),
    "infinite": lambda _, p: p * np.inf,
    "frozen": lambda _, p: np.arange(63.0).reshape(21, 3) * 0.03,
    "one joint": lambda _, p: np.where(np.arange(21)[:, None] == 4, p, np.nan),
}


CAMERAS = {"first": ("camera_0",), "second": ("camera_1",), "both": ("camera_0", "camera_1")}
SHORT = [("all at the lens", "both"), ("infinite", "first"), ("one joint", "second"), ("frozen", "second")]
SHORT += [("all in one point", "second"), ("frozen", "first")]


@pytest.mark.parametrize(
    ("kind", "cameras"),
    [one if one in SHORT else long(*one) for one in product(DEGENERATE, CAMERAS)],
)
def test_degenerate_streams_are_refused_without_a_crash(frames, kind, cameras):
    """Short: each kind in some camera, and each camera; the long form has every kind in each camera."""
    for camera in CAMERAS[cameras]:
        frames = changed(frames, camera, DEGENERATE[kind])
    found = calibrate(frames)
    assert found.refused
    json.dumps(found.to_json(), allow_nan=False)


def test_device_clock_that_jumps_far_ahead(frames):
    late = [
        replace(frame, device_time_ns=frame.device_time_ns + (10**15 if i >= 500 else 0))
        for i, frame in enumerate(frames["camera_0"])
    ]
    json.dumps(calibrate({**frames, "camera_0": late}).to_json(), allow_nan=False)


def test_somebody_else_than_the_known_performer(frames, right):
    height_m = right.performer.height_m
    assert calibrate(frames, height_m=height_m + 0.05).cameras["camera_1"].verdict != "refused"
    other = calibrate(frames, height_m=height_m + 0.25).cameras["camera_1"]
    assert other.verdict == "refused"
    assert any("was measured as" in reason for reason in other.reasons)


def test_feet_under_the_floor():
    assert verdict(Facts(feet_m=0.01, performer_height_m=1.7))[0] == "good"
    word, reasons = verdict(Facts(feet_m=-0.2, performer_height_m=1.7))
    assert word == "refused"
    assert "feet 20 cm under the floor" in reasons[0]


def test_the_reference_against_itself_is_kept_for_the_record(right):
    found = right.cameras
    assert found["camera_0"].identity_error < 1e-2
    assert found["camera_1"].identity_error is None


@pytest.mark.parametrize(
    ("metres", "degrees", "word"), [(0.009, 0.4, "good"), (0.011, 0.1, "refused"), (0.005, 0.6, "refused")]
)
def test_halves_that_disagree_are_refused(metres, degrees, word):
    found, reasons = verdict(Facts(halves=Halves(metres, degrees), performer_height_m=1.7))
    assert found == word
    assert all("even and odd 5 s blocks" in reason and "walk for longer" in reason for reason in reasons)
