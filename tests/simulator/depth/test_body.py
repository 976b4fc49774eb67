"""The mesh is closed and its faces point outwards; in motion it keeps its volume and its joints."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion import torture
from studio.engine.model.joints import INDEX, PARENTS
from studio.simulator.body.bones import BONE, BONE_COUNT, BONES
from studio.simulator.body.frame import Frame
from studio.simulator.body.head import TOP_M, head_scale
from studio.simulator.body.mesh import make_body
from studio.simulator.body.performers import DEFAULT, PERFORMERS, SCORING, TUNING
from studio.simulator.body.proportions import performer_offsets
from studio.simulator.body.skinning import skin
from studio.simulator.performer.figure import Figure
from studio.simulator.performer.motion import perform

WHO = ("tuning-heavy", "scoring-child")


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, i]].astype(float) for i in range(3))
    return (np.cross(a, b) * c).sum() / 6


def part_vertices(body, vertices):
    starts = np.cumsum([0, *(len(part.vertices_m) for part in body.parts)])
    return {
        part.name: vertices[start : start + len(part.vertices_m)]
        for part, start in zip(body.parts, starts, strict=False)
    }


def assert_closed(triangles):
    """Every edge is used equally often in both directions."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there, back = np.sort(edges.view("i8,i8").ravel()), np.sort(edges[:, ::-1].copy().view("i8,i8").ravel())
    assert (there == back).all()


def test_every_part_is_closed_and_has_weights(body):
    assert {part.name for part in body.parts} == {
        "trunk", "head", "hair", "left_hand", "right_hand", "shirt", "trousers"
    }  # fmt: skip
    assert 20_000 < len(body.triangles) < 120_000
    for part in body.parts:
        assert_closed(np.ascontiguousarray(part.triangles, dtype=np.int64))
        assert volume(part.vertices_m, part.triangles) > 0
        assert part.weights.min() >= 0
        np.testing.assert_allclose(part.weights.sum(axis=1), 1.0)


@pytest.mark.parametrize("who", WHO)
def test_other_builds_are_closed_too(who):
    performer = PERFORMERS[who]
    body = make_body(performer, performer_offsets(performer))
    for part in body.parts:
        assert_closed(np.ascontiguousarray(part.triangles, dtype=np.int64))
    assert abs(body.vertices_m[:, 2].min()) < 0.01
    assert body.vertices_m[:, 2].max() == pytest.approx(performer.height_m, abs=0.03)


def test_no_triangle_is_turned_in(body):
    """Normals point out of the solid: a step along one leaves it, a step against one does not."""
    from studio.simulator.body.trunk import trunk

    part = body.parts[0]
    a, b, c = (part.vertices_m[part.triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    middle, step = (a + b + c) / 3, 0.004 * normal / np.maximum(area, 1e-12)[:, None]
    good = area > 1e-9
    solid = trunk(body.frame)
    wrong = (solid.at(middle + step) < solid.at(middle - step))[good]
    assert wrong.mean() < 1e-3


def test_statures_from_child_to_giant():
    heights = {}
    for performer in PERFORMERS.values():
        frame = Frame.of(performer, performer_offsets(performer))
        heights[performer.name] = frame.joint("head")[2] + TOP_M * head_scale(frame)
        assert heights[performer.name] == pytest.approx(performer.height_m, abs=0.005)
        assert frame.joint("left_toe")[2] == pytest.approx(0.025)
    assert min(heights.values()) < 0.95 and max(heights.values()) > 2.05


def test_tuning_and_scoring_share_nothing():
    for attribute in ("name", "height_m", "girth", "hand", "finger", "seed", "looseness_m"):
        mine = {getattr(performer, attribute) for performer in TUNING}
        others = {getattr(performer, attribute) for performer in SCORING}
        assert not mine & others, attribute


def test_t_pose_leaves_the_mesh_as_it_is(body):
    straight = np.tile([1.0, 0, 0, 0], (BONE_COUNT, 1))
    moved = skin(body.vertices_m, *body.skin, straight, body.anchors_m, body.anchors_m)
    np.testing.assert_allclose(moved, body.vertices_m, atol=1e-5)


@pytest.mark.parametrize(
    ("motion", "time_s"),
    [(torture.arms_crossed, 2.6), (torture.hands_behind_back, 2.6), (torture.slow_turn, 3.0)],
)
def test_skinning_keeps_volume_and_joints(body, motion, time_s):
    done = perform(motion(), DEFAULT)
    figure = Figure(replace_offsets(body, done), done)
    quaternions, anchors, places = figure.bones_at(time_s)
    moved = skin(body.vertices_m, *body.skin, quaternions, anchors, places)
    rest, now = part_vertices(body, body.vertices_m), part_vertices(body, moved)
    for part in body.parts[:5]:
        was, got = volume(rest[part.name], part.triangles), volume(now[part.name], part.triangles)
        assert got == pytest.approx(was, rel=0.12), part.name
    joints = done.motion.at(time_s)
    for name in ("left_forearm", "right_shin", "head", "left_hand"):
        joint = {"left_forearm": "left_elbow", "right_shin": "right_knee", "head": "head"}.get(
            name, "left_wrist"
        )
        np.testing.assert_allclose(places[BONE[name]], joints[INDEX[joint]], atol=1e-12)


def replace_offsets(body, done):
    np.testing.assert_allclose(done.motion.offsets_m, performer_offsets(DEFAULT))
    return body


def test_bones_point_along_the_joints(performance):
    """A bone turns its T-pose direction to the direction between its joints, so that the skin follows the truth."""
    offsets = performance.motion.offsets_m
    for bone, child in (
        ("left_upper_arm_end", "left_elbow"), ("right_forearm", "right_wrist"), ("left_hand", "left_hand"),
        ("left_thigh_end", "left_knee"), ("right_shin", "right_ankle"), ("left_foot", "left_toe"),
        ("neck", "head"), ("spine", "chest"),
    ):  # fmt: skip
        turn = performance.rotations_wxyz[::50, BONE[bone]]
        way = performance.motion.positions_m[::50]
        way = way[:, INDEX[child]] - way[:, PARENTS[INDEX[child]]]
        w, v = turn[:, :1], turn[:, 1:]
        t = 2 * np.cross(v, offsets[INDEX[child]])
        turned = offsets[INDEX[child]] + w * t + np.cross(v, t)
        cosine = (turned * way).sum(1) / np.linalg.norm(turned, axis=1) / np.linalg.norm(way, axis=1)
        assert cosine.min() > (0.97 if bone == "neck" else 1 - 1e-6), bone


def test_bones_do_not_jump(performance):
    step = np.abs((performance.rotations_wxyz[1:] * performance.rotations_wxyz[:-1]).sum(-1))
    degrees = np.degrees(2 * np.arccos(np.clip(step, 0, 1)))
    assert degrees.max() < 25  # per 1/120 s; punches are fast


def test_a_fist_is_smaller_than_an_open_hand(body, performance):
    still = replace(performance, rotations_wxyz=performance.rotations_wxyz[:1])
    reach = []
    for openness in (1.0, 0.0):
        motion = replace(
            performance.motion,
            positions_m=performance.motion.positions_m[:1],
            hands_open=np.full((1, 2), openness),
        )
        vertices = part_vertices(body, Figure(body, replace(still, motion=motion)).at(0.0))
        wrist = motion.positions_m[0, INDEX["left_wrist"]]
        reach.append(np.linalg.norm(vertices["left_hand"] - wrist, axis=1).max())
    assert reach[0] == pytest.approx(0.19, abs=0.03)
    assert reach[1] < 0.72 * reach[0]


def test_clothes_lag_and_stay_within_their_looseness(body, performance):
    figure = Figure(body, performance)
    loose = body.looseness_m
    most = 0.0
    for k in range(60):
        time_s = 40.0 + k / 30  # punches
        exact = skin(body.vertices_m, *body.skin, *figure.bones_at(time_s))
        off = np.linalg.norm(figure.at(time_s) - exact, axis=1)
        assert (off[loose == 0] == 0).all()
        assert (off <= loose + 1e-6).all()
        most = max(most, float(off.max()))
    assert most > 0.01
    assert len(BONES) < BONE_COUNT
