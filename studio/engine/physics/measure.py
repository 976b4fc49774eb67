"""How well forces explain a motion, frame by frame: what decides where physics is kept, and what is reported."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from studio.engine.finish.contacts import JOINTS, Contacts
from studio.engine.finish.trajectory import Kinematics, steps
from studio.engine.human.model import Humanoid
from studio.engine.physics.correction import floor_height_m
from studio.engine.physics.dynamics import body_mass_kg, dynamics
from studio.engine.physics.forces import ARM_M, bearing, contact_forces
from studio.engine.physics.points import SOLE_POINTS, floor_points
from studio.engine.physics.strength import torque_bounds
from studio.engine.physics.torques import InverseDynamics

STANDS = 0.99
"""A joint stands where the contacts hold it this firmly."""


@dataclass(frozen=True)
class Figures:
    """Figures of some frames, shape (F,) each; the first and last frame have their neighbours'.

    Attributes:
        force_n: size of the external force that no contact explains [N].
        moment_nm: size of the unexplained moment [N m].
        excess_nm: torques beyond what joints can hold, summed over the joints [N m].
        slide_m_s: speed of standing ankles and toes, the fastest.
        sunk_m: how deep the deepest point of the soles is under the floor.
    """

    force_n: NDArray[np.float64]
    moment_nm: NDArray[np.float64]
    excess_nm: NDArray[np.float64]
    slide_m_s: NDArray[np.float64]
    sunk_m: NDArray[np.float64]

    def part(self, rows: slice) -> "Figures":
        """The figures of some of the frames."""
        return Figures(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def joined(parts: list["Figures"]) -> "Figures":
        """The figures of frames that follow each other."""
        names = [field.name for field in fields(Figures)]
        return Figures(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class Meter:
    """Measures configurations of a humanoid, `dt` apart [s]."""

    def __init__(self, humanoid: Humanoid, dt: float) -> None:
        self._humanoid, self._dt = humanoid, dt
        self._points = floor_points(humanoid)
        self._kinematics = Kinematics(humanoid)
        self._inverse = InverseDynamics(humanoid, self._points, torque_bounds(body_mass_kg(humanoid)), dt)

    def measured(
        self, q: NDArray[np.float64], contacts: Contacts | None
    ) -> tuple[Figures, NDArray[np.float64]]:
        """Return the figures of configurations, shape (F, nq), at least three, and their canonical joints [m],
        shape (F, 21, 3)."""
        floor_m = floor_height_m(contacts)
        motion = dynamics(self._humanoid, q, self._dt, self._points)
        forces = contact_forces(motion, bearing(motion, self._points, floor_m), shared=True)
        torques = self._inverse.torques(q, steps(q), forces)
        joints = self._kinematics.sites(q)
        soles = motion.points[:, :SOLE_POINTS, 2]
        figures = Figures(
            force_n=_edged(np.linalg.norm(forces.residual[:, :3], axis=1)),
            moment_nm=_edged(ARM_M * np.linalg.norm(forces.residual[:, 3:], axis=1)),
            excess_nm=_edged(np.abs(torques.excess).sum(axis=1)),
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
