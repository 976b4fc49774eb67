"""Rigid bodies as evidence: each pins its joint in every frame in which it is seen, in addition to edits' pins."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import Edit
from studio.engine.edits.pins import Pins
from studio.engine.model.calibration import Performer
from studio.engine.model.frames import Pinned
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.rigid_bodies.known import Tie
from studio.engine.rigid_bodies.tie import joint_places_m
from studio.engine.rigid_bodies.tracks import BodyTrack

SIGMA_M = 0.015
"""Standard deviation of a joint from its place by the body [m]: skin and straps move."""


def pinned_by(told: Mapping[str, Sequence[float]], performer: Performer | None) -> Pinned:
    """Return the joints that bodies pin at an instant; `told`: by canonical joint, its place by the body [m]."""
    place, information = np.zeros((JOINT_COUNT, 3)), np.zeros(JOINT_COUNT)
    for joint, where in told.items():
        if joint in INDEX:
            place[INDEX[joint]], information[INDEX[joint]] = where, 1.0 / SIGMA_M**2
    reach = np.full(JOINT_COUNT, np.inf) if performer is None else performer.reach_m()
    return Pinned(place, np.zeros(JOINT_COUNT), information, reach)


class BodyPins(Pins):
    """The pins of one performer's edits and of the bodies on them.

    Args:
        edits: of the performer.
        performer: their proportions; None = not known.
        bodies: by canonical joint, the motion of its body on the stage, and its tie to the joint.
    """

    def __init__(
        self,
        edits: Sequence[Edit],
        performer: Performer | None,
        bodies: Mapping[str, tuple[BodyTrack, Tie]],
    ) -> None:
        super().__init__(edits, performer)
        self._bodies = bodies

    def __bool__(self) -> bool:
        return bool(self._bodies) or super().__bool__()

    def at(self, time_s: NDArray[np.float64], dt: float) -> Pinned:
        """Return the pinned joints in frames; an edit's pin has nine times the information of a body."""
        of_edits = super().at(time_s, dt)
        place, radius = of_edits.place_m.copy(), of_edits.radius_m.copy()
        information = of_edits.information.copy()
        for joint, (track, tie) in self._bodies.items():
            k = INDEX[joint]
            where = joint_places_m(track, tie, time_s)
            seen = np.isfinite(where).all(axis=1)
            own, theirs = information[seen, k], 1.0 / SIGMA_M**2
            share = theirs / (own + theirs)
            place[seen, k] += share[:, None] * (where[seen] - place[seen, k])
            radius[seen, k] *= 1.0 - share
            information[seen, k] = own + theirs
        return Pinned(place, radius, information, of_edits.reach_m)

    def between(self, begin_s: float, end_s: float) -> Pinned | None:
        """Return the pinned joints after `begin_s` up to `end_s` [s], without an axis of frames; None = none."""
        middle = 0.5 * (begin_s + end_s)
        found = self.at(np.array([middle]), end_s - begin_s)
        if not found.information.any():
            return None
        return Pinned(found.place_m[0], found.radius_m[0], found.information[0], found.reach_m)
