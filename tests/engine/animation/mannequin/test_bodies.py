"""The mannequin's other bodies: same joints, closed, different shape."""

import numpy as np
import pytest

from studio.engine.animation.mannequin import SEAM, mannequin_mesh
from studio.engine.animation.mannequin.build import SLIM
from studio.engine.animation.mannequin.limbs import ARM, LEG, limb
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.performers.bodies import BODIES
from tests.engine.animation.mannequin.test_mannequin import edges_shared_by_two, rest_positions


@pytest.fixture(scope="module")
def meshes():
    return {body: mannequin_mesh(OUTPUT_JOINTS, rest_positions(), body=body) for body in BODIES}


@pytest.mark.parametrize("body", BODIES)
def test_every_body_is_closed_faces_outwards_and_follows_every_joint(meshes, body):
    mesh = meshes[body]
    assert 5_000 <= len(mesh.triangles) <= 15_000
    assert edges_shared_by_two(mesh.triangles)
    corners = mesh.vertices_m[mesh.triangles].astype(float)
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    agree = np.einsum("ij,ij->i", faces, mesh.normals[mesh.triangles[:, 0]].astype(float))
    assert (agree > 0).mean() > 0.99
    assert set(mesh.joint_indices[mesh.weights > 0].tolist()) == set(range(52))
    assert (mesh.tones == SEAM).any()


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("stature_m", [0.9, 1.75, 2.3])
def test_every_body_has_the_performers_size_and_stands(body, stature_m):
    vertices = mannequin_mesh(OUTPUT_JOINTS, rest_positions(stature_m), body=body).vertices_m
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert low[1] == pytest.approx(0.0, abs=0.005)
    assert high[1] == pytest.approx(stature_m, rel=0.04)
    assert high[0] == pytest.approx(-low[0], abs=1e-3)


def width_m(mesh, height_m: float) -> float:
    """Width of the body at a height, without its arms."""
    near = mesh.vertices_m[np.abs(mesh.vertices_m[:, 1] - height_m) < 0.03]
    return float(np.ptp(near[np.abs(near[:, 0]) < 0.25, 0]))


def test_the_slim_body_has_a_narrow_waist_and_wide_hips(meshes):
    standard, slim = meshes["standard"], meshes["slim"]
    rest = rest_positions()
    hips, shoulders = (rest[OUTPUT_INDEX[name], 1] for name in ("LeftUpLeg", "LeftArm"))
    waist = hips + 0.5 * (shoulders - hips)
    assert width_m(slim, waist) < 0.85 * width_m(standard, waist)
    assert width_m(slim, hips) > width_m(standard, hips)


@pytest.mark.parametrize("shape", [ARM, LEG], ids=["elbow", "knee"])
def test_the_slim_body_hides_the_balls_of_its_elbows_and_knees(shape):
    rig = MannequinRig.of(OUTPUT_JOINTS, rest_positions(), build=SLIM)
    tube, _, ball, _ = limb(rig, shape, "Left")
    joint = rig.at(f"Left{shape.roles[1]}")
    surface = np.concatenate([tube.points, tube.points[tube.triangles].mean(axis=1)])
    assert np.linalg.norm(ball.points - joint, axis=1).max() < np.linalg.norm(surface - joint, axis=1).min()


def test_blocks_do_not_bend(meshes):
    assert (meshes["blocks"].weights[:, 0] == 1.0).all()


def test_a_body_of_another_name_is_refused():
    with pytest.raises(SettingsError, match="standard"):
        mannequin_mesh(OUTPUT_JOINTS, rest_positions(), body="giant")
