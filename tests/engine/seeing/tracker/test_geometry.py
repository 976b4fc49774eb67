"""The chain, the surface and free space against independent computations."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.model.joints import CANONICAL, INDEX
from studio.engine.seeing.fitting.chain import Pose, chain_of, place_bodies, rotation_of, rows_of, vector_of
from studio.engine.seeing.fitting.cones import (
    CANONICAL_BODIES,
    CONE_COUNT,
    SHAPE,
    humanoid_of,
    offsets_of,
    performer_of,
    surface_of,
)
from studio.engine.seeing.fitting.confidence import LIMB_JOINTS, bounded, confidence_of, expected_errors
from studio.engine.seeing.fitting.confidence import BodyEvidence as SeenOnBody
from studio.engine.seeing.fitting.fit import BodyShape, Fit, Fitter, MeasuredPoints, sample_places
from studio.engine.seeing.fitting.placing import place_cones
from studio.engine.seeing.fitting.surface import match_points
from studio.engine.seeing.images.floor import find_floor, stand_on
from studio.engine.seeing.images.grid import lens_of
from studio.engine.seeing.images.silhouette import (
    Silhouette,
    behind_seen,
    free_space,
    nearest_cells,
    unread_cells,
)
from studio.engine.seeing.search.bones import twisted, untold
from studio.engine.seeing.search.unread import Shown, unread_ends

USUAL = np.zeros(len(SHAPE))
_READ = np.zeros((CONE_COUNT, 3), dtype=bool)


@pytest.fixture(scope="module")
def body():
    humanoid = humanoid_of(USUAL)
    return humanoid, *chain_of(humanoid)


def pose_of(limits, seed):
    rng = np.random.default_rng(seed)
    return Pose(rng.normal(size=3), rotation_of(rng.normal(size=3)), rng.uniform(limits.low, limits.high))


def test_the_chain_moves_as_the_humanoid(body):
    humanoid, chain, limits = body
    pose = pose_of(limits, 0)
    data = mujoco.MjData(humanoid.model)
    data.qpos[:3] = pose.root
    mujoco.mju_mat2Quat(data.qpos[3:7], pose.rotation.ravel())
    data.qpos[7:] = pose.angles[chain.dofs]
    mujoco.mj_kinematics(humanoid.model, data)
    places, rotations, _ = place_bodies(chain, offsets_of(USUAL), pose.root, pose.rotation, pose.angles)
    assert np.abs(places - data.xpos[humanoid.body_ids]).max() < 1e-9
    assert np.abs(rotations.reshape(-1, 9) - data.xmat[humanoid.body_ids]).max() < 1e-9


def test_rows_are_the_derivative(body):
    _, chain, limits = body
    pose, offsets = pose_of(limits, 1), offsets_of(USUAL)
    places, rotations, axes = place_bodies(chain, offsets, pose.root, pose.rotation, pose.angles)
    bodies = np.arange(len(places))
    local = np.random.default_rng(2).normal(scale=0.1, size=(len(bodies), 3))
    points = places + np.einsum("bij,bj->bi", rotations, local)
    normals = np.tile([0.0, 0.6, 0.8], (len(bodies), 1))
    rows = np.zeros((len(bodies), 6 + len(limits.names)))
    rows_of(chain, places, axes, bodies, points, normals, rows)
    for k in range(rows.shape[1]):
        step = np.zeros(rows.shape[1])
        step[k] = 1e-6
        root, rotation = pose.root + step[:3], rotation_of(step[3:6]) @ pose.rotation
        there, turned, _ = place_bodies(chain, offsets, root, rotation, pose.angles + step[6:])
        moved = there + np.einsum("bij,bj->bi", turned, local)
        assert np.abs(((moved - points) * normals).sum(axis=1) / 1e-6 - rows[:, k]).max() < 1e-4


@pytest.mark.parametrize("angle", [0.0, 1e-5, 1.0, 3.0])
def test_rotation_vectors_come_back(angle):
    vector = angle * np.array([0.6, 0.0, 0.8])
    assert np.abs(vector_of(rotation_of(vector)) - vector).max() < 1e-9


def test_shape_numbers_change_what_they_name():
    usual = performer_of(USUAL)
    for name, joint in (
        ("leg", "left_knee"),
        ("arm", "left_wrist"),
        ("shoulder", "left_shoulder"),
        ("hip", "left_hip"),
    ):
        shape = USUAL.copy()
        shape[SHAPE.index(name)] = 0.1
        assert performer_of(shape).bones_m()[joint] > usual.bones_m()[joint] * 1.04
    bent = USUAL.copy()
    bent[SHAPE.index("elbow")] = 0.1
    bones, straight = performer_of(bent).bones_m(), usual.bones_m()
    assert bones["left_elbow"] > straight["left_elbow"]
    assert bones["left_elbow"] + bones["left_wrist"] == pytest.approx(
        straight["left_elbow"] + straight["left_wrist"]
    )


def test_clothes_stand_off_trunk_and_limbs_alone():
    dressed = USUAL.copy()
    dressed[SHAPE.index("cloth")] = np.log(2.0)
    added = surface_of(dressed).start_radius - surface_of(USUAL).start_radius
    bodies = [BODY_JOINTS[body] for body in surface_of(USUAL).body]
    assert all(added[k] == 0.0 for k, name in enumerate(bodies) if name in ("Head", "LeftHand", "RightFoot"))
    assert all(
        0.005 < added[k] < 0.015 for k, name in enumerate(bodies) if name in ("Spine1", "LeftArm", "RightLeg")
    )


def cones(limits, chain):
    surface = surface_of(USUAL)
    places, rotations, _ = place_bodies(
        chain, offsets_of(USUAL), np.array([0.0, 0.0, 0.95]), np.eye(3), np.zeros(len(limits.names))
    )
    return surface, *place_cones(surface, places, rotations)


def test_a_point_behind_the_body_is_matched_with_the_side_that_the_camera_sees(body):
    _, chain, limits = body
    surface, origins, frames = cones(limits, chain)
    view = np.array([[0.0, -1.0, 0.0]])  # the camera is in front of the body, which faces -y
    for depth in (0.0, 0.05, 0.15):
        point = np.array([[0.05, depth, 1.15]])
        _, place, normal, _, _ = match_points(point, view, np.zeros((1, 3)), surface, origins, frames, True)
        assert normal[0] @ view[0] > -1e-9
        assert place[0, 1] < 0.02


def test_points_on_a_cone_lie_on_the_surface(body):
    _, chain, limits = body
    surface, origins, frames = cones(limits, chain)
    arm = int(np.flatnonzero(surface.length == surface.length.max())[0])
    middle = origins[arm] + 0.5 * surface.length[arm] * frames[arm][:, 2]
    radius = 0.5 * (surface.start_radius[arm] + surface.end_radius[arm])
    point = (middle + radius * frames[arm][:, 0])[None]
    *_, offset, distance = match_points(
        point, frames[arm][:, :1].T.copy(), np.zeros((1, 3)), surface, origins, frames, True
    )
    assert abs(offset[0]) < 0.003 and distance.min() < 0.003


def test_nearest_cells():
    person = np.zeros((20, 30), dtype=bool)
    person[5, 7] = person[15, 22] = True
    nearest = np.empty(person.shape, np.int32)
    nearest_cells(person, 40, nearest)
    assert nearest[4, 3] == 5 * 30 + 7 and nearest[19, 29] == 15 * 30 + 22 and nearest[5, 7] == 5 * 30 + 7
    nearest_cells(np.zeros_like(person), 40, nearest)
    assert (nearest == -1).all()


def test_a_limb_beside_the_silhouette_is_drawn_to_it(body):
    _, chain, limits = body
    surface, origins, frames = cones(limits, chain)
    camera = DepthCamera(250.0, 250.0, 160.0, 144.0, 320, 288)
    person = np.zeros((288, 320), dtype=bool)
    person[80:240, 150:170] = True  # a column; the arms are stretched out next to it
    nearest = np.empty(person.shape, np.int32)
    nearest_cells(person, 40, nearest)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    depth = np.where(person, 3.0, 0.0)
    seen = Silhouette(lens_of(camera), rotation, np.array([0.0, 1.0, 3.0]), depth, nearest, _READ, nearest)
    hands = np.flatnonzero(surface.body == surface.body[surface.part == 1].max())
    _, points, normals, offsets, _ = free_space(
        seen, surface, origins, frames, np.stack([hands, 0.5 + 0 * hands], axis=1)
    )
    assert len(points) == len(hands) and (offsets > 0.2).all()
    assert (normals[:, 0] * np.sign(points[:, 0]) < -0.9).all()
    unread = seen._replace(unread=~_READ)
    assert not len(
        free_space(unread, surface, origins, frames, np.stack([hands, 0.5 + 0 * hands], axis=1))[0]
    )


def test_a_leg_that_is_not_read_is_drawn_to_its_hole_in_the_floor(body):
    _, chain, limits = body
    surface, origins, frames = cones(limits, chain)
    camera = DepthCamera(250.0, 250.0, 160.0, 144.0, 320, 288)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    depth = np.full((288, 320), 4.0)
    depth[60:120, 150:170] = 3.0
    person = depth == 3.0
    depth[120:250, 152:162] = 0.0  # the legs, and around them what lies behind
    nearest = np.empty(person.shape, np.int32)
    nearest_cells(person, 40, nearest)
    holes = np.empty(person.shape, np.int32)
    nearest_cells(unread_cells(depth, nearest), 60, holes)
    seen = Silhouette(lens_of(camera), rotation, np.array([0.0, 1.0, 3.0]), depth, nearest, ~_READ, holes)
    shins = np.flatnonzero(
        np.isin(surface.body, [BODY_JOINTS.index(f"{side}Leg") for side in ("Left", "Right")])
    )
    samples = np.stack([shins, 1.0 + 0 * shins], axis=1)
    _, points, normals, offsets, _ = free_space(seen, surface, origins, frames, samples)
    assert len(points) and (offsets < 0.12).all() and (np.abs(normals[:, 2]) < 0.5).all(), (
        "to the side, not up"
    )
    _, points, normals, offsets, _ = free_space(
        seen._replace(unread=_READ), surface, origins, frames, samples
    )
    assert len(points) == len(shins) and normals[:, 2].max() > 0.9, "else up to the trunk"


@pytest.mark.parametrize("tilt", [-0.4, 0.0, 0.5])
def test_the_floor_is_found_from_any_tilt(tilt):
    rng = np.random.default_rng(3)
    up = rotation_of(np.array([tilt, 0.0, 0.1])) @ np.array([0.0, -1.0, 0.0])
    across = np.linalg.svd(up[None])[2][1:]
    floor = -1.4 * up + rng.uniform(-2, 2, size=(1500, 2)) @ across + rng.normal(scale=0.005, size=(1500, 3))
    above = -1.4 * up + rng.uniform(0.1, 2, size=(600, 1)) * up + rng.uniform(-2, 2, size=(600, 2)) @ across
    plane = find_floor(np.concatenate([floor, above]), np.array([0.0, -1.0, 0.0]))
    assert plane is not None
    assert np.degrees(np.arccos(plane[:3] @ up)) < 0.5 and abs(plane[3] + 1.4) < 0.01
    T = stand_on(plane)
    assert np.abs((floor @ T[:3, :3].T + T[:3, 3])[:, 2]).mean() < 0.01


def test_no_floor_where_there_is_none():
    assert find_floor(np.random.default_rng(4).normal(size=(1000, 3)), np.array([0.0, -1.0, 0.0])) is None
    assert find_floor(np.zeros((5, 3)), np.array([0.0, -1.0, 0.0])) is None


def test_confidence_falls_with_the_expected_error():
    confidence = confidence_of(np.array([0.0, 0.03, 0.1, 1.0]))
    assert confidence[0] == 1.0 and (np.diff(confidence) < 0).all() and confidence[1] > 0.75 > confidence[2]


def test_a_joint_that_nothing_supports_may_be_further_off():
    fitter = Fitter(*chain_of(humanoid_of(USUAL)))
    figure = BodyShape.of(USUAL)
    pose = Pose(figure.offsets[0], np.eye(3), fitter.limits.rest)
    places, *_ = fitter.place(figure, pose)
    joints = places[CANONICAL_BODIES]
    bodies = np.repeat(np.arange(len(places)), 40)
    well = SeenOnBody(
        np.repeat(places, 40, axis=0),
        bodies,
        np.full(len(bodies), 0.01),
        np.full(21, 0.07),
        np.zeros(5),
        np.zeros(5),
        np.zeros((len(places), 2), dtype=bool),
    )
    variance = np.full(21, 1e-4)
    errors = expected_errors(fitter.chain, joints, variance, well)
    assert (confidence_of(errors[LIMB_JOINTS]) > 0.75).all()
    hidden = well._replace(behind_m=np.full(21, 0.6))
    lost = well._replace(costs_m2=np.full(5, 1.0), lately_m2=np.full(5, 1.0))
    for other in (hidden, lost):
        worse = expected_errors(fitter.chain, joints, variance, other)[LIMB_JOINTS]
        assert (worse >= errors[LIMB_JOINTS]).all() and worse.mean() > 1.3 * errors[LIMB_JOINTS].mean()
    for joints_of_body, ends in ((("hip", "knee"), (0, 1)), (("hip",), (1, 0)), (("hip", "knee"), (1, 1))):
        unread = well.unread.copy()
        unread[BODY_JOINTS.index("LeftUpLeg")] = ends
        doubted = (
            confidence_of(expected_errors(fitter.chain, joints, variance, well._replace(unread=unread)))
            < 0.75
        )
        assert [CANONICAL[k] for k in np.flatnonzero(doubted)] == [f"left_{name}" for name in joints_of_body]


def test_who_was_begun_anew_and_a_hand_whose_arm_is_not_known_are_doubted():
    jumped = np.zeros(21)
    jumped[INDEX["left_elbow"]] = 0.2
    errors = bounded(np.full(21, 0.03), jumped)
    doubted = np.flatnonzero(confidence_of(errors) < 0.75)
    assert [CANONICAL[k] for k in doubted] == ["left_elbow", "left_wrist", "left_hand"]


def test_a_place_that_no_camera_shows_is_read_where_points_lie_on_it():
    fitter = Fitter(*chain_of(humanoid_of(USUAL)))
    figure = BodyShape.of(USUAL)
    pose = Pose(figure.offsets[0], np.eye(3), fitter.limits.rest)
    *_, origins, frames = fitter.place(figure, pose)
    body, thigh = figure.surface.body[figure.samples[:, 0].astype(np.int64)], BODY_JOINTS.index("LeftUpLeg")
    upper = sample_places(figure, origins, frames, figure.samples)[body == thigh][0]
    before = upper - [0.0, figure.surface.start_radius[14], 0.0]
    places = before + np.random.default_rng(5).normal(scale=0.01, size=(9, 3))
    points = MeasuredPoints(
        places, np.tile([0.0, -1.0, 0.0], (9, 1)), np.zeros((9, 3)), np.zeros(9, np.int64)
    )
    cone, _, _, offset, distance = fitter.match(figure, pose, points)
    fit = Fit(pose, distance, cone, offset, np.eye(len(fitter.limits.names) + 6))
    shown = Shown(np.zeros(len(BODY_JOINTS), bool), body == thigh, ())
    unread = unread_ends(fitter, figure, fit, points, shown)
    assert unread[thigh].tolist() == [False, True] and not unread[:, 0].any()


def test_a_forearm_whose_points_lie_on_other_parts_as_well_is_not_known():
    fitter = Fitter(*chain_of(humanoid_of(USUAL)))
    figure = BodyShape.of(USUAL)
    pose = Pose(figure.offsets[0], np.eye(3), fitter.limits.rest)
    left, right = (
        figure.surface.body.tolist().index(BODY_JOINTS.index(f"{s}ForeArm")) for s in ("Left", "Right")
    )
    distance = np.full((60, 5), 0.3)
    distance[:30, 1], distance[30:, 2] = 0.01, 0.01
    distance[:30, 0] = 0.02  # the left one lies on the trunk
    fit = Fit(
        pose, distance, np.repeat([left, right], 30), np.zeros(60), np.eye(len(fitter.limits.names) + 6)
    )
    shown = Shown(np.zeros(len(BODY_JOINTS), bool), np.zeros(len(figure.samples), bool), ())
    places = np.zeros((60, 3))
    points = MeasuredPoints(places, places, places, np.zeros(60, np.int64))
    unread = unread_ends(fitter, figure, fit, points, shown)[:, 1]
    assert unread[BODY_JOINTS.index("LeftForeArm")] and not unread[BODY_JOINTS.index("RightForeArm")]


@pytest.mark.parametrize(("bend", "untold_of_arm"), [(0.0, []), (-2.6, [0, 1, 2])])
def test_a_folded_arm_whose_bones_explain_each_other_is_not_told(bend, untold_of_arm):
    fitter = Fitter(*chain_of(humanoid_of(USUAL)))
    figure = BodyShape.of(USUAL)
    angles = fitter.limits.rest.copy()
    angles[fitter.limits.names.index("LeftArm_raise")] = 0.0
    angles[fitter.limits.names.index("LeftForeArm_bend")] = bend
    pose = Pose(figure.offsets[0], np.eye(3), angles)
    *_, origins, frames = fitter.place(figure, pose)
    shares = np.linspace(0.05, 0.95, 20)
    bones = [figure.surface.body == BODY_JOINTS.index(f"Left{bone}") for bone in ("Arm", "ForeArm")]
    cones = np.flatnonzero(bones[0] | bones[1])
    if bend:
        cones = cones[:1]
    places = np.concatenate(
        [
            sample_places(figure, origins, frames, np.stack([np.full(20, c), shares], axis=1))
            - [0.0, figure.surface.start_radius[c], 0.0]
            for c in cones
        ]
    )
    count = len(places)
    before = np.tile([0.0, -1.0, 0.0], (count, 1))
    points = MeasuredPoints(places, before, np.zeros((count, 3)), np.zeros(count, np.int64))
    cone, _, _, offset, distance = fitter.match(figure, pose, points)
    fit = Fit(pose, distance, cone, offset, np.eye(len(fitter.limits.names) + 6))
    found = untold(fitter, figure, fit, points)
    assert np.flatnonzero((found.now | found.lately)[:3]).tolist() == untold_of_arm


def test_a_trunk_at_the_end_of_its_twist_is_not_told():
    _, limits = chain_of(humanoid_of(USUAL))
    pose = Pose(np.zeros(3), np.eye(3), limits.rest)
    k = limits.names.index("Spine_twist")
    for angle, expected in ((0.5 * limits.high[k], False), (limits.high[k], True), (limits.low[k], True)):
        angles = limits.rest.copy()
        angles[k] = angle
        assert twisted(limits, pose.with_angles(angles)) == expected


def test_how_far_points_lie_behind_what_is_seen():
    camera = DepthCamera(250.0, 250.0, 31.5, 23.5, 64, 48)
    depth = np.full((48, 64), 2.0)
    depth[:, :20] = 0.0
    nobody = np.full((48, 64), -1, np.int32)
    seen = Silhouette(lens_of(camera), np.eye(3), np.zeros(3), depth, nobody, _READ, nobody)
    points = np.array([[0.0, 0.0, 2.07], [0.0, 0.0, 1.5], [-0.2, 0.0, 2.0], [0.0, 5.0, 2.0]])
    np.testing.assert_allclose(behind_seen((seen,), points), [0.07, -0.5, 0.5, 1.0], atol=1e-9)
    assert behind_seen((), points).tolist() == [1.0] * 4
