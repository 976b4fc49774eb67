"""Several performers in one file, as independent programs read it, and what no file can hold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.clip.together import identifiers, on_one_clock
from studio.engine.animation.export import ExportOptions, export, export_scene
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import ReadBack, read_with_fbx_sdk, read_with_ufbx
from tests.engine.animation.export.scoring import position_error_cm
from tests.poses_factory import random_poses
from tests.refused import refused

DOUBT = (0.5, 0.75)
NAMES = ("Ana", "Éloïse B.")


@pytest.fixture(scope="module")
def performers() -> list[Poses]:
    """Two performers a metre apart; the second begins half a second later."""
    first, second = (random_poses(np.random.default_rng(k), seconds=1.0) for k in range(2))
    moved = replace(second, positions_m=second.positions_m + np.array([1.0, 0.4, 0.0]))
    return [first, replace(moved, time_s=moved.time_s + 0.5)]


def scene(performers: list[Poses], path: Path, **options: object) -> Path:
    doubts = [(), (tuple(performers[0].begins_s + part for part in DOUBT),)]
    export_scene(
        [
            (name, poses, ExportOptions(undecided_s=doubt, take_name="duel", **options))
            for name, poses, doubt in zip(NAMES, performers, doubts, strict=True)
        ],
        path,
        path.suffix[1:],
    )
    return path


def own(back: ReadBack, space: str) -> ReadBack:
    """The part of the reading that belongs to one performer, by the namespace."""
    rows = [i for i, name in enumerate(back.names) if name.startswith(space)]
    return replace(
        back,
        names=tuple(back.names[i].removeprefix(space) for i in rows),
        parents=tuple(rows.index(p) if (p := back.parents[i]) in rows else -1 for i in rows),
        positions_cm=back.positions_cm[:, rows],
        rotations_wxyz=back.rotations_wxyz[:, rows],
        rest_cm=back.rest_cm[rows],
    )


@pytest.mark.parametrize("read", [read_with_ufbx, read_with_fbx_sdk])
def test_fbx_holds_both_where_they_were(performers: list[Poses], tmp_path: Path, read) -> None:
    back = read(scene(performers, tmp_path / "duel.fbx", mesh=True), hz=60)
    for name, poses in zip(("Ana:", "Eloise_B:"), on_one_clock(performers), strict=True):
        assert position_error_cm(own(back, name), poses).max() < 0.02
    content = (tmp_path / "duel.fbx").read_bytes()
    assert content.count(b"duel\x00\x01AnimStack") == 1 and b"[[0.5, 0.75]]" in content


def test_glb_holds_both_where_they_were(performers: list[Poses], tmp_path: Path) -> None:
    read = pygltflib.GLTF2().load(scene(performers, tmp_path / "duel.glb", interpolation="linear"))
    assert len(read.skins) == len(read.meshes) == 2 and len(read.animations) == 1
    tops = [read.nodes[i] for i in read.scenes[0].nodes]
    assert [top.name for top in tops] == ["Ana", "Eloise_B"]
    assert [top.extras.get("undecided_s", []) for top in tops] == [[], [list(DOUBT)]]
    for top, poses in zip(tops, on_one_clock(performers), strict=True):
        places = placed(read, top.children[0], frame=45)
        truth = to_file_axes(poses.positions_m[45])
        found = np.array([places[name] for name in poses.joint_names])
        assert np.abs(found - truth).max() < 1e-4


def placed(read: pygltflib.GLTF2, root: int, frame: int) -> dict[str, np.ndarray]:
    """World positions of the joints below a node in a frame [m], by name."""
    blob, channels = read.binary_blob(), {}
    for channel in read.animations[0].channels:
        item = read.accessors[read.animations[0].samplers[channel.sampler].output]
        view = read.bufferViews[item.bufferView]
        width = int(item.type[3:])  # VEC3 or VEC4
        values = np.frombuffer(blob, np.float32, item.count * width, view.byteOffset)
        channels[channel.target.node, channel.target.path] = values.reshape(item.count, -1)[frame]
    found: dict[str, np.ndarray] = {}

    def walk(node: int, place: np.ndarray, turn: Rotation) -> None:
        one = read.nodes[node]
        here = place + turn.apply(channels.get((node, "translation"), one.translation))
        found[one.name] = here
        for child in one.children or ():
            walk(child, here, turn * Rotation.from_quat(channels.get((node, "rotation"), one.rotation)))

    walk(root, np.zeros(3), Rotation.identity())
    return found


def test_usd_holds_both_where_they_were(performers: list[Poses], tmp_path: Path) -> None:
    pxr = pytest.importorskip("pxr")
    from pxr import Usd, UsdSkel

    stage = Usd.Stage.Open(str(scene(performers, tmp_path / "duel.usd")))
    assert stage.GetDefaultPrim().GetPath() == "/Performers"
    cache = UsdSkel.Cache()
    for name, poses in zip(("Ana", "Eloise_B"), on_one_clock(performers), strict=True):
        root = UsdSkel.Root(stage.GetPrimAtPath(f"/Performers/{name}"))
        assert cache.Populate(root, Usd.PrimDefaultPredicate)
        query = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath(f"/Performers/{name}/Skeleton")))
        places = np.array([m.ExtractTranslation() for m in query.ComputeJointSkelTransforms(45)])
        assert np.abs(places - to_file_axes(poses.positions_m[45])).max() < 1e-4
    doubt = stage.GetPrimAtPath("/Performers/Eloise_B/duel").GetAttribute("undecided")
    assert [doubt.Get(frame) for frame in (29, 30, 45, 46)] == [False, True, True, False]
    assert pxr is not None


def test_tables_tell_which_frames_are_undecided(performers: list[Poses], tmp_path: Path) -> None:
    poses = performers[1]
    options = ExportOptions(undecided_s=((poses.begins_s + 0.1, poses.begins_s + 0.2),))
    for kind in ("csv", "npz"):
        export(poses, tmp_path / f"a.{kind}", kind, options)
    header, *rows = (tmp_path / "a.csv").read_text().splitlines()
    assert header.endswith(",undecided")
    marked = [row.endswith(",1") for row in rows]
    assert sum(marked) == 7 and marked.index(True) == 6
    with np.load(tmp_path / "a.npz") as kept:
        assert kept["undecided"].tolist() == marked
    assert Poses.load(tmp_path / "a.npz").frame_count == poses.frame_count
    export(poses, tmp_path / "alone.csv", "csv")
    assert "undecided" not in (tmp_path / "alone.csv").read_text()


def test_on_one_clock_all_begin_and_end_together(performers: list[Poses]) -> None:
    first, second = on_one_clock(performers)
    assert first.frame_count == second.frame_count == 91
    assert np.allclose(first.time_s, second.time_s) and np.allclose(np.diff(first.time_s), 1 / 60)
    assert (second.confidence[:30] == 0).all() and (first.confidence[61:] == 0).all()
    assert np.array_equal(second.positions_m[:31], np.repeat(performers[1].positions_m[:1], 31, axis=0))
    assert on_one_clock(performers[:1])[0] is performers[0]


def test_names_become_namespaces() -> None:
    assert identifiers(["Ana", "ana b", "Ana", "", "7", "日本"]) == [
        "Ana", "ana_b", "Ana_2", "performer", "_7", "performer_2",
    ]  # fmt: skip


def test_what_no_file_can_hold_is_told(performers: list[Poses], tmp_path: Path) -> None:
    with refused(SettingsError, "export.one_performer_format", format="bvh", allowed="fbx, glb, usd"):
        scene(performers, tmp_path / "duel.bvh")
    with refused(SettingsError, "export.loop_together"):
        scene(performers, tmp_path / "duel.glb", loop=True)
    assert not list(tmp_path.iterdir())
