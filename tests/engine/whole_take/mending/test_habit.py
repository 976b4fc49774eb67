"""Where the end of a limb usually is, told by the rest of the limb."""

import numpy as np

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.habit import habit

COUNT, FIRST, LAST = 150, 60, 95
ANKLE, KNEE, HIP = (INDEX[f"left_{name}"] for name in ("ankle", "knee", "hip"))


def test_what_the_rest_of_the_limb_tells_is_used_and_what_it_does_not_tell_is_not():
    """A shank swings as its thigh does, or on its own."""
    time_s, rng = STEP_S * np.arange(COUNT), np.random.default_rng(3)
    swing = 0.5 * np.sin(2.0 * np.pi * time_s / 0.9)
    middle = np.zeros((COUNT, JOINT_COUNT, 3))
    middle[:, KNEE, 1], middle[:, KNEE, 2] = 0.4 * np.sin(swing), -0.4 * np.cos(swing)
    middle[:, :, 2] += 0.9
    middle += 0.005 * rng.normal(size=middle.shape)
    axes = np.tile(np.eye(3), (COUNT, 1, 1))
    alone = 0.4 * np.array([np.sin(1.7 * time_s**2), 0.0 * time_s, 0.0 * time_s]).T
    follows = middle[:, KNEE] - middle[:, HIP]
    for away, told in ((follows, True), (alone, False)):
        seen = away + 0.005 * rng.normal(size=away.shape)
        seen[FIRST:LAST] = np.nan
        pinned = np.arange(COUNT) == (FIRST + LAST) // 2
        found = habit(middle, seen, pinned, ANKLE, axes)
        assert found.path_m.any() == told
        if told:
            path = np.einsum("tab,tb->ta", found.axes, found.path_m)
            assert np.linalg.norm(path - away, axis=1)[FIRST:LAST].mean() < 0.03
