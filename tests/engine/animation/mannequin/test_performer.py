"""The mannequin of poses, including imported animations that lack joints of the output skeleton."""

import numpy as np
import pytest

from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.poses import Poses, on_output_joints
from tests.poses_factory import random_poses

_LACKING = ("Spine", "Neck", "LeftShoulder", "RightShoulder")


def lacking(poses: Poses, fingers: tuple[str, ...]) -> Poses:
    """Poses without part of the spine, the clavicles, and most fingers."""
    kept = [
        index for index, name in enumerate(OUTPUT_JOINTS)
        if name not in _LACKING and (name.partition("Hand")[2] in ("", *fingers))
    ]  # fmt: skip
    joints = [getattr(poses, name)[:, kept] for name in
              ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")]  # fmt: skip
    names = tuple(OUTPUT_JOINTS[index] for index in kept)
    return Poses(poses.time_s, names, np.full(len(kept), -1), *joints, poses.root_height_m)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("fingers", [(), ("Index1",), ("Thumb1", "Index1")])
def test_an_animation_without_fingers_has_a_body(body: str, fingers: tuple[str, ...]) -> None:
    poses = on_output_joints(lacking(random_poses(np.random.default_rng(1), seconds=0.5), fingers))
    mannequin = Mannequin.of(poses, body)
    vertices, normals = mannequin.posed(poses.positions_m[0], poses.rotations_wxyz[0])
    assert np.isfinite(vertices).all() and np.isfinite(normals).all()
    hips = poses.positions_m[0, OUTPUT_INDEX["Hips"]]
    assert 0.6 < np.abs(vertices - hips).max() < 1.3
