"""All switches at random, together: half a second of a noisy recording, live or finished, is human and repeatable."""

from functools import cache

import numpy as np
import pytest

from studio.engine.animation.motion.torture import punches
from studio.engine.base.errors import SettingsError
from studio.engine.base.geometry import matrices
from studio.engine.model.frames import CameraFrame, HandSeen
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import CANONICAL
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from tests.engine.combinations import available
from tests.engine.switch_values import CHOICES
from tests.engine.torture import FRAMES_PER_SECOND, PERFORMER, SECOND, known_calibration, seen
from tests.refused import refused

CALIBRATION = known_calibration(2)
BEGIN_S, SECONDS = 5.5, 0.5
NAMES = ",".join(CALIBRATION.cameras)
TOLERANCE_DEG = 0.1


@cache
def recording():
    """Half a second of punches from two noisy cameras, hand states included."""
    rng, frames = np.random.default_rng(4), []
    for name, (positions, confidence) in zip(
        CALIBRATION.cameras, seen(punches(), CALIBRATION, 4), strict=True
    ):
        for k in range(int(BEGIN_S * FRAMES_PER_SECOND), int((BEGIN_S + SECONDS) * FRAMES_PER_SECOND)):
            hands = tuple(
                HandSeen(side, method, rng.random())
                for side in ("left", "right")
                for method in ("shape", "circles")
            )
            time_ns = round(k * SECOND / FRAMES_PER_SECOND)
            frames.append(CameraFrame(name, k, time_ns, positions[k], confidence[k], hands))
    return tuple(frames)


def assignments(seed):
    """A value for every switch, and effectors and limits of some joints."""
    rng = np.random.default_rng([2026, seed])
    chosen = {key: str(rng.choice(values)) for key, values in available().items() if "." not in key}
    chosen |= {
        "finish": str(rng.choice(CHOICES["finish"])),
        "cameras": str(rng.choice(["all", NAMES, *CALIBRATION.cameras])),
        "confidence_threshold": f"{0.8 * rng.random():.3f}",  # above it, hardly any joint is confident enough
        "flexibility": f"{2 * rng.random():.3f}",
        "relax_pose": f"{rng.random() if rng.random() < 0.5 else 0:.3f}",
        "bone_length_limit": "off" if rng.random() < 0.5 else f"{20 * rng.random():.2f}",
        "look_at_point_m": ",".join(f"{v:.2f}" for v in rng.normal(0, 2, 3)),
    }
    for joint in rng.choice(CANONICAL, 3, replace=False):
        for name in ("reach", "pull", "resist"):
            chosen[f"effectors.{joint}.{name}"] = f"{rng.choice([0, 1, rng.random()]):.3f}"
        chosen[f"displacement_limits_m_s.{joint}"] = f"{rng.choice([0, 0.5, 10]):.3f}"
    if chosen["ik"] == "none":  # nothing to refine, which is reported
        chosen["finish"] = "off"
    if chosen["finish"] == "off" and "physics" in chosen:  # physics corrects finished takes only
        chosen["physics"] = "off"
    return tuple(f"{key}={value}" for key, value in chosen.items())


def assert_human(poses, settings):
    assert np.isfinite(poses.positions_m).all() and np.isfinite(poses.rotations_wxyz).all()
    assert np.isfinite(poses.confidence).all()
    assert np.abs(poses.positions_m).max() < 20
    assert np.abs(np.linalg.norm(poses.rotations_wxyz, axis=2) - 1).max() < 1e-9
    if settings.ik == "none":
        return
    lengths = np.linalg.norm(Skeleton.of(PERFORMER).offsets_m, axis=1)[1:]
    bones = poses.positions_m[:, 1:] - poses.positions_m[:, poses.parents[1:]]
    assert np.abs(np.linalg.norm(bones, axis=2) - lengths).max() < 1e-9
    if settings.human_limits == "on":
        body = build_humanoid(Skeleton.of(PERFORMER), flexibility=settings.flexibility)
        low, high = body.range_rad.T
        for positions, rotations in zip(poses.positions_m[::3], poses.rotations_wxyz[::3], strict=True):
            q = configuration_of(body, positions[0], matrices(rotations), limited=False)[7:]
            over = np.degrees(np.maximum(low - q, q - high))
            worst = int(over.argmax())
            assert over[worst] < TOLERANCE_DEG, (
                f"{body.model.joint(worst + 1).name}: {over[worst]:.2f} degrees"
            )


def check(seed):
    chosen = assignments(seed)
    settings = parse_settings("studio", chosen)
    first, again = (solve_frames(recording(), CALIBRATION, settings) for _ in range(2))
    assert first.frame_count > 0.6 * SECONDS * settings.output_hz, chosen
    try:
        assert_human(first, settings)
    except AssertionError as error:
        raise AssertionError(f"{error}\nsettings: {' '.join(chosen)}") from error
    for name in ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes(), (name, chosen)


@pytest.mark.parametrize("seed", range(10))
def test_random_settings(seed):
    check(seed)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10, 440))
def test_more_random_settings(seed):
    check(seed)


def test_there_is_nothing_to_finish_without_inverse_kinematics():
    with refused(SettingsError, "settings.finish_needs_pose"):
        solve_frames(recording(), CALIBRATION, parse_settings("studio", ("ik=none", "finish=on")))
