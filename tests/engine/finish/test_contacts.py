"""Who stands when: found in a smooth pass over the take."""

import numpy as np

from studio.engine.finish.contacts import find_contacts

REST_M = np.array([0.08, 0.02, 0.08, 0.02])
STANDING = np.array([[0.1, 0.0, 0.08], [0.1, -0.15, 0.02], [-0.1, 0.0, 0.08], [-0.1, -0.15, 0.02]])


def test_a_stance_at_the_ends_of_a_take_is_one():
    """A foot that stands from the first frame to the last is held in all of them."""
    contacts = find_contacts(np.tile(STANDING, (60, 1, 1)), [(0, 60)], 1 / 60, REST_M)
    assert (contacts.hold > 0).all()
    assert contacts.floor_m == 0.0


def test_a_jump_is_no_stance():
    feet = np.tile(STANDING, (120, 1, 1))
    feet[40:80, :, 2] += 0.3 * np.sin(np.linspace(0, np.pi, 40))[:, None]
    hold = find_contacts(feet, [(0, 120)], 1 / 60, REST_M).hold
    assert (hold[:35] > 0).all() and (hold[85:] > 0).all()
    assert not hold[45:75].any()
