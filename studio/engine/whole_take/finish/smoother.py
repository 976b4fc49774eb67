"""The banded problem of finishing: all frames' configurations at once.

Minimises, over the tangent steps of all frames, the sum of the cameras' residuals (Cauchy costs, reweighted), the
accelerations of the degrees of freedom (each with its own deviation), the distance of unobserved hinges from rest,
and the sliding of standing feet. The method is Gauss-Newton. Frames couple with the next two only, so the normal
matrix is banded and the cost grows linearly with the take.

Source: batch estimation with a white-noise-on-acceleration prior (Barfoot, "State estimation for robotics",
2017, section 3.1 and 4.3); Cauchy reweighting (Zhang, "Parameter estimation techniques", 1997, section 9).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.model.frames import Pinned
from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.settings.switches import Effector
from studio.engine.solve.ik.effectors import pull_scale, resist_scale
from studio.engine.whole_take.finish.banded import (
    BandedNormal,
    NormalEquations,
    add_accelerations,
    add_rows,
)
from studio.engine.whole_take.finish.contact.body_contact import BodyContact
from studio.engine.whole_take.finish.contact.contacts import JOINTS, Contacts
from studio.engine.whole_take.finish.contact.others import OtherBodies, OtherPerformer
from studio.engine.whole_take.finish.guessed_legs import add_guessed_legs
from studio.engine.whole_take.finish.measurements import Measurements
from studio.engine.whole_take.finish.radii import squared_radii
from studio.engine.whole_take.finish.trajectory import Kinematics, moved, steps

CAUCHY = 5.0
"""Normalised residual from which the weight falls."""

INFLATION = 3.0
"""A camera's noise is correlated between frames: each frame carries this much less information than its covariance
says."""

MAX_STEP = 0.3
LEAST_FREEDOM = 0.01
"""Smallest factor of the acceleration's deviation, for a joint at full resistance."""

HELD = 1e10
LIMIT_STIFFNESS = 1e5
"""Stiffness of hinges beyond a limit [1/rad2]; the final result is clamped."""

TAIL = 2.0
"""Accelerations beyond this many deviations are damped less, because feet land and fists stop."""

LIVELY = 1.4
LIVELY_S = 0.15
MOST_LIVELY = 1.2
"""Adaptive acceleration prior: the expected deviation grows with this factor of the root mean square over this time,
to at most this multiple of the usual. Without the bound, the unobserved twist of a straight leg would be free in fast
motion. Without acceleration, `calm` gives the deviation.
"""

STEADY = ((0.4, 1.0), (1.0, 0.5))
"""Factor of the hips' deviation by `calm`: 1 where noise is independent between frames (`calm` is 0.4), a half where
it is as correlated as that of depth cameras. Such noise moves the whole body.
"""

REST_WEIGHT = 0.05
"""Weight of the usual posture against cameras with noise that is correlated between frames, where many frames carry
little more information than one. With independent noise it is reduced (`posture_share`), or it would bend the
measured pose.
"""

PLACE_SIGMA_M = 0.006
"""Standard deviation of a standing joint from its place [m]: soles roll, shoes give."""

LEAST_SIGMA_M = 0.002
NEAR_M = 0.003
"""Standard deviation of a foot below the floor [m], and the distance above the floor from which a foot is damped;
without this damping, steps would alternate into the floor and out.
"""

# Standard deviation of accelerations [m/s2, rad/s2] by output joint; the free hips first.
_HIPS = (26.0, 26.0, 37.0, 66.0, 66.0, 66.0)
_ACCELERATION = {
    "Spine": 43.0, "Spine1": 43.0, "Spine2": 43.0, "Neck": 63.0, "Head": 63.0, "Shoulder": 63.0, "Arm": 159.0,
    "ForeArm": 185.0, "Hand": 159.0, "UpLeg": 132.0, "Leg": 185.0, "Foot": 159.0, "ToeBase": 132.0,
}  # fmt: skip


def acceleration_sigma() -> NDArray[np.float64]:
    """Standard deviation of each degree of freedom's acceleration, shape (nv,)."""
    sides = [
        name.removeprefix("Left").removeprefix("Right") for name in BODY_JOINTS[1:] for _ in dofs_of(name)
    ]
    return np.array([*_HIPS, *(_ACCELERATION[name] for name in sides)])


class Smoother:
    """One Gauss-Newton step for the frames of a window, `dt` apart [s].

    Attributes:
        posture_share: weight of the usual posture, 0..1.
        calm: expected acceleration at rest as a share of the usual deviation, 0..1. With noise that is independent
            between frames it is small, or the solve would follow the noise.
    """

    def __init__(
        self,
        humanoid: Humanoid,
        dt: float,
        *,
        limited: bool = True,
        lively: bool = True,
        effectors: dict[str, Effector] | None = None,
    ) -> None:
        """Prepare; `lively`: adapt the acceleration prior to the motion; `effectors`: None = as usual."""
        effectors = effectors or SolveSettings().effectors
        self._kinematics = Kinematics(humanoid, pull_scale(humanoid, effectors))
        freedom = np.maximum(resist_scale(humanoid, effectors), LEAST_FREEDOM)
        self._stiffness = 1.0 / (acceleration_sigma() * freedom * dt**2) ** 2
        rest = REST_WEIGHT / humanoid.spread_rad**2 * dt * 60.0
        self._rest_stiffness = np.concatenate([np.zeros(FREE_DOFS), rest])
        self._rest = humanoid.rest_q
        self._low, self._high = humanoid.range_rad.T if limited else (-np.inf, np.inf)
        self._dt, self._lively = dt, lively
        self.posture_share = self.calm = 1.0
        self._body = BodyContact(humanoid.skeleton.height_m) if limited and lively else None
        self._others = OtherBodies(humanoid.skeleton.height_m)

    def stepped(
        self,
        q: NDArray[np.float64],
        measurements: Measurements,
        contacts: Contacts | None,
        *,
        held: tuple[int, int] = (0, 0),
        others: Sequence[OtherPerformer] = (),
        pinned: Pinned | None = None,
    ) -> NDArray[np.float64]:
        """Return the window's configurations after one step towards the minimum.

        Args:
            q: configurations, shape (frame_count, nq).
            measurements: of the same frames.
            contacts: of the same frames; None = no stances.
            held: number of frames at the beginning and at the end that do not change, because their other neighbours
                are outside the window.
            others: other performers in the same frames.
            pinned: known joints in the same frames; None = none.
        """
        normal = self._normal(q, measurements, contacts)
        if pinned is not None and pinned.information.any():
            _add_pinned_rows(normal, q, self._kinematics, pinned)
        for other in others:
            add_rows(normal, *self._others.rows(q, self._kinematics, other))
        k = np.arange(q.shape[1] - 1)
        for edge in (slice(0, held[0]), slice(len(q) - held[1], None)):
            normal.diagonal[edge, k[:, None], k[:, None]] += HELD
            normal.right[edge] = 0.0
        return moved(q, np.clip(normal.solve(), -MAX_STEP, MAX_STEP))

    def squared_radii(self, q: NDArray[np.float64], measurements: Measurements) -> NDArray[np.float64]:
        """Return squared radii of canonical joints' 90 % balls [m2], shape (frame_count, 21); see `radii`."""
        sites = self._kinematics.sites(q)
        return squared_radii(sites, *_camera_rows(sites, measurements), self._dt)

    def within_limits(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return configurations, shape (frame_count, nq), with every hinge clamped to its limits."""
        return np.concatenate([q[:, :7], np.clip(q[:, 7:], self._low, self._high)], axis=1)

    def _limit_rows(self, q: NDArray[np.float64], normal: BandedNormal) -> None:
        """Pull hinges beyond a limit back to it."""
        beyond = q[:, 7:] - np.clip(q[:, 7:], self._low, self._high)
        k = np.arange(FREE_DOFS, q.shape[1] - 1)
        normal.diagonal[:, k, k] += LIMIT_STIFFNESS * (beyond != 0.0)
        normal.right[:, FREE_DOFS:] -= LIMIT_STIFFNESS * beyond

    def _normal(
        self, q: NDArray[np.float64], measurements: Measurements, contacts: Contacts | None
    ) -> NormalEquations:
        return self._equations(q, measurements, contacts)

    def _equations(
        self, q: NDArray[np.float64], measurements: Measurements, contacts: Contacts | None
    ) -> BandedNormal:
        sites, jacobians = self._kinematics.linearised(q)
        frames, nv = len(sites), jacobians.shape[2]
        weight, pull = _camera_rows(sites, measurements)
        add_guessed_legs(weight, pull, sites, measurements, INFLATION)
        if contacts is not None:
            _add_contact_rows(contacts, sites, weight, pull)
        j = jacobians.reshape(frames, -1, 3, nv)
        weighted = np.matmul(weight, j).reshape(frames, -1, nv)
        normal = BandedNormal(
            np.matmul(jacobians.transpose(0, 2, 1), weighted),
            np.matmul(pull.reshape(frames, 1, -1), jacobians)[:, 0],
        )
        if self._body is not None:
            add_rows(normal, *self._body.rows(sites, jacobians))
        self._rest_rows(q, normal)
        self._limit_rows(q, normal)
        self._acceleration_rows(q, normal)
        return normal

    def _rest_rows(self, q: NDArray[np.float64], normal: BandedNormal) -> None:
        stiffness = self.posture_share * self._rest_stiffness
        k = np.arange(len(stiffness))
        normal.diagonal[:, k, k] += stiffness
        normal.right[:, FREE_DOFS:] -= stiffness[FREE_DOFS:] * (q[:, 7:] - self._rest)

    def _acceleration_stiffness(self, acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stiffness of the accelerations, shape (frame_count - 2, nv)."""
        stiffness = self._stiffness
        if self._lively:
            stiffness = stiffness.copy()
            stiffness[:FREE_DOFS] /= np.interp(self.calm, *STEADY) ** 2
            usual = gaussian_filter1d(
                stiffness * acceleration**2, LIVELY_S / self._dt, axis=0, mode="nearest", truncate=3.0
            )
            expected = self.calm**2 + (LIVELY / self.calm) ** 2 * usual
            stiffness = stiffness / np.minimum(expected, MOST_LIVELY**2)
        return stiffness / (1.0 + stiffness * acceleration**2 / TAIL**2)

    def _acceleration_rows(self, q: NDArray[np.float64], normal: BandedNormal) -> None:
        acceleration = np.diff(steps(q), axis=0)
        add_accelerations(normal, acceleration, self._acceleration_stiffness(acceleration))


def _camera_rows(
    sites: NDArray[np.float64], measurements: Measurements
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per frame and joint: the cameras' reweighted information, shape (frame_count, 21, 3, 3), and information times
    difference, shape (frame_count, 21, 3).
    """
    rays, lateral = measurements.rays, measurements.lateral
    difference = measurements.off(sites)
    along = np.einsum("tcja,tcja->tcj", difference, rays)
    beyond = measurements.axial - lateral  # along the ray
    squared = measurements.squared(difference)
    cauchy = 1.0 / (1.0 + squared / CAUCHY**2) / INFLATION
    lateral, beyond = cauchy * lateral, cauchy * beyond
    weight = np.einsum("tcj,tcja,tcjb->tjab", beyond, rays, rays)
    k = np.arange(3)
    weight[:, :, k, k] += lateral.sum(axis=1)[..., None]
    pull = np.einsum("tcj,tcja->tja", lateral, difference) + np.einsum("tcj,tcja->tja", beyond * along, rays)
    return weight, pull


def _add_contact_rows(
    contacts: Contacts, sites: NDArray[np.float64], weight: NDArray[np.float64], pull: NDArray[np.float64]
) -> None:
    """Pull standing joints to their places, and every joint of a foot above the floor."""
    hold = contacts.hold / PLACE_SIGMA_M**2
    joints = list(JOINTS)
    k = np.arange(3)
    weight[:, np.array(joints)[:, None], k, k] += hold[..., None]
    pull[:, joints] += hold[..., None] * (contacts.place_m - sites[:, joints])
    below = contacts.least_m - sites[:, joints, 2]
    sunk = np.maximum(below, 0.0)
    near = np.clip(1.0 + below / NEAR_M, 0.0, 1.0) ** 2 * (contacts.hold == 0.0)
    weight[:, joints, 2, 2] += np.where(below > 0.0, 1.0, near) / LEAST_SIGMA_M**2
    pull[:, joints, 2] += sunk / LEAST_SIGMA_M**2


def _add_pinned_rows(
    normal: NormalEquations, q: NDArray[np.float64], kinematics: Kinematics, pinned: Pinned
) -> None:
    """Pull joints to the places that an operator knows; distant ones keep their full weight."""
    known = np.flatnonzero(pinned.information.any(axis=1))
    sites, jacobians = kinematics.linearised(q[known])
    here = pinned.part(known)
    told, away = here.rows(sites)
    jacobians = here.moving(sites, jacobians)
    rows = np.repeat(told, 3, axis=1)
    normal.diagonal[known] += np.matmul(jacobians.transpose(0, 2, 1), rows[..., None] * jacobians)
    pull = (told[..., None] * away).reshape(len(known), 1, -1)
    normal.right[known] += np.matmul(pull, jacobians)[:, 0]
