"""Masses are plausible for any stature, and a real body can have each inertia."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import BODY_JOINTS, build_humanoid
from studio.engine.model.human.masses import body_inertias, body_mass_kg
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import OUTPUT_JOINTS
from tests.engine.walkers import performer

HEIGHTS = [0.9, 1.2, 1.5, 1.78, 2.0, 2.3]


def full(height_m):
    return build_humanoid(Skeleton.of(performer(height_m)), fingers=True)


@pytest.mark.parametrize("fingers", [False, True])
@pytest.mark.parametrize("height_m", HEIGHTS)
def test_the_total_is_the_performers_mass(height_m, fingers):
    model = build_humanoid(Skeleton.of(performer(height_m)), fingers=fingers).model
    assert model.body_mass.sum() == pytest.approx(body_mass_kg(height_m), rel=0.002)
    assert 15 < body_mass_kg(height_m) / height_m**2 < 25


def test_known_people():
    assert body_mass_kg(1.78) == pytest.approx(69, abs=3)
    assert body_mass_kg(1.1) == pytest.approx(18.5, abs=1.5), "a child of five"
    assert (np.diff([body_mass_kg(h) for h in np.linspace(0.8, 2.4, 100)]) > 0).all()


@pytest.mark.parametrize("fingers", [False, True])
@pytest.mark.parametrize("height_m", HEIGHTS)
def test_every_inertia_is_positive_and_that_of_a_real_body(height_m, fingers):
    inertias = body_inertias(Skeleton.of(performer(height_m)), fingers=fingers)
    assert set(inertias) == set(OUTPUT_JOINTS if fingers else BODY_JOINTS)
    for name, body in inertias.items():
        least, middle, most = np.sort(body.inertia_kg_m2)
        assert body.mass_kg > 0 and least > 0, name
        assert least + middle >= most * (1 - 1e-9), f"{name}: no body turns so"
        assert np.sqrt(most / body.mass_kg) < 0.15 * height_m, f"{name}: its mass is too far out"
        assert np.linalg.norm(body.centre_m) < 0.15 * height_m, name


@pytest.mark.parametrize("height_m", [0.9, 1.78, 2.3])
def test_the_mass_matrix_is_positive_definite(height_m):
    body = full(height_m)
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.rest_qpos
    mujoco.mj_forward(body.model, data)
    force = np.eye(body.model.nv)
    moved = np.empty_like(force)
    mujoco.mj_solveM(body.model, data, moved, force)  # the inverse, row by row
    assert np.linalg.eigvalsh(0.5 * (moved + moved.T)).min() > 0


def test_the_sides_weigh_the_same_and_the_centre_of_mass_is_in_the_pelvis():
    body = full(1.78)
    model, data = body.model, mujoco.MjData(body.model)
    for name in OUTPUT_JOINTS:
        if name.startswith("Left"):
            left, right = model.body(name), model.body("Right" + name[4:])
            assert left.mass == pytest.approx(right.mass)
            assert left.ipos == pytest.approx(right.ipos * [-1, 1, 1])
            assert left.inertia == pytest.approx(right.inertia)
    data.qpos[:] = body.rest_qpos
    mujoco.mj_forward(model, data)
    centre = data.subtree_com[model.body("Hips").id]
    assert centre[2] / 1.78 == pytest.approx(0.56, abs=0.02), "55 to 57 % of stature in standing people"
    assert np.abs(centre[:2] - data.xpos[model.body("Hips").id][:2]).max() < 0.04


def test_a_hand_weighs_the_same_with_fingers_and_without():
    skeleton = Skeleton.of(performer())
    without, with_them = (body_inertias(skeleton, fingers=fingers) for fingers in (False, True))
    whole = sum(body.mass_kg for name, body in with_them.items() if name.startswith("LeftHand"))
    assert whole == pytest.approx(without["LeftHand"].mass_kg)
    assert with_them["LeftHand"].mass_kg > 0.5 * whole
