"""The character's body: of the performer's proportions, another one where the performer is another."""

import numpy as np

from studio.engine.animation.mannequin.performer import bone_offsets, rest_positions
from studio.engine.base.geometry import matrices, quaternions
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_PARENTS
from studio.web.scene.performers.character import Proportions
from tests.review.render.figures import t_pose


def turned(positions: np.ndarray, joint: str, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pose with one joint, and all below it, turned about it."""
    root = OUTPUT_INDEX[joint]
    below = [j for j in range(len(positions)) if root in ancestors(j)]
    moved, rotations = positions.copy(), np.tile(np.eye(3), (len(positions), 1, 1))
    moved[below] = positions[root] + (positions[below] - positions[root]) @ R.T
    rotations[below] = R
    return moved, quaternions(rotations)


def ancestors(joint: int) -> list[int]:
    return [joint] if OUTPUT_PARENTS[joint] < 0 else [joint, *ancestors(int(OUTPUT_PARENTS[joint]))]


def test_bones_are_those_of_the_t_pose_in_any_pose() -> None:
    positions, wxyz = t_pose()
    R = matrices(np.array([0.5, 0.5, -0.5, 0.5]))
    posed = turned(positions, "LeftForeArm", R)
    assert np.allclose(bone_offsets(*posed), bone_offsets(positions, wxyz), atol=1e-9)
    rest = rest_positions(bone_offsets(*posed))
    assert np.allclose(rest - rest[0], positions - positions[0], atol=1e-9)


def test_another_performer_gets_another_body_at_once() -> None:
    positions, wxyz = t_pose()
    offsets = bone_offsets(positions, wxyz)
    proportions = Proportions()
    assert np.array_equal(proportions.another(offsets), offsets)
    assert proportions.another(offsets) is None
    assert proportions.another(1.2 * offsets) is None  # one pose does not make a rigid skeleton
    assert np.array_equal(proportions.another(1.2 * offsets), 1.2 * offsets)


def test_bones_that_change_all_the_time_have_their_mean() -> None:
    rng = np.random.default_rng(4)
    positions, wxyz = t_pose()
    offsets = bone_offsets(positions, wxyz)
    proportions = Proportions()
    bodies = [proportions.another(offsets + rng.normal(0, 0.01, offsets.shape)) for _ in range(300)]
    made = [body for body in bodies if body is not None]
    assert len(made) <= 3
    assert np.abs(made[-1] - offsets).max() < 0.02
