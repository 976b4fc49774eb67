"""Persons whose bones show that they were exchanged are exchanged back over the whole take."""

import numpy as np
import pytest

from studio.engine.identity.crowd import SeenBody, Someone
from studio.engine.identity.person import FollowedPerson
from studio.engine.identity.settle import settle
from tests.engine.walkers import standing

FRAMES = 600
TIMES = np.arange(FRAMES) / 60


def two(swaps_from, *, met_s=(5.0,), leapt_s=()):
    """Two persons, body 0 and body 1 of every frame, exchanged from one frame on."""
    people = []
    for who in range(2):
        one = Someone(FollowedPerson(0.0, standing()))
        one.sightings = [SeenBody(f, who if f < swaps_from else 1 - who) for f in range(FRAMES)]
        one.met = {1 - who: list(met_s)}
        one.leapt = list(leapt_s)
        people.append(one)
    return people


def bones(apart_m, noise_m=0.01):
    """Bones of two bodies whose lengths differ; one in ten is unseen."""
    rng = np.random.default_rng(1)
    lengths = 0.3 + rng.normal(0, noise_m, (FRAMES, 2, 21)) + apart_m * np.array([0.0, 1.0])[:, None]
    lengths[rng.random(lengths.shape) < 0.1] = np.nan
    return lambda body: lengths[body.frame, body.body]


def bodies(people):
    return [{(b.frame >= 300, b.body) for b in one.sightings} for one in people]


@pytest.mark.parametrize("moment", [{"met_s": (4.9, 5.1)}, {"met_s": (), "leapt_s": (5.0,)}])
def test_exchanged_persons_are_given_back(moment):
    people = two(300, **moment)
    assert settle(people, TIMES, bones(0.03)) == 1
    assert bodies(people) == [{(False, 0), (True, 0)}, {(False, 1), (True, 1)}]


def test_who_was_not_exchanged_stays():
    people = two(FRAMES)
    assert settle(people, TIMES, bones(0.03)) == 0
    assert bodies(people) == [{(False, 0), (True, 0)}, {(False, 1), (True, 1)}]


def test_twins_stay_as_they_were_followed():
    people = two(300)
    assert settle(people, TIMES, bones(0.0)) == 0
    assert bodies(people)[0] == {(False, 0), (True, 1)}


def test_who_never_met_is_not_looked_at():
    def never(body):
        raise AssertionError(body)

    assert settle(two(300, met_s=()), TIMES, never) == 0
