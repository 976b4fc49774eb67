"""Largest torque of a joint, by degree of freedom and kilogram of body mass.

The sources are for strong people, so that no real motion exceeds the bounds. Trunk, hip, ankle, shoulder: men's 95th
percentiles at rest by Stobbe 1982, as tabulated in Chaffin, Andersson & Martin, "Occupational biomechanics", 3rd
ed. 1999, over 75 kg. Knee: the strongest of 74 trained adults, "Absolute and normalized normative torque values of
knee extensors and flexors", Arthroscopy, Sports Medicine, and Rehabilitation 2024. Elbow: mean and two deviations
of 199 men (Lategan & Krueger 2003). Neck: men's means and two deviations (Vasavada et al. 2001). Wrist: Delp et al.
1996. Torques missing in these (turning hip and trunk, ankle up and sideways, forearm, toes) are estimated from
neighbours; clavicles are not bounded. A joint that yields holds more than one at rest, as in landing (Westing et
al. 1988).
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.model.human.ranges import dofs_of

GIVING_WAY = 1.4

# Torque towards negative and towards positive angles [N m / kg]; `human.ranges` gives the directions.
_TRUNK = {"bend": (6.7, 2.9), "side": (3.5, 3.5), "twist": (1.5, 1.5)}
_NECK = {"bend": (1.0, 0.53), "side": (0.7, 0.7), "twist": (0.3, 0.3)}
_STRENGTH: dict[str, dict[str, tuple[float, float]]] = {
    "Spine": _TRUNK, "Spine1": _TRUNK, "Spine2": _TRUNK, "Neck": _NECK, "Head": _NECK,
    "Arm": {"swing": (1.6, 1.6), "raise": (1.6, 1.6), "twist": (1.1, 1.1)},
    "ForeArm": {"bend": (1.03, 0.92), "twist": (0.3, 0.3)},
    "Hand": {"bend": (0.3, 0.3), "side": (0.3, 0.3)},
    "UpLeg": {"bend": (2.6, 4.05), "side": (2.6, 2.6), "twist": (1.5, 1.5)},
    "Leg": {"bend": (4.08, 2.05)},
    "Foot": {"bend": (1.0, 3.2), "side": (1.0, 1.0), "turn": (1.0, 1.0)},
    "ToeBase": {"bend": (1.0, 1.0)},
}  # fmt: skip


def torque_bounds(mass_kg: float) -> NDArray[np.float64]:
    """Return the least and the greatest torque of each hinge of the solve's humanoid [N m], shape (hinges, 2)."""
    bounds = []
    for name in BODY_JOINTS:
        strength = _STRENGTH.get(name.removeprefix("Left").removeprefix("Right"))
        for dof in dofs_of(name):
            low, high = (np.inf, np.inf) if strength is None else strength[dof.name]
            bounds.append((-low, high))
    return GIVING_WAY * mass_kg * np.array(bounds)
