"""Figures of several performers: one alignment, and whether everybody keeps their identity."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.metrics.reference.reference import Reference
from studio.engine.metrics.several import evaluate_several
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_OF_CANONICAL_INDEX, OUTPUT_PARENTS
from studio.engine.model.poses import Poses
from tests.engine.walkers import arms_swinging

TIMES = np.arange(0, 6, 1 / 60)


def poses(place, times=TIMES):
    """A performer who moves at a place."""
    joints = np.zeros((len(times), len(OUTPUT_JOINTS), 3))
    joints[:, OUTPUT_OF_CANONICAL_INDEX] = np.array([arms_swinging(t) for t in times])
    rotations = np.zeros((*joints.shape[:2], 4))
    rotations[..., 0] = 1.0
    ones = np.ones(joints.shape[:2])
    return Poses(times, OUTPUT_JOINTS, OUTPUT_PARENTS.copy(), joints + place, rotations, ones, np.nan * ones)


def reference(place):
    return Reference(TIMES, poses(place).positions_m[:, OUTPUT_OF_CANONICAL_INDEX])


@pytest.fixture
def references():
    return {"performer_1": reference([-1.0, 0, 0]), "performer_2": reference([1.0, 0, 0])}


def test_all_have_one_alignment(references):
    solved = {"performer_1": poses([-1.02, 0, 0.5]), "performer_2": poses([1.02, 0, 0.5])}
    found = evaluate_several(solved, references)
    assert [found["performers"][name]["mpjpe_mm"] for name in solved] == pytest.approx([20, 20], abs=0.1)
    assert found["identity_switches"] == 0 and found["missed_percent"] == found["undecided_percent"] == 0


def test_who_becomes_the_other_is_counted(references):
    first, second = poses([-1.0, 0, 0]), poses([1.0, 0, 0])
    later = TIMES[:, None, None] > 3
    glance = np.abs(TIMES - 1.0)[:, None, None] < 0.05  # too short for a change
    one, other = first.positions_m, second.positions_m
    solved = {
        "performer_1": replace(first, positions_m=np.where(later | glance, other, one)),
        "performer_2": replace(second, positions_m=np.where(later, one, other)),
    }
    assert evaluate_several(solved, references)["identity_switches"] == 2


def test_what_is_missed_and_undecided_is_counted_where_cameras_recorded(references):
    solved = {"performer_1": poses([-1.0, 0, 0]), "performer_2": poses([1.0, 0, 0], TIMES[TIMES < 4])}
    doubts = {"performer_1": [[1.0, 1.6]]}
    found = evaluate_several(solved, references, undecided_s=doubts)
    assert found["missed_percent"] == pytest.approx(100 * 2 / 12, abs=0.5)
    assert found["undecided_percent"] == pytest.approx(100 * 0.6 / 12, abs=0.2)
    found = evaluate_several(solved, references, recorded_s=[[0.0, 5.0]])
    assert found["missed_percent"] == pytest.approx(100 * 1 / 10, abs=0.5)
