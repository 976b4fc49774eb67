"""The banded problem of finishing: all frames' configurations at once.

Minimises, over the tangent steps of all frames, what the cameras disagree with (Cauchy costs, reweighted), how
far each degree of freedom accelerates (its own deviation), how far hinges stray from rest where nothing shows
them, and how far standing feet slide. Gauss-Newton; frames couple with the next two only, so the normal matrix
is banded and the cost grows linearly with the take.

Source: batch estimation with a white-noise-on-acceleration prior (Barfoot, "State estimation for robotics",
2017, section 3.1 and 4.3); Cauchy reweighting (Zhang, "Parameter estimation techniques", 1997, section 9).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import gaussian_filter1d

from studio.engine.finish.body_contact import BodyContact
from studio.engine.finish.contacts import JOINTS, Contacts
from studio.engine.finish.measurements import Measurements
from studio.engine.finish.radii import squared_radii
from studio.engine.finish.trajectory import Kinematics, moved, steps
from studio.engine.human.model import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.human.ranges import dofs_of
from studio.engine.settings import Effector, SolveSettings
from studio.engine.solve.effectors import pull_scale, resist_scale

CAUCHY = 5.0
"""Deviations beyond this many sigma count less and less."""

INFLATION = 3.0
"""A camera's noise is alike from frame to frame: each frame tells this much less than its covariance says."""

DAMPING = 3.0
"""Keeps steps where the linear model holds [1/rad2]."""

MAX_STEP = 0.3
LEAST_FREEDOM = 0.01
"""A joint that resists wholly accelerates by this share of what is usual."""

HELD = 1e10
LIMIT_STIFFNESS = 1e5
"""Of hinges beyond a limit [1/rad2]; what is left beyond it is cut off in the end."""

TAIL = 2.0
"""Accelerations beyond this many deviations are held back less and less: feet land, fists stop."""

LIVELY = 1.4
LIVELY_S = 0.15
MOST_LIVELY = 1.2
"""Where a degree of freedom accelerates, more is to be expected: so many times its root mean square over this time
joins the deviation, which grows to so many times the usual one at most: the twist of a straight leg, which no joint
shows, would else be free where the leg is fast. Where it does not accelerate, `calm` says what is expected."""

REST_WEIGHT = 0.05
"""Of the usual posture, against cameras whose noise is alike from frame to frame: many frames then tell little more
than one. Where each frame errs anew it counts less (`posture_share`), else it bends what many frames agree on."""

PLACE_SIGMA_M = 0.006
"""How far a standing joint may be from its place [m]: soles roll, shoes give."""

LEAST_SIGMA_M = 0.002
NEAR_M = 0.003
"""How far a foot may sink into the floor [m]; one this near to it is held back too, or it would go in with the next
step, and out again."""

# Deviation of accelerations [m/s2, rad/s2] by output joint; the free hips first.
_HIPS = (26.0, 26.0, 37.0, 66.0, 66.0, 66.0)
_ACCELERATION = {
    "Spine": 43.0, "Spine1": 43.0, "Spine2": 43.0, "Neck": 63.0, "Head": 63.0, "Shoulder": 63.0, "Arm": 159.0,
    "ForeArm": 185.0, "Hand": 159.0, "UpLeg": 132.0, "Leg": 185.0, "Foot": 159.0, "ToeBase": 132.0,
}  # fmt: skip


def acceleration_sigma() -> NDArray[np.float64]:
    """Deviation of each degree of freedom's acceleration, shape (nv,)."""
    sides = [
        name.removeprefix("Left").removeprefix("Right") for name in BODY_JOINTS[1:] for _ in dofs_of(name)
    ]
    return np.array([*_HIPS, *(_ACCELERATION[name] for name in sides)])


class _Normal:
    """The normal equations: blocks of the matrix (lower triangle) and the right-hand side."""

    def __init__(self, diagonal: NDArray[np.float64], right: NDArray[np.float64]) -> None:
        frames, nv = right.shape
        self.diagonal = diagonal  # (frame_count, nv, nv)
        self.right = right  # (frame_count, nv)
        self.next = np.zeros((frames - 1, nv, nv))  # columns t (first), rows t + 1
        self.second = np.zeros((frames - 2, nv))  # diagonal of rows t + 2, columns t

    def solve(self) -> NDArray[np.float64]:
        """The steps, shape (frame_count, nv)."""
        frames, nv = self.right.shape
        columns = np.zeros(
            (frames, nv, 2 * nv + 1)
        )  # by LAPACK's columns: the diagonal, then what is below it
        for j in range(nv):
            columns[:, j, : nv - j] = self.diagonal[:, j, j:]
            columns[:-1, j, nv - j : 2 * nv - j] = self.next[:, j]
        columns[:-2, :, 2 * nv] = self.second
        columns[:, :, 0] += DAMPING
        band = columns.reshape(frames * nv, -1).T
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return cho_solve_banded((factor, True), self.right.ravel(), check_finite=False).reshape(frames, nv)


class Smoother:
    """One Gauss-Newton step for the frames of a window, `dt` apart [s].

    Attributes:
        posture_share: how much the usual posture counts, 0..1.
        calm: share of the usual deviation that is expected where nothing accelerates, 0..1: noise that each frame
            errs anew in would else be followed there; accelerations count so much more.
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
        """Prepare; `lively`: accelerations are expected where there are some; `effectors`: None = as usual."""
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

    def stepped(
        self,
        q: NDArray[np.float64],
        measurements: Measurements,
        contacts: Contacts | None,
        *,
        held: tuple[int, int] = (0, 0),
    ) -> NDArray[np.float64]:
        """Return the window's configurations after one step towards the minimum.

        Args:
            q: configurations, shape (frame_count, nq).
            measurements: of the same frames.
            contacts: of the same frames; None = nobody stands.
            held: how many frames at the beginning and at the end stay: their other neighbours are not here.
        """
        normal = self._normal(q, measurements, contacts)
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
        """Return configurations, shape (frame_count, nq), with every hinge within its limits."""
        return np.concatenate([q[:, :7], np.clip(q[:, 7:], self._low, self._high)], axis=1)

    def _limit_rows(self, q: NDArray[np.float64], normal: _Normal) -> None:
        """Hinges beyond a limit are pulled back to it."""
        beyond = q[:, 7:] - np.clip(q[:, 7:], self._low, self._high)
        k = np.arange(FREE_DOFS, q.shape[1] - 1)
        normal.diagonal[:, k, k] += LIMIT_STIFFNESS * (beyond != 0.0)
        normal.right[:, FREE_DOFS:] -= LIMIT_STIFFNESS * beyond

    def _normal(
        self, q: NDArray[np.float64], measurements: Measurements, contacts: Contacts | None
    ) -> _Normal:
        sites, jacobians = self._kinematics.linearised(q)
        frames, nv = len(sites), jacobians.shape[2]
        weight, pull = _camera_rows(sites, measurements)
        if contacts is not None:
            _add_contact_rows(contacts, sites, weight, pull)
        j = jacobians.reshape(frames, -1, 3, nv)
        weighted = np.matmul(weight, j).reshape(frames, -1, nv)
        normal = _Normal(
            np.matmul(jacobians.transpose(0, 2, 1), weighted),
            np.matmul(pull.reshape(frames, 1, -1), jacobians)[:, 0],
        )
        if self._body is not None:
            _add_rows(normal, *self._body.rows(sites, jacobians))
        self._rest_rows(q, normal)
        self._limit_rows(q, normal)
        self._acceleration_rows(q, normal)
        return normal

    def _rest_rows(self, q: NDArray[np.float64], normal: _Normal) -> None:
        stiffness = self.posture_share * self._rest_stiffness
        k = np.arange(len(stiffness))
        normal.diagonal[:, k, k] += stiffness
        normal.right[:, FREE_DOFS:] -= stiffness[FREE_DOFS:] * (q[:, 7:] - self._rest)

    def _acceleration_stiffness(self, acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
        """How stiffly accelerations are held back, shape (frame_count - 2, nv) as theirs."""
        stiffness = self._stiffness
        if self._lively:
            usual = gaussian_filter1d(
                stiffness * acceleration**2, LIVELY_S / self._dt, axis=0, mode="nearest", truncate=3.0
            )
            expected = self.calm**2 + (LIVELY / self.calm) ** 2 * usual
            stiffness = stiffness / np.minimum(expected, MOST_LIVELY**2)
        return stiffness / (1.0 + stiffness * acceleration**2 / TAIL**2)

    def _acceleration_rows(self, q: NDArray[np.float64], normal: _Normal) -> None:
        acceleration = np.diff(steps(q), axis=0)
        stiffness = self._acceleration_stiffness(acceleration)
        pull = stiffness * acceleration
        normal.right[:-2] -= pull
        normal.right[1:-1] += 2.0 * pull
        normal.right[2:] -= pull
        k = np.arange(stiffness.shape[1])
        for rows, factor in ((slice(None, -2), 1.0), (slice(1, -1), 4.0), (slice(2, None), 1.0)):
            normal.diagonal[rows, k, k] += factor * stiffness
        normal.next[:-1, k, k] -= 2.0 * stiffness
        normal.next[1:, k, k] -= 2.0 * stiffness
        normal.second += stiffness


def _camera_rows(
    sites: NDArray[np.float64], measurements: Measurements
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per frame and joint: the cameras' information, reweighted, shape (frame_count, 21, 3, 3), and information
    times difference, shape (frame_count, 21, 3)."""
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
    """Standing joints are where they stand, and no joint of a foot is under the floor."""
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


def _add_rows(
    normal: _Normal, frames: NDArray[np.int64], rows: NDArray[np.float64], residuals: NDArray[np.float64]
) -> None:
    """Add rows, shape (row_count, nv), each of one frame, with what they are to move by, shape (row_count,)."""
    for frame, row, residual in zip(frames.tolist(), rows, residuals, strict=True):
        normal.diagonal[frame] += np.outer(row, row)
        normal.right[frame] += residual * row
