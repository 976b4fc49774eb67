"""Estimate of a take's lift above its cameras' joints, before it is solved.

Finishing puts the soles on the floor by one shift of the whole take (`finish.contact.soles.lift_m`). Pins are placed
on the shown take, which is over this floor; the cameras' joints are not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.edits.edit import Edit, PinEdit
from studio.engine.edits.frames import Frames, stage_s
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, LIMB_ROOTS, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.soles import USUAL_TOE_HEIGHT_M
from studio.engine.whole_take.finish.contact.contacts import JOINTS, Contacts, find_contacts
from studio.engine.whole_take.finish.contact.soles import Soles, lift_m
from studio.engine.whole_take.mending.around import STEP_S, Around, around
from studio.engine.whole_take.mending.pinned import REACH_S

SMOOTHING_S = 0.1
"""Smoothing of the feet; without it, noise would sink them."""

NOISY_PERCENT = 25.0
"""Value of `LOWEST_PERCENT` for feet that no fitted body has smoothed and kept from dipping."""

LOOKED_S = 60.0
"""Length of the part of a take that is used [s]."""


def lift_of_pins_m(
    frames: Frames,
    calibration: Calibration,
    settings: SolveSettings,
    edits: Sequence[Edit],
    *,
    start_s: float | None = None,
) -> float:
    """Return the approximate lift of depth cameras' joints by finishing [m]; 0 where there is none, or without pins.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: cameras, clocks and the performer's proportions.
        settings: of the solve.
        edits: of this performer.
        start_s: stage time before which nothing counts [s].
    """
    if not is_raised_for_pins(calibration, settings, edits):
        return 0.0
    feet = feet_seen(frames, calibration, start_s)
    return 0.0 if feet is None else feet.lift_of_pins_m(edits)


def is_raised_for_pins(calibration: Calibration, settings: SolveSettings, edits: Sequence[Edit]) -> bool:
    """Return whether finishing may raise depth cameras' joints, and there are pins, which need the lift."""
    return places_feet(calibration, settings) and bool(of_kind(edits, PinEdit))


def places_feet(calibration: Calibration, settings: SolveSettings) -> bool:
    """Return whether finishing may raise depth cameras' joints, by the feet of a known performer."""
    places = settings.finish == "on" and settings.floor_contact == "on" and not calibration.floor_given
    return places and calibration.performer is not None


@dataclass(frozen=True)
class FeetSeen:
    """A take's ankles and toes as cameras see them.

    Attributes:
        seen: all joints.
        soles: of the feet.
        contacts: where they stand.
    """

    seen: Around
    soles: Soles
    contacts: Contacts

    def lift_of_pins_m(self, edits: Sequence[Edit]) -> float:
        """Return the approximate lift of the take by finishing [m]."""
        hold = np.where(_doubtful(self.seen, edits), 0.0, self.contacts.hold)
        return lift_m(self.soles, replace(self.contacts, hold=hold), percent=NOISY_PERCENT)


def feet_seen(frames: Frames, calibration: Calibration, start_s: float | None = None) -> FeetSeen | None:
    """Return a performer's feet as the cameras see them; None where they see nobody. Arguments as for
    `lift_of_pins_m`."""
    performer = calibration.performer
    known = [(name, mine) for name, mine in frames.items() if name in calibration.cameras and len(mine)]
    if performer is None or not known:
        return None
    begin_s = min(stage_s(calibration, name)(mine[0]) for name, mine in known)
    end_s = max(stage_s(calibration, name)(mine[-1]) for name, mine in known)
    begin_s = begin_s if start_s is None else max(begin_s, start_s)
    seen = around(frames, calibration, begin_s, min(end_s, begin_s + LOOKED_S))
    if seen is None:
        return None
    feet = gaussian_filter1d(seen.middle()[:, list(JOINTS)], SMOOTHING_S / STEP_S, axis=0, mode="nearest")
    rest_m = Skeleton.of(performer).rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[list(JOINTS)], 2]
    below_m = rest_m - rest_m.min() + USUAL_TOE_HEIGHT_M
    contacts = find_contacts(feet, [(0, len(feet))], STEP_S, rest_m)
    return FeetSeen(seen, Soles(feet, feet[..., 2] - below_m), contacts)


def _doubtful(seen: Around, edits: Sequence[Edit]) -> NDArray[np.bool_]:
    """Feet of legs that may be wrong because a pin is on them, shape (count, 4); they do not count for the floor."""
    out = np.zeros((len(seen.time_s), len(JOINTS)), dtype=bool)
    roots = LIMB_ROOTS[list(JOINTS)]
    for pin in of_kind(edits, PinEdit):
        if pin.joint in INDEX:
            rows = seen.rows_of(pin.start_s - REACH_S, pin.end_s + REACH_S)
            out[rows] |= roots == LIMB_ROOTS[INDEX[pin.joint]]
    return out
