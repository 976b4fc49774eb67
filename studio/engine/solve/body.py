"""Steps 7 to 9 for one performer: from the fused skeleton to a pose of the output skeleton."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import quaternions
from studio.engine.model.calibration import Performer
from studio.engine.model.frames import FrameSet, FusedSkeleton
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
)
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.completion.fingers import Fingers, hand_models
from studio.engine.solve.completion.floor import FloorContact
from studio.engine.solve.completion.followed import Followed, FollowedSmoother, follow_head
from studio.engine.solve.completion.hands import Hands
from studio.engine.solve.completion.head_follower import HeadFollower
from studio.engine.solve.completion.look_at import LookAt
from studio.engine.solve.completion.relax import RelaxPose
from studio.engine.solve.conditioning.after import ConditioningAfter
from studio.engine.solve.ik.solver import Solver
from studio.engine.solve.ik.swing import swing_rotations
from studio.engine.solve.kalman.body_filter import BodyFilter
from studio.engine.solve.uncertainty import Uncertainty

PoseArrays = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""positions_m (52, 3), rotations_wxyz (52, 4), confidence (52,), uncertainty_mm (52,)."""

_HIPS = INDEX["hips"]


class BodySolver:
    """Solves one performer's poses from joints, frame by frame.

    Attributes:
        configuration: the humanoid's last solved configuration, shape (nq,); None without one.
    """

    def __init__(self, performer: Performer, settings: SolveSettings) -> None:
        self._skeleton = Skeleton.of(performer)
        self._relax: RelaxPose | None = None
        self._solver: Solver | BodyFilter | None = None
        if settings.ik != "none":
            limited = settings.human_limits == "on"
            humanoid = build_humanoid(self._skeleton, human_limits=limited, flexibility=settings.flexibility)
            kalman = settings.ik == "kalman_filter"
            self._solver = BodyFilter(humanoid, settings) if kalman else Solver(humanoid, settings)
            self._data = mujoco.MjData(humanoid.model)
            if settings.relax_pose > 0:
                self._relax = RelaxPose(humanoid, settings.relax_pose)
        self._last_joints = np.full((len(CANONICAL), 3), np.nan)
        self._last_rotations: NDArray[np.float64] | None = None
        self.configuration: NDArray[np.float64] | None = None
        self._floor = FloorContact(self._skeleton) if settings.floor_contact == "on" else None
        self._look_at = LookAt.of(settings)
        self._head = HeadFollower()
        self._hands = None
        if settings.hands != "off":
            self._hands = Hands(settings.hands, flexibility=settings.flexibility)
        self._fingers = None
        if settings.fingers == "on":
            self._fingers = Fingers(hand_models(self._skeleton, settings))
        direct = settings.solves_cameras_joints
        self._filter = self._solver if isinstance(self._solver, BodyFilter) and direct else None
        self._uncertainty = Uncertainty(
            filtered=settings.fusion == "robust",
            solved=self._solver is not None,
            of_cameras=self._filter is not None,
        )
        humanoid = None if self._solver is None else self._solver.humanoid
        self._after = ConditioningAfter(settings, self._skeleton, humanoid)

    @property
    def fuses(self) -> bool:
        """Whether the solve takes the cameras' joints directly (`pose_of_cameras`) instead of fused ones (`pose`)."""
        return self._filter is not None

    def stand_beside(self, other: "BodySolver") -> None:
        """Use the floor that another performer's feet find, where both solves find one."""
        if self._filter is not None and other._filter is not None:
            self._filter.stand_beside(other._filter)

    def pose_of_cameras(self, frames: FrameSet, dt: float) -> tuple[FusedSkeleton, PoseArrays | None]:
        """Return the cameras' joints that were used, fused, and the pose; None until the performer has been seen."""
        assert self._filter is not None
        fused, self.configuration = self._filter.follow(frames, dt)
        if self.configuration is None:
            return fused, None
        posed = self._posed(self._filter, self.configuration)
        return fused, self._completed(*posed, fused, frames, dt)

    def pose(self, fused: FusedSkeleton, frames: FrameSet, dt: float) -> PoseArrays | None:
        """Return the pose, or None until the performer has been seen."""
        if self._solver is None:
            posed = self._unsolved(fused)
        else:
            self.configuration = self._solved(self._solver, fused, dt)
            posed = None if self.configuration is None else self._posed(self._solver, self.configuration)
        return None if posed is None else self._completed(*posed, fused, frames, dt)

    def pose_of(
        self,
        q: NDArray[np.float64],
        fused: FusedSkeleton,
        frames: FrameSet,
        dt: float,
        followed: Followed | None = None,
    ) -> PoseArrays:
        """Return the completed pose of a configuration from finishing; `followed`: hands and head from finishing."""
        assert self._solver is not None
        return self._completed(*self._posed(self._solver, q), fused, frames, dt, followed)

    def add_to(self, smoother: FollowedSmoother, q: NDArray[np.float64], frames: FrameSet, dt: float) -> None:
        """Add a configuration from finishing, and the cameras' frames of that instant, to a smoother."""
        assert self._solver is not None
        smoother.add(*self._posed(self._solver, q), frames, dt)

    def _completed(
        self,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
        fused: FusedSkeleton,
        frames: FrameSet,
        dt: float,
        followed: Followed | None = None,
    ) -> PoseArrays:
        """Steps 8 and 9 on positions (52, 3) and world rotations (52, 3, 3)."""
        free = self._solver is None
        floor_m = self._filter.floor_m if self._filter is not None else 0.0
        if self._look_at is not None:
            face = self._face(self._look_at, positions, rotations, frames, dt, followed)
            self._look_at.apply(positions, rotations, frames.head_wxyz, dt, face)
        if self._hands is not None:
            self._hands.apply(rotations, frames.hands, dt)
        if self._fingers is not None:
            if followed is None:
                states = self._fingers.follow_states(positions, rotations, frames, self._hands, dt)
            else:
                states = followed.hands
            self._fingers.turn(rotations, states)
        if free:
            positions[OUTPUT_OF_CANONICAL_INDEX] = self._after.joints(
                positions[OUTPUT_OF_CANONICAL_INDEX], dt
            )
        root, rotations = self._after.apply(positions[0], rotations, dt)
        solved = forward_positions(self._skeleton, root, rotations)
        if free:  # measured joints stay where they were measured
            solved[OUTPUT_OF_CANONICAL_INDEX] = positions[OUTPUT_OF_CANONICAL_INDEX]
            solved = _fingers_with_hand(solved, self._skeleton, rotations)
        elif self._floor is not None:
            solved[:, 2] += self._floor.lift(solved - [0.0, 0.0, floor_m])
        confidence, uncertainty_mm = self._uncertainty.of(solved, fused, frames, dt)
        solved[:, 2] -= floor_m
        return solved, quaternions(rotations), confidence, uncertainty_mm

    def _face(
        self,
        look_at: LookAt,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
        frames: FrameSet,
        dt: float,
        followed: Followed | None,
    ) -> NDArray[np.float64] | None:
        """World rotation of the head by its face's landmarks, 3x3; None = not followed."""
        if not look_at.measures:
            return None
        if followed is None:
            step = follow_head(self._head, look_at, positions, rotations, frames, dt)
            turn = None if step is None else step.state.turn
        else:
            turn = followed.head
        return None if turn is None else look_at.straight(rotations) @ turn

    def _solved(
        self, solver: Solver | BodyFilter, fused: FusedSkeleton, dt: float
    ) -> NDArray[np.float64] | None:
        """The humanoid's configuration solved for the joints."""
        joints, sigma = fused.positions, fused.sigma
        if self._floor is not None and isinstance(solver, Solver):
            joints, sigma = self._floor.targets(joints, sigma, dt)
        return solver.solve(joints, sigma, dt)

    def _posed(
        self, solver: Solver | BodyFilter, q: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (52, 3), fingers' unset, and world rotations (52, 3, 3) of a configuration."""
        if self._relax is not None:
            q = self._relax.apply(q)
        humanoid = solver.humanoid
        self._data.qpos[:] = q
        mujoco.mj_kinematics(humanoid.model, self._data)
        rotations = np.empty((len(OUTPUT_JOINTS), 3, 3))
        rotations[humanoid.body_outputs] = self._data.xmat[humanoid.body_ids].reshape(-1, 3, 3)
        for finger in _FINGER_JOINTS:
            rotations[finger] = rotations[OUTPUT_PARENTS[finger]]
        positions = np.empty((len(OUTPUT_JOINTS), 3))
        positions[humanoid.body_outputs] = self._data.xpos[humanoid.body_ids]
        return positions, rotations

    def _unsolved(self, fused: FusedSkeleton) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Positions and world rotations of the fused joints without a solve; an unseen joint keeps its last place."""
        joints = np.where(np.isnan(fused.positions), self._last_joints, fused.positions)
        self._last_joints = joints
        rotations = swing_rotations(self._skeleton, joints)
        if rotations is None or np.isnan(joints[_HIPS]).any() or np.isnan(rotations).any():
            if self._last_rotations is None or np.isnan(joints[_HIPS]).any():
                return None
            rotations = self._last_rotations.copy()
        self._last_rotations = rotations.copy()
        positions = forward_positions(self._skeleton, joints[_HIPS], rotations)
        measured = np.isfinite(joints[:, 0])
        positions[OUTPUT_OF_CANONICAL_INDEX[measured]] = joints[measured]
        return positions, rotations


_FINGER_JOINTS = [
    OUTPUT_INDEX[n] for n in OUTPUT_JOINTS if "Hand" in n and n not in ("LeftHand", "RightHand")
]


def _fingers_with_hand(
    positions: NDArray[np.float64], skeleton: Skeleton, rotations: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Positions with the fingers carried by the hands, except the measured base of the middle finger."""
    for finger in _FINGER_JOINTS:
        if finger not in OUTPUT_OF_CANONICAL_INDEX:
            parent = OUTPUT_PARENTS[finger]
            positions[finger] = positions[parent] + rotations[parent] @ skeleton.offsets_m[finger]
    return positions
