"""The usual way of retargeting, frame by frame, as a baseline: mink set up as General Motion Retargeting does.

Two problems are solved for each frame, starting from the frame before: first the rotations of all parts and the
positions of pelvis and feet, then all positions too. Costs, damping, iterations, velocity limit and solver are those
of that program's configuration for the Unitree G1; the robot's points and axes are this studio's.

Source: Araujo, Ze, Xu, Wu, Liu, "Retargeting matters: general motion retargeting for humanoid motion tracking", 2025.
"""

from collections.abc import Callable

import mink
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import quaternions
from studio.engine.base.quaternions import multiply, rotate
from studio.engine.robots.body.parts import SIDES
from studio.engine.robots.body.robot import INDEX, Robot
from studio.engine.robots.moving.performed import SIDES as PERFORMER_SIDES
from studio.engine.robots.moving.performed import Performed
from studio.engine.robots.moving.targets import Targets

Array = NDArray[np.float64]

DAMPING = 0.5
LM_DAMPING = 1.0
ITERATIONS = 10
LEAST_GAIN = 0.001
"""Each problem is iterated while its error falls by more than this, for at most `ITERATIONS` after the first step."""

VELOCITY_RAD_S = 3.0 * np.pi

# point: cost of position and rotation, in the first and in the second problem
_COSTS = {
    "pelvis_up": ((100.0, 10.0), (100.0, 5.0)),
    "torso_front": ((0.0, 10.0), (0.0, 10.0)),
    "hip": ((0.0, 10.0), (10.0, 5.0)),
    "knee": ((0.0, 10.0), (10.0, 5.0)),
    "ankle": ((100.0, 10.0), (100.0, 50.0)),
    "shoulder": ((0.0, 10.0), (10.0, 5.0)),
    "elbow": ((0.0, 10.0), (10.0, 5.0)),
    "hand": ((0.0, 10.0), (10.0, 5.0)),
}


class PerFrame:
    """Solves a robot's configurations one after the other."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._configuration = mink.Configuration(robot.model, robot.standing)
        self._limits = [
            mink.ConfigurationLimit(robot.model),
            mink.VelocityLimit(robot.model, dict.fromkeys(robot.joint_names, VELOCITY_RAD_S)),
        ]
        self._points = [
            point
            for part in _COSTS
            for point in ((part,) if part in INDEX else (f"{side}_{part}" for side in SIDES))
        ]
        self._problems = [
            [self._task(point, _COSTS[point.split("_", 1)[1] if point.startswith(SIDES) else point][stage])
             for point in self._points]
            for stage in (0, 1)
        ]  # fmt: skip
        data = self._configuration.data
        self._rest = {point: _wxyz(data.site(f"studio_{point}").xmat) for point in self._points}

    def _task(self, point: str, costs: tuple[float, float]) -> mink.FrameTask:
        place, turn = costs
        return mink.FrameTask(f"studio_{point}", "site", place, turn, lm_damping=LM_DAMPING)

    def solve(
        self,
        targets: Targets,
        turns: dict[str, Array],
        *,
        progress: Callable[[float], None] = lambda share: None,
    ) -> Array:
        """Return configurations, shape (frame_count, nq).

        Args:
            targets: targets of the robot's points.
            turns: rotation of the body at each point from the zero pose, robot's axes, shape (frame_count, 4).
            progress: receives the share done.
        """
        q = self._robot.standing
        q[:3] += targets.points_m[0, [INDEX["left_hip"], INDEX["right_hip"]]].mean(
            axis=0
        ) - self._robot.at_rest_m[[INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=0)
        q[3:7] = targets.hips_wxyz[0]
        self._configuration.update(q)
        out = np.empty((len(targets), len(q)))
        rows = {point: multiply(turns[point], self._rest[point]) for point in self._points}
        for t in range(len(targets)):
            for point, *tasks in zip(self._points, *self._problems, strict=True):
                target = mink.SE3.from_rotation_and_translation(
                    mink.SO3(rows[point][t]), targets.points_m[t, INDEX[point]]
                )
                for task in tasks:
                    task.set_target(target)
            for _ in range(50 if t == 0 else 1):  # the first frame starts from a stance
                for tasks in self._problems:
                    self._iterate(tasks)
            out[t] = self._configuration.q
            progress((t + 1) / len(targets))
        return out

    def _iterate(self, tasks: list[mink.FrameTask]) -> None:
        before = self._step(tasks, None)
        for _ in range(ITERATIONS + 1):
            after = self._step(tasks, before)
            if before - after <= LEAST_GAIN:
                return
            before = after

    def _step(self, tasks: list[mink.FrameTask], error: float | None) -> float:
        """Take a step and return the error; with `error` None, only return the current error."""
        if error is not None:
            dt = self._robot.model.opt.timestep
            velocity = mink.solve_ik(self._configuration, tasks, dt, "daqp", DAMPING, limits=self._limits)
            self._configuration.integrate_inplace(velocity, dt)
        return float(
            np.linalg.norm(np.concatenate([task.compute_error(self._configuration) for task in tasks]))
        )


def _wxyz(matrix: Array) -> Array:
    return mink.SO3.from_matrix(matrix.reshape(3, 3)).wxyz


def part_turns(robot: Robot, motion: Performed, targets: Targets) -> dict[str, Array]:
    """Return the rotation of the body at each point from the zero pose, robot's axes, wxyz, shape (frame_count, 4).

    The bone of a limb takes the performer's direction, and its knee or elbow the performer's axis.
    """
    out = {"pelvis_up": targets.hips_wxyz, "torso_front": targets.chest_wxyz}
    for k, (side, theirs) in enumerate(zip(SIDES, PERFORMER_SIDES, strict=True)):
        out[f"{side}_ankle"] = targets.feet_wxyz[:, k]
        outward = np.array([0.0, 0.0, -1.0 if k == 0 else 1.0])  # axis of an elbow in the T-pose
        for point, end, joint, bend, axis in (
            ("hip", "knee", "UpLeg", "knee", np.array([1.0, 0.0, 0.0])),
            ("knee", "ankle", "Leg", "knee", np.array([1.0, 0.0, 0.0])),
            ("shoulder", "elbow", "Arm", "elbow", outward),
            ("elbow", "hand", "ForeArm", "elbow", outward),
        ):
            first, last = INDEX[f"{side}_{point}"], INDEX[f"{side}_{end}"]
            bone = targets.points_m[:, last] - targets.points_m[:, first]
            rest = _frames(
                (robot.at_rest_m[last] - robot.at_rest_m[first])[None],
                robot.bend_axes[f"{side}_{bend}"][None],
            )
            now = _frames(bone, rotate(motion.turned[theirs + joint], axis))
            out[f"{side}_{point}"] = quaternions(now @ rest.transpose(0, 2, 1))
        out[f"{side}_hand"] = out[f"{side}_elbow"]
    return out


def _frames(bones: Array, axes: Array) -> Array:
    """Return rotations with the first column along the bone and the second nearest to the axis."""
    x = bones / np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-9)
    y = axes - (axes * x).sum(axis=1, keepdims=True) * x
    y /= np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-9)
    return np.stack([x, y, np.cross(x, y)], axis=2)
