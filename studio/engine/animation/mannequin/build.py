"""Builds: width factors that make different bodies on the same joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.loft import course

Array = NDArray[np.float64]
_Course = tuple[tuple[float, float], ...]
_SAME: _Course = ((0.0, 1.0), (1.0, 1.0))


@dataclass(frozen=True)
class Build:
    """Factors of widths; 1 = the standard body's.

    Attributes:
        trunk: height (0 = hip joints, 1 = shoulder joints), factors of the width, the depth before and behind.
        arm, leg: place (0 = root, 1 = middle joint, 2 = far one), factor of the radii.
        shoulder, neck, head, hand, foot: factor of the part's widths.
    """

    trunk: tuple[tuple[float, float, float, float], ...] = ((0.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0))
    arm: _Course = _SAME
    leg: _Course = _SAME
    shoulder: float = 1.0
    neck: float = 1.0
    head: float = 1.0
    hand: float = 1.0
    foot: float = 1.0

    def of_trunk(self, share: Array, column: int) -> Array:
        """Return the factors of the trunk's width (1), depth before (2) or behind (3) at heights."""
        return course([(row[0], row[column]) for row in self.trunk], share)


STANDARD = Build()

SLIM = Build(
    trunk=(
        (-0.24, 1.00, 0.96, 1.00), (0.00, 1.04, 0.94, 1.06), (0.10, 1.02, 0.92, 1.04), (0.32, 0.80, 0.82, 0.90),
        (0.44, 0.78, 0.84, 0.90), (0.58, 0.84, 0.98, 0.92), (0.72, 0.88, 1.10, 0.92), (0.86, 0.86, 1.00, 0.90),
        (1.00, 0.84, 0.90, 0.86), (1.16, 0.82, 0.84, 0.84),
    ),
    arm=((0.0, 0.83), (1.0, 0.82), (2.0, 0.86)),
    leg=((0.0, 1.00), (0.4, 0.97), (1.0, 0.86), (1.4, 0.86), (2.0, 0.84)),
    shoulder=0.83, neck=0.82, head=0.95, hand=0.86, foot=0.90,
)  # fmt: skip
"""Narrow shoulders and waist, wide hips, thin limbs."""
