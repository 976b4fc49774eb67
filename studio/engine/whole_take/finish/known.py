"""An operator's knowledge of a take, in the form for finishing: places of joints, stances of feet, contacts."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.pins import Pins
from studio.engine.solve.touching import HeldJoint, with_held, with_touches
from studio.engine.whole_take.finish.contact.contacts import JOINTS, Contacts, lying
from studio.engine.whole_take.finish.contact.soles import Soles, dips_m, lift_m
from studio.engine.whole_take.finish.trajectory import Kinematics


class Known:
    """What an operator knows about one performer, in all frames.

    Attributes:
        pinned: joints at known places; None = none.
        touches: contacts of other joints than feet.
    """

    def __init__(self, pins: Pins | None, times_s: NDArray[np.float64], dt: float, height_m: float) -> None:
        """Read what is known.

        Args:
            pins: None = nothing is known.
            times_s: of the frames [s], shape (frame_count,).
            dt: time between two frames [s].
            height_m: the performer's stature.
        """
        self._pins, self._times_s, self._dt, self._height_m = pins, times_s, dt, height_m
        self.pinned = None if pins is None else pins.at(times_s, dt)
        self.touches = [] if pins is None else pins.touches.at(times_s)
        self._places = self._own = self.pinned
        self._held: Sequence[HeldJoint] = ()

    def standing(
        self,
        contacts: Contacts,
        feet: Soles,
        pieces: list[tuple[int, int]],
        rest_heights_m: NDArray[np.float64],
        *,
        floor_given: bool,
        lifted_m: float | None = None,
    ) -> Contacts:
        """Return the feet's contacts with known stances; known places move to the floor that the feet show.

        Args:
            contacts: as they were found.
            feet: in all frames.
            pieces: begin and end of each piece of the take without a gap [frames].
            rest_heights_m: as `find_contacts` takes them.
            floor_given: the places are over the given floor already.
            lifted_m: how far the take will be raised; None = as the feet show now.
        """
        if self._pins is not None and self._pins.stances:
            asked = self._pins.stances.asked(self._times_s, contacts.hold, pieces)
            contacts = contacts.as_asked(asked, feet.joints_m, pieces, self._dt, rest_heights_m)
        if self._places is not None and not floor_given:
            lifted_m = lift_m(feet, contacts) if lifted_m is None else lifted_m
            self.pinned = self._own = self._places = self._places.raised(-lifted_m)
        return contacts

    def raise_feet(self, feet: Soles, contacts: Contacts) -> None:
        """Raise the pins of feet whose sole is under the floor: a clicked place is off by centimetres, the floor is
        not."""
        if self._places is None:
            return
        dips = np.maximum(dips_m(feet, contacts), 0.0).reshape(-1, 2, 2).max(axis=2)
        pinned = self._places.information[:, list(JOINTS)] > 0.0
        place_m = self._places.place_m.copy()
        place_m[:, list(JOINTS), 2] += pinned * np.repeat(dips, 2, axis=1)
        self.pinned = self._own = self._places = replace(self._places, place_m=place_m)

    def touch(
        self, kinematics: Kinematics, q: NDArray[np.float64], pieces: list[tuple[int, int]], floor_m: float
    ) -> None:
        """Compute the places of joints that touch something.

        Args:
            kinematics: of the performer's humanoid.
            q: configurations, shape (frame_count, nq).
            pieces: begin and end of each piece of the take without a gap [frames].
            floor_m: height of the floor.
        """
        sites = kinematics.sites(q)
        lies_at = [
            lying(sites[:, one.joint], one.information > 0.0, pieces, self._dt) for one in self.touches
        ]
        self.pinned = self._own = with_touches(
            self._places, self.touches, sites, lies_at, floor_m=floor_m, height_m=self._height_m
        )

    def hold(self, held: Sequence[HeldJoint]) -> None:
        """Hold joints where they touch other performers."""
        self._held = held
        if held:
            self.pinned = with_held(self._own, held, len(self._times_s))

    def is_held(self, frames: slice) -> bool:
        """Return whether a joint touches another performer in some of these frames."""
        return any(one.information[frames].any() for one in self._held)
