"""Figures of how well forces explain a motion, frame by frame, for the decision to keep the correction and for
reports."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.whole_take.finish.contact.contacts import JOINTS, Contacts
from studio.engine.whole_take.finish.trajectory import Kinematics, steps
from studio.engine.whole_take.physics.correction import floor_height_m
from studio.engine.whole_take.physics.dynamics import body_mass_kg, dynamics
from studio.engine.whole_take.physics.forces import ARM_M, bearing, contact_forces
from studio.engine.whole_take.physics.points import SOLE_POINTS, floor_points
from studio.engine.whole_take.physics.strength import torque_bounds
from studio.engine.whole_take.physics.torques import InverseDynamics, excess

STANDS = 0.99
"""A joint with at least this hold stands."""


@dataclass(frozen=True)
class PhysicsFigures:
    """Figures of some frames, shape (F,) each; the first and last frame have those of their neighbours.

    Attributes:
        force_n: size of the external force that no contact explains [N].
        moment_nm: size of the unexplained moment [N m].
        excess_nm: torques beyond the joints' bounds, summed over the joints [N m].
        slide_m_s: speed of the fastest standing ankle or toe.
        sunk_m: depth of the deepest point of the soles under the floor.
    """

    force_n: NDArray[np.float64]
    moment_nm: NDArray[np.float64]
    excess_nm: NDArray[np.float64]
    slide_m_s: NDArray[np.float64]
    sunk_m: NDArray[np.float64]

    def part(self, rows: slice) -> "PhysicsFigures":
        """The figures of some of the frames."""
        return PhysicsFigures(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def joined(parts: list["PhysicsFigures"]) -> "PhysicsFigures":
        """The figures of successive frames."""
        names = [field.name for field in fields(PhysicsFigures)]
        return PhysicsFigures(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class Meter:
    """Measures configurations of a humanoid, `dt` apart [s]."""

    def __init__(self, humanoid: Humanoid, dt: float) -> None:
        self._humanoid, self._dt = humanoid, dt
        self._points = floor_points(humanoid)
        self._kinematics = Kinematics(humanoid)
        self._bounds = torque_bounds(body_mass_kg(humanoid))
        self._inverse = InverseDynamics(humanoid, self._points, dt)

    def measured(
        self, q: NDArray[np.float64], contacts: Contacts | None
    ) -> tuple[PhysicsFigures, NDArray[np.float64]]:
        """Return the figures of configurations, shape (F, nq), at least three, and their canonical joints [m],
        shape (F, 21, 3)."""
        floor_m = floor_height_m(contacts)
        motion = dynamics(self._humanoid, q, self._dt, self._points)
        forces = contact_forces(motion, bearing(motion, self._points, floor_m), shared=True)
        beyond = excess(self._inverse.torques(q, steps(q), forces), self._bounds)
        joints = self._kinematics.sites(q)
        soles = motion.points[:, :SOLE_POINTS, 2]
        figures = PhysicsFigures(
            force_n=_edged(np.linalg.norm(forces.residual[:, :3], axis=1)),
            moment_nm=_edged(ARM_M * np.linalg.norm(forces.residual[:, 3:], axis=1)),
            excess_nm=_edged(np.abs(beyond).sum(axis=1)),
            slide_m_s=self._slide(joints[:, list(JOINTS)], contacts),
            sunk_m=np.maximum(floor_m - soles.min(axis=1), 0.0),
        )
        return figures, joints

    def _slide(self, feet: NDArray[np.float64], contacts: Contacts | None) -> NDArray[np.float64]:
        if contacts is None:
            return np.zeros(len(feet))
        stands = contacts.hold > STANDS
        both = stands[1:] & stands[:-1]
        speed = np.linalg.norm(np.diff(feet, axis=0), axis=2) / self._dt
        return np.concatenate([[0.0], np.where(both, speed, 0.0).max(axis=1)])


def _edged(inner: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.pad(inner, 1, mode="edge")
