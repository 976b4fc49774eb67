"""A guess of the front leg counts where a single camera sees the legs and the solve contradicts it by far."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.triangulation.rays import FREE_M
from studio.engine.whole_take.finish.guessed_legs import ERRS_M, add_guessed_legs
from studio.engine.whole_take.finish.measurements import Measurements, measure

FRAME_S = 1 / 30
FRAMES, GONE = 30, 15
"""The second camera sees the performer up to this frame."""

CENTRES = np.array([[4.0, 0.0, 1.0], [0.0, 4.0, 1.0]])
LEFT, RIGHT = INDEX["left_ankle"], INDEX["right_ankle"]


def body_m(apart_m: float) -> np.ndarray:
    """Joints of a person whose left ankle is this far behind the right one for the first camera, shape (21, 3)."""
    joints = np.zeros((JOINT_COUNT, 3))
    joints[:, 2] = 1.0
    joints[[LEFT, RIGHT], 2] = 0.1
    joints[[LEFT, RIGHT], 0] = -0.5 * apart_m, 0.5 * apart_m
    return joints


def measured(behind_m: float) -> Measurements:
    """Measurements of two cameras that guess the left ankle this far behind the right one."""
    positions = np.broadcast_to(body_m(0.0), (FRAMES, 2, JOINT_COUNT, 3)).copy()
    positions[GONE:, 1] = np.nan
    guess = np.zeros((FRAMES, 2, JOINT_COUNT))
    guess[:, :, LEFT], guess[:, :, RIGHT] = 0.5 * behind_m, -0.5 * behind_m
    shape = positions.shape[:3]
    found = measure(positions, np.ones(shape), np.zeros(shape[:2]), CENTRES, np.full(2, FREE_M), guess)
    return found.alone_for_less(FRAME_S)


def pull(apart_m: float, behind_m: float) -> np.ndarray:
    """The contribution of the guess at each frame and joint, shape (30, 21, 3)."""
    weight, out = np.zeros((FRAMES, JOINT_COUNT, 3, 3)), np.zeros((FRAMES, JOINT_COUNT, 3))
    sites = np.broadcast_to(body_m(apart_m), out.shape)
    add_guessed_legs(weight, out, sites, measured(behind_m), 1.0)
    moved = np.linalg.norm(weight, axis=(2, 3)) > 0.0
    assert (moved == (np.linalg.norm(out, axis=2) > 0.0)).all()
    return out


def test_legs_that_the_guess_has_the_other_way_round_are_drawn_to_it():
    drawn = pull(0.5, -0.4)
    alone = slice(GONE + 4, None)
    assert not drawn[: GONE - 4].any()  # two cameras give the depth
    assert (drawn[alone, LEFT, 0] > 0.0).all() and (drawn[alone, RIGHT, 0] < 0.0).all()
    assert set(np.flatnonzero(drawn.any(axis=(0, 2)))) == {LEFT, RIGHT}


@pytest.mark.parametrize("error_m", [0.1 - ERRS_M, ERRS_M - 0.1])
def test_what_a_guess_usually_errs_by_counts_for_nothing(error_m):
    assert not pull(0.3, 0.3 + error_m).any()
