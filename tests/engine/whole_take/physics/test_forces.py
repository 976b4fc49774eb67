"""The forces that a motion demands, those that the floor can give, and the rest, which the joints carry."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS
from studio.engine.model.human.ranges import dofs_of
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.physics.dynamics import GRAVITY_M_S2, body_mass_kg, dynamics
from studio.engine.whole_take.physics.forces import ARM_M, FRICTION, bearing, contact_forces
from studio.engine.whole_take.physics.points import SOLE_POINTS, floor_points
from studio.engine.whole_take.physics.strength import GIVING_WAY, torque_bounds
from studio.engine.whole_take.physics.torques import InverseDynamics, excess
from tests.engine.whole_take.physics.trajectories import DT, body, moving, standing, thrown

HINGES = [f"{name}_{dof.name}" for name in BODY_JOINTS for dof in dofs_of(name)]
POINTS = floor_points(body())
WEIGHT_N = body_mass_kg(body()) * GRAVITY_M_S2


def demanded(q):
    return dynamics(body(), q, DT, POINTS)


def explained(q, **options):
    motion = demanded(q)
    return contact_forces(motion, bearing(motion, POINTS, 0.0), **options)


def test_soles_lie_on_the_floor_in_the_t_pose():
    assert np.abs(demanded(standing()).points[:, :SOLE_POINTS, 2]).max() < 1e-9


def test_a_body_in_free_flight_needs_no_force():
    motion = demanded(thrown())
    assert np.abs(motion.force).max() < 1e-6 * WEIGHT_N and np.abs(motion.moment).max() < 1e-6


def test_force_and_moment_are_those_of_inverse_dynamics():
    q, model = moving(), body().model
    motion, data = demanded(q), mujoco.MjData(model)
    ways = steps(q)
    for k in range(len(q) - 2):
        data.qpos[:], data.qvel[:] = q[k + 1], (ways[k] + ways[k + 1]) / (2 * DT)
        data.qacc[:] = (ways[k + 1] - ways[k]) / DT**2
        mujoco.mj_inverse(model, data)
        root = data.qfrc_inverse[:6]
        arm = q[k + 1, :3] - motion.com[k + 1]
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, q[k + 1, 3:7])
        moment = turn.reshape(3, 3) @ root[3:] + np.cross(arm, root[:3])
        assert np.abs(motion.force[k] - root[:3]).max() < 0.02 * WEIGHT_N
        assert np.abs(motion.moment[k] - moment).max() < 2.0


def test_standing_is_explained_by_pushing_soles():
    for shared in (False, True):
        forces = explained(standing(), shared=shared)
        assert np.linalg.norm(forces.residual, axis=1).max() < 0.01 * WEIGHT_N
        assert np.allclose(forces.at_points.sum(axis=1), [0, 0, WEIGHT_N], atol=0.01 * WEIGHT_N)
        sideways = np.linalg.norm(forces.at_points[..., :2], axis=2)
        assert (sideways <= FRICTION * forces.at_points[..., 2] + 1e-9).all()


def test_what_floats_is_not_explained():
    q = standing()
    q[:, 2] += 1.0
    forces = explained(q)
    assert not forces.at_points.any() and np.allclose(forces.residual[:, 2], WEIGHT_N)


@pytest.mark.parametrize(("share", "explains"), [(0.5, True), (2.0, False)])
def test_soles_do_not_hold_more_than_friction_allows(share, explains):
    q, t = standing(), np.arange(30) * DT
    q[:, 0] += 0.5 * share * FRICTION * GRAVITY_M_S2 * (t - t.mean()) ** 2
    motion = demanded(q)
    motion.moment[:] = np.cross(
        motion.points[1:-1, :SOLE_POINTS].mean(axis=1) - motion.com[1:-1], motion.force
    )
    residual = contact_forces(motion, bearing(motion, POINTS, 0.0)).residual
    far = np.linalg.norm(residual, axis=1) > 0.1 * WEIGHT_N
    assert (not far.any()) if explains else far.all()


def test_moments_count_as_forces_at_an_arm():
    motion = demanded(thrown())
    motion.moment[:] = [3.0, 0.0, 0.0]
    residual = contact_forces(motion, np.zeros((28, len(POINTS.flesh_m)), dtype=bool)).residual
    assert np.allclose(residual[:, 3], 3.0 / ARM_M)


def torques_of(q):
    return InverseDynamics(body(), POINTS, DT).torques(q, steps(q), explained(q, shared=True))


def beyond(q):
    return excess(torques_of(q), torque_bounds(body_mass_kg(body())))


def test_standing_takes_little_and_squatting_knees_that_straighten():
    assert not beyond(standing()).any()
    q = standing()
    bent = {"UpLeg_bend": -1.2, "Leg_bend": 1.6, "Foot_bend": -0.5, "Spine_bend": 0.4}
    for name, angle in bent.items():
        for side in ("Left", "Right") if name != "Spine_bend" else ("",):
            q[:, 7 + HINGES.index(side + name)] = angle
    q[:, 2] -= demanded(q).points[0, :SOLE_POINTS, 2].min()
    squat = torques_of(q)
    for side in ("Left", "Right"):
        knee = squat[:, HINGES.index(f"{side}Leg_bend")]
        assert (knee < -0.5 * body_mass_kg(body())).all() and (knee > -3.0 * body_mass_kg(body())).all()


def test_an_arm_that_is_thrown_about_exceeds_its_strength():
    q, t = standing(), np.arange(30) * DT
    hinge = HINGES.index("LeftForeArm_bend")
    q[:, 7 + hinge] = -1.2 + 1.1 * np.sin(60.0 * t)
    assert np.abs(beyond(q)[:, hinge]).max() > 10.0


def test_bounds_are_mirrored_and_name_every_hinge():
    bounds = torque_bounds(75.0)
    assert (
        bounds.shape == (body().model.nv - FREE_DOFS, 2)
        and (bounds[:, 0] < 0).all()
        and (bounds[:, 1] > 0).all()
    )
    for left, name in enumerate(HINGES):
        if name.startswith("Left"):
            assert (bounds[left] == bounds[HINGES.index("Right" + name[4:])]).all()
    assert bounds[HINGES.index("LeftLeg_bend"), 0] == pytest.approx(-4.08 * 75.0 * GIVING_WAY)
