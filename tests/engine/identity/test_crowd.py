"""Bodies are assigned to persons by position and motion, whatever number a device gives them."""

import numpy as np
import pytest

from studio.engine.identity.crowd import Crowd
from studio.engine.model.joints import MIRROR
from tests.engine.walkers import arms_swinging

RATE_HZ = 90.0
"""Frames a second of three cameras."""

GHOST = np.array([0.0, 0.2, 0.0])
UNSEEN = np.full((21, 3), np.nan)


def at(time_s, x, y=0.0, size=1.0):
    """A body of a size whose hips are at a place."""
    return size * arms_swinging(time_s) + [x, y, 0.0]


def passed(crowd, shown, until_s, since_s=0.0, noise_m=0.02):
    """Add the bodies that `shown(time_s)` returns, each with a name, in any order; return each name's persons."""
    rng, became = np.random.default_rng(1), {}
    for k in range(round(since_s * RATE_HZ), round(until_s * RATE_HZ)):
        bodies = shown(k / RATE_HZ)
        order = rng.permutation(len(bodies))
        joints = np.array([bodies[i][1] for i in order]).reshape(-1, 21, 3)
        found = crowd.add(k / RATE_HZ, joints + noise_m * rng.normal(size=joints.shape))
        for i, who in zip(order, found, strict=True):
            became.setdefault(bodies[i][0], []).append(who)
    return became


def known(became):
    """The persons that each name became, without the frames in which it was unknown."""
    return {name: set(who) - {None} for name, who in became.items()}


def test_two_who_change_places_stay_themselves():
    def shown(time_s):
        side = -1.0 + 0.8 * time_s
        return [("a", at(time_s, side, -0.25)), ("b", at(time_s + 1, -side, 0.25))]

    crowd = Crowd()
    became = known(passed(crowd, shown, 2.5))
    assert sorted(map(tuple, became.values())) == [(0,), (1,)] and len(crowd.people) == 2
    assert all(len(one.sightings) == 225 for one in crowd.people)  # also those of before they were known


def test_who_is_hidden_for_a_while_is_the_same_again():
    def shown(time_s):
        both = [("a", at(time_s, -0.5)), ("b", at(time_s, 0.5 + 0.3 * time_s))]
        return both[:1] if 1.0 < time_s < 1.6 else both

    assert known(passed(Crowd(), shown, 3.0)) in ({"a": {0}, "b": {1}}, {"a": {1}, "b": {0}})


def test_exchanged_sides_do_not_make_another_person():
    def shown(time_s):
        body = at(time_s, 0.0)
        return [("a", body[MIRROR] if round(time_s * 30) % 3 == 0 else body)]

    crowd = Crowd()
    assert known(passed(crowd, shown, 2.0)) == {"a": {0}} and len(crowd.people) == 1


def test_a_device_s_second_body_of_one_person_is_nobody():
    def shown(time_s):
        body = at(time_s, 0.0)
        return [("a", body), ("ghost", body + GHOST)] if time_s > 1 else [("a", body)]

    crowd = Crowd()
    became = known(passed(crowd, shown, 3.0))
    assert became["a"] | became["ghost"] == {0} and len(crowd.people) == 1
    assert len(crowd.people[0].sightings) == 270  # one of each frame


def test_a_leap_of_both_leaves_them_themselves():
    """Example: the recording was cut. Nothing after the cut is lost."""

    def shown(time_s):
        leap = 0.5 if time_s >= 1.5 else 0.0
        return [("a", at(time_s, -0.9 + leap)), ("b", at(time_s, 0.9 + leap))]

    crowd = Crowd()
    passed(crowd, shown, 3.0)
    assert len(crowd.people) == 2
    assert [len(one.sightings) for one in crowd.people] == [270, 270]


@pytest.mark.parametrize(("size", "people"), [(1.0, 2), (0.8, 3)])
def test_who_comes_back_is_known_by_their_bones(size, people):
    def shown(time_s):
        two = [("a", at(time_s, -1.0)), ("b", at(time_s, 0.5))]
        if time_s < 1.5:
            return two
        return two[:1] if time_s < 4.0 else [two[0], ("back", at(time_s, 1.5, 1.0, size))]

    crowd = Crowd()
    became = known(passed(crowd, shown, 6.5))
    assert len(crowd.people) == people and len(became["back"]) == 1
    assert (became["back"] == became["b"]) == (people == 2)


def test_a_wild_body_just_before_somebody_is_lost_does_not_become_their_bones():
    """A device that loses a body first shows it elsewhere and distorted."""

    def shown(time_s):
        bodies = [("a", at(time_s, -1.0)), ("b", at(time_s, 0.5, 0.0, 0.9))]
        if 3.0 <= time_s < 3.2:
            return [bodies[0], ("wild", at(time_s, 1.3, 0.3, 1.3))]
        return (
            bodies if time_s < 3.0 else [] if time_s < 6.0 else [("a2", bodies[0][1]), ("b2", bodies[1][1])]
        )

    crowd = Crowd()
    became = known(passed(crowd, shown, 9.0))
    assert len(crowd.people) == 2
    assert (became["a2"], became["b2"]) == (became["a"], became["b"])


@pytest.mark.parametrize("size", [1.0, 0.8])
def test_whoever_of_two_comes_back_first_is_themselves_or_in_doubt(size):
    """Nothing distinguishes twins: it takes longer until one is identified, and then the identity is in doubt."""

    def shown(time_s):
        if time_s < 2.0:
            return [("a", at(time_s, -1.0)), ("b", at(time_s, 0.5, 0.0, size))]
        return [] if time_s < 5.0 else [("back", at(time_s, 0.5, 1.0, size))]

    crowd, twins = Crowd(), size == 1.0
    became = passed(crowd, shown, 8.0)
    unknown_s = became["back"].index(next(who for who in became["back"] if who is not None)) / RATE_HZ
    assert len(crowd.people) == 2 and unknown_s == pytest.approx(2.0 if twins else 1.0, abs=0.1)
    (who,) = known(became)["back"]
    assert bool([one for one in crowd.people[who].doubted if one > 6.0]) == twins
    assert twins or {who} == known(became)["b"]


def test_two_in_one_place_are_told_as_doubted():
    def shown(time_s):
        side = max(0.6 - 0.5 * time_s, 0.0)
        return [("a", at(0.0, -side)), ("b", at(0.0, side))]

    crowd = Crowd()
    passed(crowd, shown, 2.5, noise_m=0.05)
    assert all(one.doubted and one.doubted[0] > 0.5 for one in crowd.people)


def test_nine_people_are_nine():
    def shown(time_s):
        return [(str(k), at(time_s + k, 0.9 * (k % 3), 0.9 * (k // 3))) for k in range(9)]

    became = known(passed(Crowd(), shown, 1.0))
    assert sorted(next(iter(who)) for who in became.values()) == list(range(9))


@pytest.mark.parametrize("bodies", [np.zeros((0, 21, 3)), UNSEEN[None], np.stack([UNSEEN, UNSEEN])])
def test_nothing_seen_is_nobody(bodies):
    crowd = Crowd()
    for k in range(60):
        assert crowd.add(k / RATE_HZ, bodies) == [None] * len(bodies)
    assert crowd.people == []
