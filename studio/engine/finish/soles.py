"""How far a finished take is lifted, so that it stands on the floor with its soles."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.finish.contacts import FLAT_M, Contacts
from studio.engine.human.model import Humanoid
from studio.engine.soles import USUAL_TOE_HEIGHT_M

LOWEST_PERCENT = 5.0
"""The lowest standing sole is under the floor in so many of a take's frames: shoes give."""

GIVES_M = 0.007
FOR_DIPS_M = 0.01
"""No sole, standing or not, is further under the floor than the first, as far as so much more lift can mend it."""

_BODIES = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")


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
    soles = _soles_m(humanoid, q, rest_heights_m - rest_heights_m.min() + USUAL_TOE_HEIGHT_M)
    standing = np.where(contacts.hold > 0.0, soles, np.inf).min(axis=1)
    standing = standing[np.isfinite(standing)]
    if len(standing) == 0:
        return -contacts.floor_m
    usual = float(np.percentile(standing, LOWEST_PERCENT))
    hovers = max(min(usual, float(soles.min()) + GIVES_M), usual - FOR_DIPS_M)
    return 0.0 if hovers > 0.0 and not _mostly_flat(soles, contacts) else -hovers


def _mostly_flat(soles: NDArray[np.float64], contacts: Contacts) -> bool:
    """Whether most feet that stand on heel and toe have both at one height."""
    heels, toes = (slice(0, None, 2), slice(1, None, 2))
    stands = (contacts.hold[:, heels] > 0.0) & (contacts.hold[:, toes] > 0.0)
    flat = np.abs(soles[:, heels] - soles[:, toes])[stands] < FLAT_M
    return not len(flat) or float(flat.mean()) >= 0.5


def _soles_m(humanoid: Humanoid, q: NDArray[np.float64], below_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of the places so far under `contacts.JOINTS`, which turn with the feet [m], shape (frame_count, 4)."""
    model, data = humanoid.model, mujoco.MjData(humanoid.model)
    bodies = [model.body(name).id for name in _BODIES]
    out = np.empty((len(q), len(bodies)))
    for t, configuration in enumerate(q):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        out[t] = data.xpos[bodies, 2] - data.xmat[bodies, 8] * below_m
    return out
