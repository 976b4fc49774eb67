"""Performers make room for one another, and hands that hold each other meet."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX
from studio.engine.whole_take.finish.contact.others import (
    OtherBodies,
    OtherPerformer,
    Surfaces,
    hands_apart_m,
    holding,
    meet,
    overlap_m,
)
from studio.engine.whole_take.finish.trajectory import Kinematics, moved
from tests.engine.walkers import humanoid

DT = 1 / 60
BEHIND = np.array([0.0, 0.17, 0.0])
NOBODY_HOLDS = np.zeros((1, 2, 2), dtype=bool)


@pytest.fixture(scope="module")
def body():
    return humanoid()


def standing(body):
    """A configuration at rest and its joints, for one frame."""
    q = body.rest_qpos[None].copy()
    return q, Kinematics(body).sites(q)


def surfaces(body, sites):
    return Surfaces(np.arange(len(sites)) * round(1e9 * DT), sites, body.skeleton.height_m)


def stepped(body, q, other):
    """A configuration after one Gauss-Newton step of these rows alone."""
    _, rows, residuals = OtherBodies(body.skeleton.height_m).rows(q, Kinematics(body), other)
    normal = rows.T @ rows + 3.0 * np.eye(rows.shape[1])
    return moved(q, np.linalg.solve(normal, rows.T @ residuals)[None])


def test_who_stands_in_another_goes_half_of_the_way(body):
    q, sites = standing(body)
    there = sites + BEHIND
    before = overlap_m(surfaces(body, sites), surfaces(body, there))[0]
    after_q = stepped(body, q, OtherPerformer(there, body.skeleton.height_m, NOBODY_HOLDS))
    after = overlap_m(surfaces(body, Kinematics(body).sites(after_q)), surfaces(body, there))[0]
    assert before > 0.02 and 0.3 * before < after < 0.9 * before
    assert after_q[0, 1] < q[0, 1]  # away from the other


def test_who_is_apart_or_away_stays(body):
    q, sites = standing(body)
    for there in (sites + 6.0 * BEHIND, sites + 30.0 * BEHIND, np.full_like(sites, np.nan)):
        other = OtherPerformer(there, body.skeleton.height_m, NOBODY_HOLDS)
        assert (stepped(body, q, other) == q).all()
        assert overlap_m(surfaces(body, sites), surfaces(body, there))[0] == 0.0


def test_hands_that_hold_meet(body):
    q, sites = standing(body)
    left, right = (sites[0, INDEX[f"{side}_hand"]] for side in ("left", "right"))
    there = sites + (left - right) + [0.12, 0.0, 0.0]  # their right hand is next to the left one
    holds = NOBODY_HOLDS.copy()
    holds[0, 0, 1] = True
    after = Kinematics(body).sites(stepped(body, q, OtherPerformer(there, body.skeleton.height_m, holds)))
    far, near = (hands_apart_m(one, there)[0, 0, 1] for one in (sites, after))
    assert far > 0.09 and near < 0.85 * far


@pytest.mark.parametrize(("seconds", "holds"), [(1.0, True), (0.3, False)])
def test_hands_hold_that_stay_together(body, seconds, holds):
    """A blow and passing hands do not count as holding."""
    sites = np.repeat(standing(body)[1], 120, axis=0)
    left, right = (sites[0, INDEX[f"{side}_hand"]] for side in ("left", "right"))
    there = sites + (left - right) + [0.5, 0.0, 0.0]
    touching = slice(30, 30 + round(seconds / DT))
    there[touching] -= [0.46, 0.0, 0.0]
    found = holding(sites, there, DT)
    assert found[touching, 0, 1].all() == holds and found.any() == holds
    assert not found[:, 1].any() and not found[100:].any()


def test_others_are_met_at_the_same_times(body):
    sites = np.repeat(standing(body)[1], 10, axis=0)
    sites[:, :, 0] += np.arange(10)[:, None]
    own, later = surfaces(body, sites), surfaces(body, sites[4:])
    later = Surfaces(own.times_ns[4:] + 1000, later.sites, later.height_m)
    met = meet(own, later, DT).sites
    assert np.isnan(met[:4]).all() and (met[4:] == sites[4:]).all()
