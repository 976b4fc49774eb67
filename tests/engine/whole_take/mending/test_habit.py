"""The usual place of the end of a limb, predicted from the rest of the limb."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.habit import habit

COUNT, FIRST, LAST = 150, 60, 95
ANKLE, KNEE = INDEX["left_ankle"], INDEX["left_knee"]


@pytest.mark.parametrize("follows", [True, False])
def test_a_shank_that_swings_as_its_thigh_does_is_found_and_one_that_does_not_goes_through_its_pin(
    follows: bool,
):
    """The thighs swing in turn; the shanks swing either like the thighs or in their own way."""
    time_s, rng = STEP_S * np.arange(COUNT), np.random.default_rng(3)
    middle = np.zeros((COUNT, JOINT_COUNT, 3))
    for side, phase in (("left", 0.0), ("right", np.pi)):
        swing = 0.5 * np.sin(2.0 * np.pi * time_s / 0.9 + phase)
        own = swing if follows else np.sin(1.7 * time_s**2 + phase)
        for angle, name, before in ((swing, "knee", "hip"), (own, "ankle", "knee")):
            bone = 0.4 * np.stack([0.0 * angle, np.sin(angle), -np.cos(angle)], axis=1)
            middle[:, INDEX[f"{side}_{name}"]] = middle[:, INDEX[f"{side}_{before}"]] + bone
    middle[:, :, 2] += 0.9
    away = middle[:, ANKLE] - middle[:, KNEE]
    middle += 0.005 * rng.normal(size=middle.shape)
    seen = away + 0.005 * rng.normal(size=away.shape)
    seen[FIRST:LAST] = np.nan
    pinned = np.arange(COUNT) == (FIRST + LAST) // 2
    axes = np.tile(np.eye(3), (COUNT, 1, 1))
    found = habit(middle, seen, pinned, away + np.array([0.0, 0.0, 0.01]), ANKLE, axes)
    path = np.einsum("tab,tb->ta", found.axes, found.path_m)
    off = np.linalg.norm(path - away, axis=1)
    assert off[pinned] == pytest.approx(0.01, abs=0.01)  # it goes through the pin, which is 1 cm off
    unseen = off[FIRST:LAST].mean()
    if follows:
        assert unseen < 0.02
    else:  # nothing shows where it is; it is no further off than its bone is long
        assert 0.1 < unseen < 0.4


def test_where_the_end_is_never_seen_nothing_is_told():
    middle, axes = np.zeros((COUNT, JOINT_COUNT, 3)), np.tile(np.eye(3), (COUNT, 1, 1))
    pinned = np.arange(COUNT) == FIRST
    found = habit(middle, np.full((COUNT, 3), np.nan), pinned, np.ones((COUNT, 3)), ANKLE, axes)
    assert not found.path_m.any()
