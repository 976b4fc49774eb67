"""Fingers that follow landmarks: angles are recovered, unseen hands stay as they are, ranges hold."""

import numpy as np
import pytest

from studio.engine.base.geometry import rotation_xyz
from studio.engine.model.frames import FrameSet
from studio.engine.model.human.hand import HINGES, SIDES, STATE, WRIST, HandModel
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.completion.finger_kernels import hand_points
from studio.engine.solve.completion.fingers import Fingers, arm_of, hand_models
from studio.engine.solve.completion.followed import FollowedSmoother
from studio.engine.solve.completion.hand_follower import SPREADS
from tests.engine.walkers import performer

DT = 1.0 / 60.0
SETTINGS = parse_settings("studio")
SKELETON = Skeleton.of(performer())
MODELS = hand_models(SKELETON, SETTINGS)
CENTRES = np.array([[0.0, -2.5, 1.2], [-2.0, -1.5, 1.5], [2.0, -1.5, 1.8]])


def body(bend: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Positions and world rotations of a standing body, turned and with a bent wrist."""
    rotations = np.tile(rotation_xyz(0.0, 0.0, 0.3), (len(SKELETON.offsets_m), 1, 1))
    for model in MODELS:
        _, fore, hand = model.arm
        rotations[fore] = rotations[fore] @ rotation_xyz(0.2, 0.0, 0.0)
        rotations[hand] = rotations[fore] @ rotation_xyz(0.0, bend * model.wrist_axes[1, 1], 0.0)
        rotations[model.joints] = rotations[hand]
    return forward_positions(SKELETON, np.array([0.0, 0.0, 0.95]), rotations), rotations


def points_of(model: HandModel, state: np.ndarray) -> np.ndarray:
    """Landmarks of a hand in a state at the body's wrist, shape (21, 3)."""
    arm = arm_of(model, *body(), None)
    chain = model.offsets_m, model.axes, model.places, model.ratios, model.wrist_axes
    return hand_points(state, arm.forearm, arm.wrist_m, *chain)[0]


def frames(points: np.ndarray | None, *, exchanged: int | None = None) -> FrameSet:
    """Observations of both hands' landmarks, shape (2, 21, 3); `exchanged`: a camera with sides exchanged."""
    rays = None
    if points is not None:
        away = points[None] - CENTRES[:, None, None]
        rays = CENTRES[:, None, None] + away / np.linalg.norm(away, axis=-1, keepdims=True)
        if exchanged is not None:
            rays[exchanged] = rays[exchanged, ::-1]
    unseen = np.full((3, JOINT_COUNT, 3), np.nan)
    names = ("a", "b", "c")
    return FrameSet(
        0, names, unseen, np.zeros((3, JOINT_COUNT)), CENTRES, rays=np.ones(3, bool), hand_rays=rays
    )


def states(seed: int) -> list[np.ndarray]:
    """A pose of both hands within their ranges."""
    rng = np.random.default_rng(seed)
    out = []
    for model in MODELS:
        state = np.zeros(STATE)
        low, high = model.low[HINGES], model.high[HINGES]
        state[HINGES] = low + rng.uniform(0.2, 0.7, len(low)) * (high - low)
        state[WRIST] = arm_of(model, *body(), None).resting[WRIST] + rng.normal(0.0, 0.1, 3)
        out.append(state)
    return out


def followed(seen: list[FrameSet]) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations of the body after the fingers followed some frames."""
    fingers = Fingers(MODELS)
    positions, rotations = body()
    for one in seen:
        positions, rotations = body()
        fingers.turn(rotations, fingers.follow_states(positions, rotations, one, None, DT))
    return forward_positions(SKELETON, positions[0], rotations), rotations


@pytest.mark.parametrize("exchanged", [None, 1])
@pytest.mark.parametrize("seed", range(5))
def test_the_fingers_of_seen_hands_are_found(seed: int, exchanged: int | None) -> None:
    true = states(seed)
    points = np.array([points_of(model, state) for model, state in zip(MODELS, true, strict=True)])
    found, _ = followed([frames(points, exchanged=exchanged)] * 30)
    for k, model in enumerate(MODELS):
        joints = [1 + 4 * finger + n for finger in range(5) for n in range(3)]
        off = np.linalg.norm(found[model.joints.ravel()] - points[k, joints], axis=1)
        assert off.mean() < 0.004 and off.max() < 0.012


def test_hands_that_no_camera_sees_stay_as_they_are() -> None:
    positions, rotations = body()
    found = followed([frames(None)] * 3)
    assert np.array_equal(found[1], rotations)
    assert np.array_equal(found[0], forward_positions(SKELETON, positions[0], rotations))


def test_a_hand_that_is_no_longer_seen_comes_to_rest() -> None:
    true = states(3)
    points = np.array([points_of(model, state) for model, state in zip(MODELS, true, strict=True)])
    _, rotations = followed([frames(points)] * 10 + [frames(None)] * 150)
    assert np.abs(rotations - body()[1]).max() < 0.02


def test_ranges_hold_whatever_is_seen() -> None:
    rng = np.random.default_rng(1)
    flat = np.array([points_of(model, np.zeros(STATE)) for model in MODELS])
    wild = [frames(flat + rng.normal(0.0, 0.05, (2, 21, 3))) for _ in range(20)]
    fingers = Fingers(MODELS)
    for one in wild:
        for model, state in zip(MODELS, fingers.follow_states(*body(), one, None, DT), strict=True):
            assert (
                state is not None and (state >= model.low - 1e-9).all() and (state <= model.high + 1e-9).all()
            )


def test_smoothing_bridges_a_gap() -> None:
    still, bent = np.zeros(STATE), np.zeros(STATE)
    bent[HINGES] = 0.8 * np.minimum(MODELS[0].high[HINGES], 1.0)
    smoother = FollowedSmoother(SKELETON, SETTINGS)
    courses = [*np.linspace(0.0, 1.0, 60)]
    for k, share in enumerate(courses):
        state = still + share * (bent - still)
        points = np.array([points_of(model, state) for model in MODELS])
        smoother.add(*body(), frames(None if 25 <= k < 35 else points), DT)
    found = smoother.smoothed(60)
    middle = found[30].hands[0]
    assert middle is not None and len(found) == 60
    closing = [HINGES.start + 4 + 3 * finger for finger in range(4)]
    assert np.abs(middle[closing] - courses[30] * bent[closing]).max() < 0.15


@pytest.mark.parametrize("side", SIDES)
def test_the_jacobian_is_that_of_the_points(side: str) -> None:
    model = MODELS[SIDES.index(side)]
    arm = arm_of(model, *body(), None)
    chain = model.offsets_m, model.axes, model.places, model.ratios, model.wrist_axes
    state = states(7)[SIDES.index(side)]
    jacobian = hand_points(state, arm.forearm, arm.wrist_m, *chain)[1]
    for n in range(STATE):
        step = np.zeros(STATE)
        step[n] = 1e-6
        ends = [hand_points(state + sign * step, arm.forearm, arm.wrist_m, *chain)[0] for sign in (1, -1)]
        assert np.abs((ends[0] - ends[1]) / 2e-6 - jacobian[:, :, n]).max() < 1e-6


def test_the_state_has_a_usual_spread_everywhere() -> None:
    assert (SPREADS > 0.0).all()
