"""Torque limits of a robot's hinges, as its model gives them."""

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def torque_limits(model: mujoco.MjModel) -> Array:
    """Return lowest and highest torque of each hinge [N m], shape (hinge_count, 2); infinite where none is given.

    A limit is the joint's own (`actuatorfrcrange`, a URDF's effort), or that of its actuators: their force range, or
    for a motor without one its control range, times gain and gear.
    """
    joints = model.njnt - 1
    by_actuators = np.zeros((joints, 2))
    driven = np.zeros(joints, dtype=bool)
    for actuator in range(model.nu):
        joint = int(model.actuator_trnid[actuator, 0]) - 1
        if model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT or joint < 0:
            continue
        driven[joint] = True
        by_actuators[joint] += _actuator_limits(model, actuator)
    out = np.where(driven[:, None], by_actuators, [-np.inf, np.inf])
    limited = model.jnt_actfrclimited[1:].astype(bool)
    own = np.where(limited[:, None], model.jnt_actfrcrange[1:], [-np.inf, np.inf])
    return np.stack([np.maximum(out[:, 0], own[:, 0]), np.minimum(out[:, 1], own[:, 1])], axis=1)


def _actuator_limits(model: mujoco.MjModel, actuator: int) -> Array:
    """Lowest and highest torque of an actuator of a hinge [N m], shape (2,)."""
    gear = float(model.actuator_gear[actuator, 0])
    motor = (
        model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE
    )
    if model.actuator_forcelimited[actuator]:
        limits = gear * model.actuator_forcerange[actuator]
    elif motor and model.actuator_ctrllimited[actuator]:
        limits = gear * model.actuator_gainprm[actuator, 0] * model.actuator_ctrlrange[actuator]
    else:
        return np.array([-np.inf, np.inf])
    return np.sort(limits)
