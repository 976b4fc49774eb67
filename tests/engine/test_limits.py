"""Human limits for any input: random and adversarial joints in every mode of the solve, including fingers."""

from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import matrices
from studio.engine.model.frames import CameraFrame, HandSeen
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import COUPLINGS, build_humanoid
from studio.engine.model.human.ranges import dofs_of, range_rad
from studio.engine.model.human.skeleton import Skeleton, local_rotations
from studio.engine.model.joints import FINGERS, JOINT_COUNT, MIRROR, OUTPUT_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.pipeline import Pipeline
from tests.engine.switch_values import CHOICES
from tests.engine.walkers import (
    SECOND,
    arms_swinging,
    camera_frame,
    performer,
    random_q,
    site_positions,
    stage,
)

STAGE = stage(-35.0, 35.0)
SKELETON = Skeleton.of(performer())
FINGER_JOINTS = [
    f"{side}Hand{finger}{k}" for side in ("Left", "Right") for finger in FINGERS for k in (1, 2, 3)
]
MODES = [mode for mode in CHOICES["ik"] if mode != "none"]
TOLERANCE_DEG = 0.1
FRAMES = 5
UNHURRIED = {
    "deadline": None,
    "suppress_health_check": list(HealthCheck),
    "phases": (Phase.explicit, Phase.reuse, Phase.generate),
}


@cache
def body_of(flexibility):
    """The humanoid with limits of this flexibility, without fingers."""
    return build_humanoid(SKELETON, flexibility=flexibility)


def finger_bends_rad(result):
    """Bend of each finger joint [rad], by name; each turns only about its hinge."""
    local = Rotation.from_matrix(local_rotations(matrices(result.rotations_wxyz))).as_rotvec()
    bends = {}
    for name in FINGER_JOINTS:
        axis = np.array(hinge(name).axis) / np.linalg.norm(hinge(name).axis)
        turn = local[OUTPUT_INDEX[name]]
        bends[name] = float(turn @ axis)
        assert turn == pytest.approx(bends[name] * axis, abs=1e-6), name
    return bends


def hinge(name):
    return next(dof for dof in dofs_of(name) if dof.name == "bend")


def assert_within_limits(flexibility, result):
    body = body_of(flexibility)
    assert np.isfinite(result.positions_m).all() and np.isfinite(result.rotations_wxyz).all()
    q = configuration_of(body, result.positions_m[0], matrices(result.rotations_wxyz), limited=False)[7:]
    low, high = body.range_rad.T
    over = np.degrees(np.maximum(low - q, q - high))
    worst = int(over.argmax())
    assert over[worst] < TOLERANCE_DEG, (
        f"{body.model.joint(worst + 1).name}: {over[worst]:.2f} degrees beyond"
    )
    for name, bend in finger_bends_rad(result).items():
        low, high = np.degrees(range_rad(hinge(name), flexibility))
        assert low - TOLERANCE_DEG < np.degrees(bend) < high + TOLERANCE_DEG, name


def human(rng):
    """Joints of a pose at the ends of its ranges, shape (21, 3)."""
    body = body_of(1.0)
    return site_positions(body, random_q(body, rng))


KINDS = {
    "human": lambda rng, scale: human(rng),
    "noise": lambda rng, scale: arms_swinging(0.0) + rng.normal(0, scale, (JOINT_COUNT, 3)),
    "cloud": lambda rng, scale: rng.normal([0, 0, 1], scale, (JOINT_COUNT, 3)),
    "a point": lambda rng, scale: np.tile(rng.normal(0, scale, 3), (JOINT_COUNT, 1)),
    "a line": lambda rng, scale: rng.normal(0, scale, (JOINT_COUNT, 1)) * rng.normal(size=3),
    "another size": lambda rng, scale: human(rng) * scale,
    "mirrored": lambda rng, scale: human(rng)[MIRROR],
    "inside out": lambda rng, scale: human(rng) * [1, -1, 1],
    "upside down": lambda rng, scale: [0, 0, 2] - human(rng),
    "exchanged": lambda rng, scale: rng.permutation(human(rng)),
    "far": lambda rng, scale: human(rng) + 20 * scale,
}
"""Functions that make one frame's joints from a random generator and a length [m]."""

EVENTS = st.lists(
    st.tuples(
        st.sampled_from(sorted(KINDS)),
        st.floats(0.001, 5.0),
        st.sampled_from([1.0, 1.0, 0.5, 0.1]),  # share of joints that are seen
        st.sampled_from([1 / 120, 1 / 60, 1 / 30, 0.3, 12.0]),
        st.floats(0.0, 1.0),  # how open the hands are
    ),
    min_size=2,
    max_size=5,
)


def run(mode, flexibility, seed, events):
    """Results of a few frames of each event in turn; the first frames are a performer's."""
    rng, results = np.random.default_rng(seed), []
    pipeline = Pipeline(STAGE, parse_settings("studio", (f"ik={mode}", f"flexibility={flexibility}")))
    time_s, number = 1.0, 0
    for kind, scale, share, dt, opened in [("noise", 0.001, 1.0, 1 / 30, 0.0), *events]:
        for _ in range(FRAMES):
            time_s, number = time_s + dt, number + 1
            joints = KINDS[kind](rng, scale)
            joints[rng.random(JOINT_COUNT) > share] = np.nan
            hands = tuple(HandSeen(side, "shape", opened) for side in ("left", "right"))
            for name in STAGE.cameras:
                frame: CameraFrame = camera_frame(STAGE, name, time_s, joints, hands=hands)
                pipeline.add_frame(frame)
            results.append(pipeline.step(round(time_s * SECOND)))
    return [r for r in results if r is not None]


def check(mode, flexibility, seed, events):
    results = run(mode, flexibility, seed, events)
    for result in results[::2]:
        assert_within_limits(flexibility, result)


@pytest.mark.parametrize("mode", MODES)
@settings(max_examples=8, derandomize=True, **UNHURRIED)
@given(st.sampled_from([0.0, 0.5, 1.0, 2.0]), st.integers(0, 2**32 - 1), EVENTS)
def test_no_hinge_leaves_its_range(mode, flexibility, seed, events):
    check(mode, flexibility, seed, events)


@pytest.mark.long
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("mode", MODES)
@settings(max_examples=300, **UNHURRIED)
@given(st.floats(0.0, 2.0), st.integers(0, 2**32 - 1), EVENTS)
def test_no_hinge_leaves_its_range_at_length(mode, flexibility, seed, events):
    check(mode, round(flexibility, 3), seed, events)


@pytest.mark.parametrize("flexibility", [0.0, 1.0, 2.0])
def test_a_fist_is_within_the_fingers_ranges_and_keeps_their_couplings(flexibility):
    results = run("previous_pose", flexibility, 1, [("noise", 0.001, 1.0, 1 / 30, 0.0)] * 8)
    assert_within_limits(flexibility, results[-1])
    bends = finger_bends_rad(results[-1])
    for follower, (leader, share) in COUPLINGS.items():
        if "Hand" in follower:
            name = leader.removesuffix("_bend")
            assert bends[follower.removesuffix("_bend")] == pytest.approx(share * bends[name], abs=1e-6)
            assert bends[name] > 0.6 * range_rad(hinge(name), flexibility)[1], "it is a fist"
