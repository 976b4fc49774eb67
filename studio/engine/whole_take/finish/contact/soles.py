"""Vertical shift of a finished take, so that its soles stand on the floor."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.soles import USUAL_TOE_HEIGHT_M
from studio.engine.whole_take.finish.contact.contacts import FLAT_M, JOINTS, Contacts

LOWEST_PERCENT = 5.0
"""Share of a take's frames in which the lowest standing sole is under the floor, because shoes give."""

GIVES_M = 0.007
"""Largest depth of any sole under the floor."""


@dataclass(frozen=True)
class Soles:
    """`contacts.JOINTS` of a take, and the soles under them, which turn with the feet.

    Attributes:
        joints_m: positions in the stage frame, shape (frame_count, 4, 3).
        soles_m: heights of the soles, shape (frame_count, 4).
    """

    joints_m: NDArray[np.float64]
    soles_m: NDArray[np.float64]

    def changed(self, rows: NDArray[np.bool_], new: "Soles") -> "Soles":
        """The same with other feet in some frames, flags of shape (frame_count,); `new` has these frames alone."""
        joints_m, soles_m = self.joints_m.copy(), self.soles_m.copy()
        joints_m[rows], soles_m[rows] = new.joints_m, new.soles_m
        return Soles(joints_m, soles_m)


def feet_of(humanoid: Humanoid, q: NDArray[np.float64], rest_heights_m: NDArray[np.float64]) -> Soles:
    """Return the feet of configurations, shape (frame_count, nq).

    Args:
        rest_heights_m: heights of `contacts.JOINTS` in the T-pose, shape (4,).
    """
    below_m = rest_heights_m - rest_heights_m.min() + USUAL_TOE_HEIGHT_M
    model, data = humanoid.model, mujoco.MjData(humanoid.model)
    sites, places, upright = humanoid.site_ids[list(JOINTS)], data.site_xpos, data.site_xmat[:, 8]
    joints, up = np.empty((len(q), len(JOINTS), 3)), np.empty((len(q), len(JOINTS)))
    for t, configuration in enumerate(q):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        places.take(sites, axis=0, out=joints[t], mode="clip")
        upright.take(sites, out=up[t], mode="clip")
    return Soles(joints, joints[..., 2] - up * below_m)


def without_dips(feet: Soles, contacts: Contacts) -> Contacts:
    """Return the contacts with joints raised so that no sole dips under the floor.

    A swinging foot that dips its toes into the floor for an instant does not show where the floor is.
    """
    dip, joints = dips_m(feet, contacts), feet.joints_m[..., 2]
    return replace(
        contacts, least_m=np.where(dip > 0.0, np.maximum(contacts.least_m, joints + dip), contacts.least_m)
    )


def dips_m(feet: Soles, contacts: Contacts) -> NDArray[np.float64]:
    """Return the depth of soles under the floor beyond `GIVES_M` [m], shape (frame_count, 4); 0 or less = not under
    it. Without a standing foot none is."""
    standing = _standing_m(feet.soles_m, contacts)
    if len(standing) == 0:
        return np.zeros_like(feet.soles_m)
    return np.percentile(standing, LOWEST_PERCENT) - GIVES_M - feet.soles_m


def lift_m(feet: Soles, contacts: Contacts, *, percent: float = LOWEST_PERCENT) -> float:
    """Return the lift of a finished take [m]; negative = lower it.

    `percent`: of the frames in which the lowest standing sole is under the floor then.

    Cameras see the joints of standing feet at a height that may be a centimetre or two off the calibration. The error
    is the same everywhere, so one shift of the take corrects it. A take is lowered only where most standing feet are
    flat: the soles of a dancer on her toes are above the floor, and she stays where she is.
    """
    standing = _standing_m(feet.soles_m, contacts)
    if len(standing) == 0:
        return -contacts.floor_m
    hovers = float(np.percentile(standing, percent))
    return 0.0 if hovers > 0.0 and not _mostly_flat(feet.soles_m, contacts) else -hovers


def _mostly_flat(soles: NDArray[np.float64], contacts: Contacts) -> bool:
    """Whether most feet that stand on heel and toe have both at the same height."""
    heels, toes = (slice(0, None, 2), slice(1, None, 2))
    stands = (contacts.hold[:, heels] > 0.0) & (contacts.hold[:, toes] > 0.0)
    flat = np.abs(soles[:, heels] - soles[:, toes])[stands] < FLAT_M
    return not len(flat) or float(flat.mean()) >= 0.5


def _standing_m(soles: NDArray[np.float64], contacts: Contacts) -> NDArray[np.float64]:
    """The lowest standing sole of each frame with one [m]."""
    lowest = np.where(contacts.hold > 0.0, soles, np.inf).min(axis=1)
    return lowest[np.isfinite(lowest)]
