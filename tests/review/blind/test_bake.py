"""Animations of a pair: one character, one interval, and files that differ only in the values of the keys."""

import json

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.poses import Poses
from studio.review.blind.bake import HZ, bake_pair, bake_pairs, skeleton_of
from studio.review.blind.model import Pair, Side
from tests import poses_factory
from tests.live.performer import calibration
from tests.poses_factory import random_poses
from tests.refused import refused
from tests.web.playback.takes import take_of_two, take_with_solves


def side(solve: str, **changes: object) -> Side:
    return Side(condition=solve, take="monday/one", solve=solve, **changes)


def parts(data: bytes) -> tuple[dict, bytes]:
    """The JSON and the buffer of a GLB file."""
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def sampler_bytes(tree: dict) -> np.ndarray:
    """Whether each byte of the buffer belongs to a key's value."""
    mask = np.zeros(tree["buffers"][0]["byteLength"], dtype=bool)
    for sampler in tree["animations"][0]["samplers"]:
        view = tree["bufferViews"][tree["accessors"][sampler["output"]]["bufferView"]]
        mask[view.get("byteOffset", 0) : view.get("byteOffset", 0) + view["byteLength"]] = True
    return mask


@pytest.fixture(scope="module")
def performer():
    return calibration(["camera_0"]).performer


def poses(seed: int, **changes: object):
    return random_poses(np.random.default_rng(seed), seconds=3.0, **changes)


def test_a_pair_differs_in_the_keys_alone(performer) -> None:
    other = poses(2, hz=30.0, offset_sd_m=0.03)
    first, second = bake_pair((poses(1), other), (side("a"), side("b")), performer, 0.5, 2.5)
    (tree, buffer), (tree_b, buffer_b) = parts(first), parts(second)
    assert len(first) == len(second) and tree == tree_b
    keys = sampler_bytes(tree)
    bytes_a, bytes_b = (np.frombuffer(data, dtype=np.uint8)[: len(keys)] for data in (buffer, buffer_b))
    assert (bytes_a == bytes_b)[~keys].all() and not (bytes_a == bytes_b)[keys].all()
    text = json.dumps(tree)
    blocks = bake_pair((poses(1), other), (side("a"), side("b")), performer, 0.5, 2.5, body="blocks")
    assert len(blocks[0]) == len(blocks[1]) != len(first), "both sides have the other body"
    assert "monday" not in text and "studio" not in text.lower().replace("capture studio", "")
    clock = tree["accessors"][tree["animations"][0]["samplers"][0]["input"]]
    assert (
        clock["count"] == round(2.0 * HZ) + 1
        and tree["animations"][0]["samplers"][0]["interpolation"] == "LINEAR"
    )


def rotation_of(data: bytes, node: str) -> np.ndarray:
    """Keys of a node's rotation, shape (frame_count, 4)."""
    tree, buffer = parts(data)
    index = next(i for i, one in enumerate(tree["nodes"]) if one["name"] == node)
    channels = tree["animations"][0]["channels"]
    channel = next(c for c in channels if c["target"] == {"node": index, "path": "rotation"})
    accessor = tree["accessors"][tree["animations"][0]["samplers"][channel["sampler"]]["output"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0)
    return np.frombuffer(buffer[start : start + view["byteLength"]], dtype="<f4").reshape(-1, 4)


def test_held_keys_stand_still_and_cubic_ones_do_not(performer) -> None:
    one = poses(3)
    held, cubic = bake_pair(
        (one, one),
        (side("held", key_hz=10.0, interpolation="held"), side("cubic", key_hz=10.0, interpolation="cubic")),
        performer, 0.0, 2.0,
    )  # fmt: skip
    still = np.linalg.norm(np.diff(rotation_of(held, "LeftForeArm"), axis=0), axis=1) < 1e-7
    assert still.mean() == pytest.approx(5 / 6, abs=0.01)
    moving = np.linalg.norm(np.diff(rotation_of(cubic, "LeftForeArm"), axis=0), axis=1) < 1e-7
    assert moving.mean() < 0.05


def test_the_character_s_bones_and_the_floor_are_kept(performer) -> None:
    standing = poses_factory.t_pose(120)
    data, _ = bake_pair((standing, poses(1)), (side("a"), side("b")), performer, 0.0, 1.5)
    tree, _ = parts(data)
    thigh = next(node for node in tree["nodes"] if node["name"] == "LeftLeg")
    assert np.linalg.norm(thigh["translation"]) == pytest.approx(performer.bones_m()["left_knee"], abs=1e-6)


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.2), (2.9, 0.0), (0.0, 5.0), (1.0, 99.0)])
def test_parts_that_are_not_there(performer, start: float, end: float) -> None:
    with refused(SettingsError, "blind.pair_too_long"):
        bake_pair((poses(1), poses(2)), (side("a"), side("b")), performer, start, end)


def test_all_performers_are_shown_alike_on_both_sides(tmp_path) -> None:
    take = take_of_two(tmp_path / "monday" / "fight", solves=("studio", "live"))
    alone = take_with_solves(tmp_path / "monday" / "one")
    pair = Pair(side("studio"), side("live", key_hz=10.0, interpolation="held"))
    ((first, second),) = bake_pairs([(pair, take, take)], "standard")
    (tree, buffer), (tree_b, buffer_b) = parts(first), parts(second)
    assert len(first) == len(second) and tree == tree_b and len(tree["skins"]) == 2
    keys = sampler_bytes(tree)
    bytes_a, bytes_b = (np.frombuffer(data, dtype=np.uint8)[: len(keys)] for data in (buffer, buffer_b))
    assert (bytes_a == bytes_b)[~keys].all() and not (bytes_a == bytes_b)[keys].all()
    colours = {str(one["pbrMetallicRoughness"]["baseColorFactor"]) for one in tree["materials"]}
    assert len(colours) == 3  # two bodies, and the joints of both
    with refused(SettingsError, "blind.other_performers"):
        bake_pairs([(pair, take, alone)], "standard")


def test_a_solve_without_a_performer_stands_on_its_own_bones() -> None:
    standing = poses_factory.t_pose(120)
    skeleton = skeleton_of(standing)
    np.testing.assert_allclose(skeleton.offsets_m[1:], poses_factory.rest_offsets_m()[1:], atol=1e-9)
    assert 0.9 < skeleton.offsets_m[0, 2] < 1.0 and 1.6 < skeleton.height_m < 2.0
    data, _ = bake_pair((standing, poses(1)), (side("a"), side("b")), None, 0.0, 1.5)
    assert data.startswith(b"glTF")


def test_an_animation_with_fewer_joints_stands_on_the_same_character(performer) -> None:
    one = poses(1)
    kept = [i for i, name in enumerate(one.joint_names) if "Hand" not in name or name.endswith("Hand")]
    parents = np.array([kept.index(one.parents[i]) if one.parents[i] >= 0 else -1 for i in kept])
    fewer = Poses(
        one.time_s, tuple(one.joint_names[i] for i in kept), parents, one.positions_m[:, kept],
        one.rotations_wxyz[:, kept], one.confidence[:, kept], one.uncertainty_mm[:, kept],
    )  # fmt: skip
    whole, part = bake_pair((one, fewer), (side("a"), side("b")), performer, 0.0, 2.0)
    assert len(whole) == len(part)
    np.testing.assert_allclose(rotation_of(whole, "LeftHand"), rotation_of(part, "LeftHand"), atol=1e-6)
    assert np.ptp(rotation_of(part, "LeftHandIndex2"), axis=0).max() < 1e-6
    with refused(FormatError, "blind.pair_no_performer"):
        bake_pair((fewer, one), (side("a"), side("b")), None, 0.0, 2.0)
