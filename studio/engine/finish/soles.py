"""How far a finished take is lifted, so that it stands on the floor with its soles."""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.finish.contacts import FLAT_M, Contacts
from studio.engine.human.model import Humanoid
from studio.engine.soles import USUAL_TOE_HEIGHT_M

LOWEST_PERCENT = 5.0
"""The lowest standing sole is under the floor in so many of a take's frames: shoes give."""

GIVES_M = 0.007
"""No sole, standing or not, is further than this under the floor on which they stand."""

_BODIES = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")


def without_dips(
    humanoid: Humanoid, q: NDArray[np.float64], contacts: Contacts, rest_heights_m: NDArray[np.float64]
) -> Contacts:
    """Return the contacts with joints kept so high that no sole dips under the floor where they stand.

    A swinging foot that tips its toes into the floor for an instant says nothing of where the floor is.

    Args:
        q: configurations, shape (frame_count, nq).
        contacts: of the same frames.
        rest_heights_m: as of `lift_m`.
    """
    soles, joints = _soles_and_joints_m(humanoid, q, rest_heights_m)
    standing = _standing_m(soles, contacts)
    if len(standing) == 0:
        return contacts
    dip = np.percentile(standing, LOWEST_PERCENT) - GIVES_M - soles
    return replace(
        contacts, least_m=np.where(dip > 0.0, np.maximum(contacts.least_m, joints + dip), contacts.least_m)
    )


def lift_m(
    humanoid: Humanoid, q: NDArray[np.float64], contacts: Contacts, rest_heights_m: NDArray[np.float64]
) -> float:
    """Return how far to lift a take [m]; negative = it hovers and is let down.

    Feet that stand are at the height at which cameras see their joints, which may be a centimetre or two off that of
    the calibration; the same everywhere, so that one shift of the take mends it. A take is let down only where most
    standing feet are flat: a dancer on her toes hovers with her soles, and stands where she is.

    Args:
        q: finished configurations, shape (frame_count, nq).
        contacts: of the same frames.
        rest_heights_m: heights of `contacts.JOINTS` in the T-pose [m], shape (4,).
    """
    soles, _ = _soles_and_joints_m(humanoid, q, rest_heights_m)
    standing = _standing_m(soles, contacts)
    if len(standing) == 0:
        return -contacts.floor_m
    hovers = float(np.percentile(standing, LOWEST_PERCENT))
    return 0.0 if hovers > 0.0 and not _mostly_flat(soles, contacts) else -hovers


def _mostly_flat(soles: NDArray[np.float64], contacts: Contacts) -> bool:
    """Whether most feet that stand on heel and toe have both at one height."""
    heels, toes = (slice(0, None, 2), slice(1, None, 2))
    stands = (contacts.hold[:, heels] > 0.0) & (contacts.hold[:, toes] > 0.0)
    flat = np.abs(soles[:, heels] - soles[:, toes])[stands] < FLAT_M
    return not len(flat) or float(flat.mean()) >= 0.5


def _standing_m(soles: NDArray[np.float64], contacts: Contacts) -> NDArray[np.float64]:
    """The lowest standing sole of each frame in which one stands [m]."""
    lowest = np.where(contacts.hold > 0.0, soles, np.inf).min(axis=1)
    return lowest[np.isfinite(lowest)]


def _soles_and_joints_m(
    humanoid: Humanoid, q: NDArray[np.float64], rest_heights_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heights of the soles under `contacts.JOINTS`, which turn with the feet, and of the joints [m], shapes
    (frame_count, 4)."""
    below_m = rest_heights_m - rest_heights_m.min() + USUAL_TOE_HEIGHT_M
    model, data = humanoid.model, mujoco.MjData(humanoid.model)
    bodies = [model.body(name).id for name in _BODIES]
    soles, joints = np.empty((2, len(q), len(bodies)))
    for t, configuration in enumerate(q):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        joints[t] = data.xpos[bodies, 2]
        soles[t] = joints[t] - data.xmat[bodies, 8] * below_m
    return soles, joints
