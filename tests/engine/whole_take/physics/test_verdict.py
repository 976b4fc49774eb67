"""The corrected motion is kept where its measure is better, and nowhere else."""

import numpy as np

from studio.engine.whole_take.physics.measure import PhysicsFigures
from studio.engine.whole_take.physics.verdict import kept, strays
from tests.engine.whole_take.physics.trajectories import DT

FRAMES = 240
NEVER = np.zeros(FRAMES, dtype=bool)


def figures(force_n=100.0, slide_m_s=0.0, sunk_m=0.0):
    full = [
        np.broadcast_to(np.asarray(v, dtype=float), (FRAMES,)) for v in (force_n, 0.0, 0.0, slide_m_s, sunk_m)
    ]
    return PhysicsFigures(*full)


def test_better_throughout_is_kept_throughout_and_worse_nowhere():
    assert (kept(figures(100.0), figures(50.0), NEVER, DT) == 1.0).all()
    assert (kept(figures(100.0), figures(150.0), NEVER, DT) == 0.0).all()
    assert (kept(figures(100.0), figures(100.0), NEVER, DT) == 0.0).all()


def test_sliding_and_sinking_are_not_bought():
    assert not kept(figures(), figures(50.0, slide_m_s=0.01), NEVER, DT).any()
    assert not kept(figures(), figures(50.0, sunk_m=0.01), NEVER, DT).any()


def test_a_sole_that_sinks_for_a_moment_is_not_kept():
    share = kept(figures(), figures(50.0, sunk_m=0.006 * (np.arange(FRAMES) == 120)), NEVER, DT)
    assert share[120] == 0.0 and share[0] == 1.0


def test_only_the_better_part_is_kept_and_gone_over_to_smoothly():
    half = np.arange(FRAMES) < FRAMES // 2
    share = kept(figures(100.0), figures(np.where(half, 50.0, 200.0)), NEVER, DT)
    assert (share[: FRAMES // 2 - 40] == 1.0).all() and (share[FRAMES // 2 :] == 0.0).all()
    assert np.abs(np.diff(share)).max() < 0.12


def test_where_a_joint_has_strayed_nothing_is_kept():
    strayed = np.arange(FRAMES) == 120
    share = kept(figures(100.0), figures(50.0), strayed, DT)
    assert share[120] == 0.0 and share[0] == 1.0 and share[-1] == 1.0


def test_a_joint_strays_beyond_its_uncertainty_only():
    seen, sigma = np.zeros((3, 21, 3)), np.full((3, 21), 0.01)
    before, after = np.zeros((3, 21, 3)), np.zeros((3, 21, 3))
    after[1, 4, 0], after[2, 4, 0] = 0.03, 0.06
    assert strays(before, after, seen, sigma).tolist() == [False, False, True]
    seen[2, 4] = np.nan
    assert not strays(before, after, seen, sigma).any()
