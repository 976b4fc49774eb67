"""A stick that depth cameras saw, by the command: found, shown in the replay, exported, tied to the hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from studio.__main__ import main
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from studio.engine.rigid_bodies.known import KnownBody, shape_of
from studio.offline.props import find_prop_of
from studio.take.folder.solved import solved_performers
from studio.take.rigid_bodies.kept import take_bodies, take_tracks
from studio.take.rigid_bodies.replayed import ReplayedBodies
from tests import poses_factory
from tests.engine.seeing.props.moving import AFTER_S, MovingProp, errors, scene
from tests.offline.depth_takes import depth_take
from tests.refused import refused

SECONDS = 0.7


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """A take of a stick that swings, with a solve whose right hand has it 20 cm from its middle."""
    prop = MovingProp("cylinder:3,90", pace=0.5)
    times, cameras, images = scene(prop, SECONDS)
    sets = [
        {
            name: DepthFrame(name, k, round((time_s + AFTER_S[i]) * 1e9), images[i][k])
            for i, (name, _, _) in enumerate(cameras)
        }
        for k, time_s in enumerate(times.tolist())
    ]
    watched = SimpleNamespace(
        cameras={name: lens for name, lens, _ in cameras},
        placed={name: T for name, _, T in cameras},
        sets=sets,
    )
    take = depth_take(tmp_path_factory.mktemp("seen") / "take", watched)  # type: ignore[arg-type]
    placed = {name: CameraCalibration(T) for name, _, T in cameras}
    take.add_calibration(Calibration("camera_0", placed), use=True)  # the first one's cameras are 5 cm apart
    poses = poses_factory.random_poses(np.random.default_rng(3), seconds=SECONDS)
    positions = poses.positions_m + np.array([5.0, 0.0, 0.0])
    hand = [place + 0.2 * turn[:, 2] for place, turn in map(prop.pose, poses.time_s.tolist())]
    positions[:, poses.joint_names.index(OUTPUT_OF_CANONICAL["right_hand"])] = hand
    moved = Poses(
        poses.time_s, poses.joint_names, poses.parents, positions, poses.rotations_wxyz, poses.confidence,
        poses.uncertainty_mm, poses.root_height_m,
    )  # fmt: skip
    take.solve_folder("studio").mkdir(parents=True)
    moved.save(take.solve_folder("studio") / "poses.npz")
    return prop, take, moved


def test_a_prop_that_cameras_saw(seen, tmp_path, capsys):
    prop, take, poses = seen
    path = str(take.path)
    assert (
        main(["rigid", path, "find", "Stick", "shape=cylinder:3,90", "joint=right_hand", "solve=studio"]) == 0
    )
    told = capsys.readouterr().out
    assert (
        "Stick was seen in" in told
        and "beside the performers of studio" in told
        and "cylinder:3,90,z" in told
    )
    track = take_tracks(take).tracks["Stick"]
    away, axis = errors(prop, SimpleNamespace(
        time_s=track.time_s, places_m=track.positions_m, rotations_wxyz=track.rotations_wxyz))  # fmt: skip
    assert np.median(away) < 30.0 and np.median(axis) < 3.0 and len(away) > 0.9 * SECONDS * 30

    # another system that stands elsewhere does not move it
    assert take_bodies(take).named("Stick").shape == prop.shape
    (shown,) = ReplayedBodies.of(take).at(float(track.time_s[5]))
    assert (shown.name, shown.use) == ("Stick", "prop")
    np.testing.assert_allclose(shown.position_m, track.positions_m[5], atol=1e-6)

    # exported as its own bones, held by the hand, and so shown with the solve
    (held,) = ReplayedBodies.of(take, solved_performers(take, "studio")).at(float(track.time_s[15]))
    hand = canonical_positions(poses)[:, INDEX["right_hand"]]
    (grip,) = [held.position_m - [np.interp(track.time_s[15], poses.time_s, one) for one in hand.T]]
    assert np.linalg.norm(grip) == pytest.approx(0.2, abs=0.03)
    out = tmp_path / "stick.csv"
    assert (
        main(["export", path, "--solve", "studio", "--prop", "Stick", "--format", "csv", "--out", str(out)])
        == 0
    )
    assert "Stick_end" in out.read_text()
    assert main(["export", path, "--solve", "studio", "--prop", "Stick", "--format", "bvh", "--out",
                 str(tmp_path / "stick.bvh")]) == 0  # fmt: skip
    assert "Stick_end" in (tmp_path / "stick.bvh").read_text()


def test_a_place_to_begin_from_and_what_is_refused(seen):
    _, take, _ = seen
    body = KnownBody("Ball", shape=shape_of("sphere:30"))
    with refused(FormatError, "rigid.not_found"):
        find_prop_of(take, body, start=(0.5, (2.0, 2.0, 1.0)))
    with refused(SettingsError, "rigid.no_shape"):
        find_prop_of(take, KnownBody("Ball"))
    for words in (
        ["find"],
        ["find", "Stick", "at=1,2"],
        ["find", "Stick", "shape=cylinder:3,90", "at=a,b,c,d"],
    ):
        assert main(["rigid", str(take.path), *words]) != 0
