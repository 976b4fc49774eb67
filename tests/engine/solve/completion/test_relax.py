"""Relax pose: part of the way to the middle of each range, on the floor, within the limits."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX
from studio.engine.solve.completion.relax import RelaxPose
from tests.engine.walkers import humanoid, random_q, site_positions

BODY = humanoid()
FEET = [INDEX[f"{side}_{name}"] for side in ("left", "right") for name in ("ankle", "toe")]


def test_the_weight_is_the_share_of_the_way_to_the_middle():
    q = random_q(BODY, np.random.default_rng(1))
    middle = BODY.range_rad.mean(axis=1)
    assert RelaxPose(BODY, 0.0).apply(q) == pytest.approx(q)
    assert RelaxPose(BODY, 1.0).apply(q)[7:] == pytest.approx(middle)
    assert RelaxPose(BODY, 0.1).apply(q)[7:] == pytest.approx(0.9 * q[7:] + 0.1 * middle)


@pytest.mark.parametrize("weight", [0.1, 0.5, 1.0])
def test_the_lower_foot_keeps_its_height_and_the_hips_their_place_above_it(weight):
    rng = np.random.default_rng(2)
    for q in (BODY.rest_qpos, random_q(BODY, rng), random_q(BODY, rng)):
        before = q.copy()
        out = RelaxPose(BODY, weight).apply(q)
        assert np.array_equal(q, before), "the input is not changed"
        assert np.array_equal(np.delete(out[:7], 2), np.delete(q[:7], 2))
        low = [site_positions(BODY, each)[FEET, 2].min() for each in (q, out)]
        assert low[0] == pytest.approx(low[1], abs=1e-9)


def test_it_stays_within_the_limits_and_keeps_bones():
    rng, (low, high) = np.random.default_rng(3), BODY.range_rad.T
    bones = [(INDEX[f"left_{a}"], INDEX[f"left_{b}"]) for a, b in (("knee", "ankle"), ("elbow", "wrist"))]
    stance = site_positions(BODY, BODY.rest_qpos)
    for weight in (0.1, 0.5, 1.0):
        out = RelaxPose(BODY, weight).apply(random_q(BODY, rng))
        assert (out[7:] >= low).all() and (out[7:] <= high).all()
        joints = site_positions(BODY, out)
        for a, b in bones:
            assert np.linalg.norm(joints[a] - joints[b]) == pytest.approx(
                np.linalg.norm(stance[a] - stance[b])
            )
