"""Fingers that were followed leave the studio as they are, in files of animation programs."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.engine.animation.export import export
from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.files import read_animation
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from tests.simulator.finger_figures import seen_stage

CHAINS = [
    [f"{side}Hand", *(f"{side}Hand{finger}{k}" for k in (1, 2, 3))]
    for side in ("Left", "Right")
    for finger in ("Index", "Middle", "Ring", "Pinky")
]


@pytest.fixture(scope="module")
def poses() -> Poses:
    stage = seen_stage(3.0, seed=12)
    return solve_frames(stage.frames, stage.calibration, parse_settings("finish"))


def bends(positions_m: NDArray[np.float64], names: dict[str, int]) -> NDArray[np.float64]:
    """Angles between the bones of each finger [rad], shape (F, fingers, 2): they need no axes and no unit."""
    out = []
    for chain in CHAINS:
        bones = np.diff(positions_m[:, [names[name] for name in chain]], axis=1)
        bones /= np.linalg.norm(bones, axis=-1, keepdims=True)
        out.append(np.arccos(np.clip(np.vecdot(bones[:, 1:], bones[:, :-1]), -1.0, 1.0)))
    return np.stack(out, axis=1)


@pytest.mark.parametrize("format", ["bvh", "fbx"])
def test_a_file_holds_the_bends_of_every_finger(poses: Poses, tmp_path: Path, format: str) -> None:
    own = bends(poses.positions_m, OUTPUT_INDEX)
    assert np.ptp(own, axis=0).max() > 0.5  # they move
    export(poses, tmp_path / f"take.{format}", format)
    motion = read_animation(tmp_path / f"take.{format}")
    assert isinstance(motion, Motion)
    found = bends(motion.positions_m, {name: k for k, name in enumerate(motion.joint_names)})
    assert np.abs(found[-len(own) :] - own).max() < 0.01
