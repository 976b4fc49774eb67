"""A hand of the output skeleton as a chain of hinges, for following its landmarks in pictures.

The 21 landmarks are the wrist, then four of each finger from the thumb on, root to tip: the finger's joints of the
output skeleton, and its tip. A hand's state is `STATE` numbers: the wrist's shift from the body's [m], the forearm's
twist, the wrist's bend and side [rad], the logarithm of the hand's size relative to the skeleton's, and the fingers'
hinges [rad].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import COUPLINGS
from studio.engine.model.human.ranges import dofs_of, range_rad
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import FINGERS, OUTPUT_INDEX

SIDES = ("left", "right")
LANDMARKS = 21
SHIFT, WRIST, SIZE, HINGES = slice(0, 3), slice(3, 6), 6, slice(7, 23)
STATE = 23
"""Parts of a hand's state, and its number of values."""


@dataclass(frozen=True)
class HandModel:
    """One hand of a performer.

    Attributes:
        offsets_m: T-pose offset of each landmark but the wrist from the one before it, the first of a finger from the
            wrist, stage axes, shape (5, 4, 3).
        axes: of each finger joint's hinges, from the parent outward, shape (5, 3, 2, 3); zero = no hinge.
        places: of their angles in the state, shape (5, 3, 2); 0 = no hinge.
        ratios: of the hinges' angles to those of the state, shape (5, 3, 2): a last joint follows the middle one.
        wrist_axes: of the forearm's twist, and the wrist's bend and side, shape (3, 3).
        low, high: ends of the state's ranges, shape (STATE,); infinite where it has none.
        joints: output joints of the fingers, shape (5, 3).
        arm: output joints of upper arm, forearm and hand.
    """

    offsets_m: NDArray[np.float64]
    axes: NDArray[np.float64]
    places: NDArray[np.int64]
    ratios: NDArray[np.float64]
    wrist_axes: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    joints: NDArray[np.int64]
    arm: tuple[int, int, int]

    @classmethod
    def of(
        cls, skeleton: Skeleton, side: str, *, limited: bool = True, flexibility: float = 1.0
    ) -> "HandModel":
        """Return a hand.

        Args:
            skeleton: of the performer.
            side: `left` or `right`.
            limited: whether hinges have human ranges.
            flexibility: 0..2, scales the ranges.
        """
        prefix = side.capitalize()
        low, high = np.full(STATE, -np.inf), np.full(STATE, np.inf)
        offsets, axes = np.zeros((5, 4, 3)), np.zeros((5, 3, 2, 3))
        places, ratios = np.zeros((5, 3, 2), dtype=np.int64), np.ones((5, 3, 2))
        next_place = HINGES.start
        for f, finger in enumerate(FINGERS):
            names = [f"{prefix}Hand{finger}{k}" for k in (1, 2, 3)]
            offsets[f, :3] = skeleton.offsets_m[[OUTPUT_INDEX[name] for name in names]]
            offsets[f, 3] = skeleton.finger_tip_m(names[2])
            for k, name in enumerate(names):
                for n, dof in enumerate(dofs_of(name)):
                    axes[f, k, n] = np.array(dof.axis) / np.linalg.norm(dof.axis)
                    _, ratios[f, k, n] = COUPLINGS.get(f"{name}_{dof.name}", ("", 1.0))
                    if f"{name}_{dof.name}" in COUPLINGS:
                        places[f, k, n] = places[f, k - 1, n]
                        continue
                    places[f, k, n] = next_place
                    low[next_place], high[next_place] = range_rad(dof, flexibility)
                    next_place += 1
        assert next_place == STATE
        wrist = [dofs_of(f"{prefix}ForeArm")[1], *dofs_of(f"{prefix}Hand")]
        low[WRIST], high[WRIST] = np.transpose([range_rad(dof, flexibility) for dof in wrist])
        if not limited:
            low[:], high[:] = -np.inf, np.inf
        return cls(
            offsets, axes, places, ratios, np.array([dof.axis for dof in wrist]), low, high,
            np.array([[OUTPUT_INDEX[f"{prefix}Hand{finger}{k}"] for k in (1, 2, 3)] for finger in FINGERS]),
            (OUTPUT_INDEX[f"{prefix}Arm"], OUTPUT_INDEX[f"{prefix}ForeArm"], OUTPUT_INDEX[f"{prefix}Hand"]),
        )  # fmt: skip
