"""The mannequin: closed, smoothly weighted, fitted to the skeleton, for performers of every size."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.skeleton import local_motion, to_file_axes
from studio.engine.animation.mannequin import BODY, SEAM, mannequin, mannequin_mesh
from studio.engine.animation.mannequin.foot import foot
from studio.engine.animation.mannequin.limbs import ARM, LEG, limb
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_PARENTS
from tests.poses_factory import rest_offsets_m, t_pose
from tests.refused import refused


def rest_positions(stature_m: float = 1.75) -> np.ndarray:
    """T-pose of the tests' performer, scaled to a stature, file axes [m]."""
    rest = rest_offsets_m()
    for joint, parent in enumerate(OUTPUT_PARENTS):
        if parent >= 0:
            rest[joint] += rest[parent]
    rest = to_file_axes(rest)
    rest[:, 1] -= rest[:, 1].min()
    rest *= stature_m / 1.11 / rest[OUTPUT_INDEX["Head"], 1]
    rest[:, 1] += 0.02
    return rest


def bend(rest, angles_deg):
    """Positions and rotations of a pose that is given as rotation vectors [deg] by joint."""
    rotations, positions = np.empty((52, 3, 3)), rest.copy()
    for joint, parent in enumerate(OUTPUT_PARENTS):
        own = Rotation.from_rotvec(angles_deg.get(OUTPUT_JOINTS[joint], (0, 0, 0)), degrees=True).as_matrix()
        rotations[joint] = own if parent < 0 else rotations[parent] @ own
        if parent >= 0:
            positions[joint] = positions[parent] + rotations[parent] @ (rest[joint] - rest[parent])
    return positions, rotations


def edges_shared_by_two(triangles):
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(
        np.int64
    )
    there = edges[:, 0] * triangles.max() * 2 + edges[:, 1]
    back = edges[:, 1] * triangles.max() * 2 + edges[:, 0]
    return len(np.unique(there)) == len(there) and set(there) == set(back)


@pytest.fixture(scope="module")
def mesh():
    return mannequin_mesh(OUTPUT_JOINTS, rest_positions())


def test_every_part_is_closed_and_faces_outwards(mesh):
    assert 5_000 <= len(mesh.triangles) <= 15_000
    assert edges_shared_by_two(mesh.triangles)
    corners = mesh.vertices_m[mesh.triangles].astype(float)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert 0.05 < volume < 0.12  # m3; a person of 1.75 m has about 0.07, parts overlap
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    agree = np.einsum("ij,ij->i", faces, mesh.normals[mesh.triangles[:, 0]].astype(float))
    assert (agree > 0).mean() > 0.99
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize("shape", [ARM, LEG], ids=["elbow", "knee"])
@pytest.mark.parametrize("stature_m", [1.1, 1.75, 2.0])
def test_the_ball_of_a_bending_joint_lies_under_the_surface_at_rest(shape, stature_m):
    """Surfaces at the same distance would alternate in the picture."""
    rig = MannequinRig.of(OUTPUT_JOINTS, rest_positions(stature_m))
    tube, _, ball, _ = limb(rig, shape, "Left")
    joint = rig.at(f"Left{shape.roles[1]}")
    surface = np.concatenate([tube.points, tube.points[tube.triangles].mean(axis=1)])
    assert ball.tone == BODY
    assert np.linalg.norm(ball.points - joint, axis=1).max() < np.linalg.norm(surface - joint, axis=1).min()


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_a_foot_stands_on_its_sole(side):
    rig = MannequinRig.of(OUTPUT_JOINTS, rest_positions())
    upper, sole = foot(rig, side)
    assert (upper.tone, sole.tone) == (BODY, SEAM)
    assert (
        sole.points[:, 1].min() == pytest.approx(rig.floor, abs=1e-6) and upper.points[:, 1].min() > rig.floor
    )
    ankle = rig.at(f"{side}Foot")
    toes = sole.points[sole.points[:, 2] > sole.points[:, 2].max() - 0.02]
    assert abs(toes[:, 0].mean()) < abs(ankle[0])  # the toes point to the inner edge


def test_weights_are_shares_of_joints_that_are_neighbours(mesh):
    assert np.allclose(mesh.weights.sum(axis=1), 1.0, atol=1e-6) and (mesh.weights >= 0).all()
    assert mesh.joint_indices.shape == mesh.weights.shape == (len(mesh.vertices_m), 4)
    assert mesh.joint_indices.max() < 52
    assert (mesh.weights[:, 0] < 0.999).mean() > 0.1  # blends, not rigid pieces alone
    used = set(mesh.joint_indices[mesh.weights > 0].tolist())
    assert used == set(range(52))  # every joint moves something
    assert set(np.unique(mesh.tones)) == {BODY, SEAM}
    assert (np.diff(mesh.tones.astype(int)) >= 0).all()


@pytest.mark.parametrize("stature_m", [0.9, 1.2, 1.75, 2.3])
def test_it_fits_every_size(stature_m):
    rest = rest_positions(stature_m)
    vertices = mannequin_mesh(OUTPUT_JOINTS, rest).vertices_m
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert low[1] == pytest.approx(0.0, abs=0.005)
    assert high[1] == pytest.approx(stature_m, rel=0.04)
    assert high[0] > rest[OUTPUT_INDEX["LeftHandMiddle3"], 0]
    assert np.allclose(vertices[:, 0].max(), -vertices[:, 0].min(), atol=1e-3)


@pytest.mark.parametrize("angle", [90.0, 140.0])
def test_a_sharp_bend_keeps_the_joints_inside_the_body(mesh, angle):
    """At every bent joint a ray in each direction leaves through the skin: no hole, no collapse."""
    rest = rest_positions()
    positions, rotations = bend(
        rest, {"LeftLeg": (angle, 0, 0), "RightForeArm": (0, angle, 0), "LeftUpLeg": (-90, 0, 0)}
    )
    posed = mesh.posed(rest, positions, rotations)
    rng = np.random.default_rng(0)
    for name, radius in (("LeftLeg", 0.045), ("RightForeArm", 0.032), ("LeftUpLeg", 0.06)):
        joint = positions[OUTPUT_INDEX[name]]
        directions = rng.normal(size=(40, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        assert all(first_hit(posed, mesh.triangles, joint, d) >= 0.8 * radius for d in directions), name


def first_hit(points, triangles, origin, direction):
    """Distance at which a ray last leaves the surface nearby [m]; 0 if it meets none (Moeller & Trumbore)."""
    near = np.linalg.norm(points - origin, axis=1) < 0.25
    chosen = triangles[near[triangles].all(axis=1)]
    a, b, c = (points[chosen[:, k]] for k in range(3))
    p = np.cross(direction, c - a)
    det = np.einsum("ij,ij->i", b - a, p)
    safe = np.where(np.abs(det) < 1e-12, np.inf, det)
    t = origin - a
    u = np.einsum("ij,ij->i", t, p) / safe
    q = np.cross(t, b - a)
    v = (q @ direction) / safe
    distance = np.einsum("ij,ij->i", c - a, q) / safe
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-6) & np.isfinite(safe)
    return float(distance[hit].max()) if hit.any() else 0.0


def test_a_fist_stays_small_and_a_twist_does_not_wring(mesh):
    rest = rest_positions()
    fist = {f"LeftHand{f}{k}": (0, 0, -80) for f in ("Index", "Middle", "Ring", "Pinky") for k in (1, 2, 3)}
    posed = mesh.posed(rest, *bend(rest, fist | {"RightArm": (120, 0, 0), "RightHand": (80, 0, 0)}))
    hand = np.isin(mesh.joint_indices[:, 0], [j for n, j in OUTPUT_INDEX.items() if "LeftHand" in n])
    assert np.ptp(posed[hand], axis=0).max() < 0.16
    arm = mesh.joint_indices[:, 0] == OUTPUT_INDEX["RightArm"]
    axis = rest[OUTPUT_INDEX["RightArm"]][1:]
    before = np.linalg.norm(mesh.vertices_m[arm][:, 1:] - axis, axis=1)
    after = np.linalg.norm(posed[arm][:, 1:] - axis, axis=1)
    assert np.allclose(before, after, atol=1e-3)


def test_a_skeleton_without_fingers_toes_or_clavicles_gets_a_body():
    keep = [j for j, n in enumerate(OUTPUT_JOINTS) if "HandT" not in n and "HandI" not in n and "HandM" not in n
            and "HandR" not in n and "HandP" not in n and "Toe" not in n and "Shoulder" not in n
            and n not in ("Spine1", "Neck")]  # fmt: skip
    mesh = mannequin_mesh([OUTPUT_JOINTS[j] for j in keep], rest_positions()[keep])
    assert edges_shared_by_two(mesh.triangles) and np.isfinite(mesh.vertices_m).all()
    assert mesh.joint_indices.max() < len(keep)


@pytest.mark.parametrize("missing", ["Hips", "LeftArm", "RightFoot", "Head"])
def test_a_skeleton_without_a_limb_is_told(missing):
    roles = ["" if name == missing else name for name in OUTPUT_JOINTS]
    with refused(FormatError, "export.mesh_lacks", names=[missing]):
        mannequin_mesh(roles, rest_positions())


def test_a_skeleton_that_lies_is_told():
    with refused(FormatError, "export.mesh_not_upright"):
        mannequin_mesh(OUTPUT_JOINTS, rest_positions()[:, [0, 2, 1]])
    broken = rest_positions()
    broken[3] = np.nan
    with refused(FormatError, "export.mesh_not_upright"):
        mannequin_mesh(OUTPUT_JOINTS, broken)


def test_it_takes_a_motion_and_is_the_same_each_time():
    motion = local_motion(t_pose(2))
    first, again = mannequin(motion), mannequin(replace(motion))
    assert np.array_equal(first.vertices_m, again.vertices_m) and np.array_equal(first.weights, again.weights)
