"""When feet stand, found in a smooth pass over the take."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from studio.engine.whole_take.finish.contact.contacts import find_contacts, wander_of
from studio.engine.whole_take.finish.contact.places import CHANGE_M2_S, EASE_S, places_of

REST_M = np.array([0.08, 0.02, 0.08, 0.02])
STANDING = np.array([[0.1, 0.0, 0.08], [0.1, -0.15, 0.02], [-0.1, 0.0, 0.08], [-0.1, -0.15, 0.02]])


def test_a_stance_at_the_ends_of_a_take_is_one():
    """A foot that stands from the first frame to the last is held in all of them."""
    contacts = find_contacts(np.tile(STANDING, (60, 1, 1)), [(0, 60)], 1 / 60, REST_M)
    assert (contacts.hold == 1.0).all()
    assert contacts.floor_m == 0.0


def test_a_jump_is_no_stance():
    feet = np.tile(STANDING, (120, 1, 1))
    feet[40:80, :, 2] += 0.3 * np.sin(np.linspace(0, np.pi, 40))[:, None]
    hold = find_contacts(feet, [(0, 120)], 1 / 60, REST_M).hold
    assert (hold[:35] > 0).all() and (hold[85:] > 0).all()
    assert not hold[45:75].any()


def test_noise_that_lifts_a_standing_toe_for_a_moment_ends_no_stance():
    feet = np.tile(STANDING, (240, 1, 1))
    feet[100:112, 1, 2] += 0.05 * np.sin(np.linspace(0, np.pi, 12))
    assert (find_contacts(feet, [(0, 240)], 1 / 60, REST_M).hold > 0).all()


def test_a_foot_that_seems_to_wander_stays_at_its_place():
    """Noise that is correlated over a second moves a moving mean by centimetres; the place stays."""
    rng = np.random.default_rng(3)
    noise = gaussian_filter1d(rng.normal(size=(600, 3)), 15.0, axis=0)
    path = np.array([0.1, 0.2, 0.08]) + 0.015 * noise / noise.std()
    places = places_of(path, 1 / 60)
    assert np.ptp(places, axis=0).max() < 1e-12
    assert np.linalg.norm(places[0] - [0.1, 0.2, 0.08]) < 0.01


def test_a_foot_that_is_moved_has_a_new_place():
    path = np.zeros((300, 3))
    path[150:, 0] = 0.06
    places = places_of(path, 1 / 60)
    assert np.abs(places[:120, 0]).max() < 1e-6
    assert np.abs(places[180:, 0] - 0.06).max() < 1e-6


def test_a_path_that_noise_leads_less_astray_is_sooner_at_another_place():
    path = np.zeros((300, 3))
    path[150:165, 0] = 0.03
    assert np.ptp(places_of(path, 1 / 60)[:, 0]) < 1e-9
    assert np.ptp(places_of(path, 1 / 60, change_m2_s=0.02 * CHANGE_M2_S)[:, 0]) > 0.02


def test_places_are_the_best_of_all_ways_to_change():
    """Compared with every way to cut a short path into two."""
    path = np.zeros((48, 3))
    path[:, 0] = 0.08 * np.sin(np.linspace(0.0, 4.0, 48))
    dt, places = 1 / 60, places_of(path, 1 / 60)

    def cost(cuts):
        edges = [0, *cuts, len(path)]
        spread = sum(((path[a:b] - path[a:b].mean(axis=0)) ** 2).sum() for a, b in pairwise(edges))
        return spread * dt + CHANGE_M2_S * len(cuts)

    blocks = range(6, 48, 6)
    best = min([[], *([a] for a in blocks), *([a, b] for a in blocks for b in blocks if a < b)], key=cost)
    edges = [0, *best, len(path)]
    sharp = np.concatenate(
        [np.repeat(path[a:b].mean(axis=0)[None], b - a, axis=0) for a, b in pairwise(edges)]
    )
    wanted = sharp if len(best) == 0 else gaussian_filter1d(sharp, EASE_S / dt, axis=0, mode="nearest")
    assert np.allclose(places, wanted)


def test_noise_of_depth_cameras_wanders_wholly_and_white_noise_little():
    assert wander_of(1.0) == wander_of(0.8) == wander_of(0.5) == 1.0
    assert wander_of(0.2) == 0.4


@pytest.mark.parametrize(
    ("off_m", "floor_m"), [(0.011, 0.0), (-0.011, 0.0), (-0.013, -0.001), (-0.03, -0.03)]
)
def test_the_floor_follows_feet_without_a_step(off_m, floor_m):
    feet = np.tile([0.0, 0.0, off_m], (90, 4, 1)) + REST_M[:, None] * np.array([0.0, 0.0, 1.0])
    found = find_contacts(feet, [(0, 90)], 1 / 60, REST_M).floor_m
    assert found == pytest.approx(floor_m, abs=2e-4)
