"""Contacts between performers set by an operator: both give way by half, so that their surfaces meet."""

from collections.abc import Mapping

import numpy as np

from studio.engine.edits.touches import Touches
from studio.engine.solve.touching import HeldJoint, thick_m
from studio.engine.whole_take.finish.contact.others import WITHIN_NS, Surfaces


def held_by_others(
    name: str, surfaces: Mapping[str, Surfaces], touches: Mapping[str, Touches]
) -> list[HeldJoint]:
    """Return the places of a performer's joints that touch another's, or are touched.

    Args:
        name: the performer.
        surfaces: of all performers, as they are now.
        touches: by performer, their contacts.
    """
    own, held = surfaces[name], []
    for who, asked in touches.items():
        for touch, whom in asked.of_others(1e-9 * own.times_ns.astype(np.float64)):
            assert touch.touched is not None
            if who == name and whom in surfaces:
                joint, theirs, other = touch.joint, touch.touched, surfaces[whom]
            elif whom == name and who in surfaces:
                joint, theirs, other = touch.touched, touch.joint, surfaces[who]
            else:
                continue
            here, there = own.sites[:, joint], other.at(own.times_ns, WITHIN_NS)[:, theirs]
            way = here - there
            unit = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-6)
            apart = thick_m(joint, own.height_m) + thick_m(theirs, other.height_m)
            place = 0.5 * (here + there) + 0.5 * apart * unit
            is_there = np.isfinite(place).all(axis=1)
            information = np.where(is_there, touch.information, 0.0)
            held.append(HeldJoint(joint, np.where(is_there[:, None], place, 0.0), information))
    return held
