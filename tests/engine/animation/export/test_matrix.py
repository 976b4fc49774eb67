"""Every target, root motion and option, as the Autodesk FBX SDK, ufbx, Blender and bvhio read the files.

Every pair of them occurs in one file. The long form has all combinations.
"""

from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.options import UNITS_M
from studio.engine.animation.export import ExportOptions, export
from studio.engine.animation.mannequin import mannequin
from studio.engine.base.geometry import matrices
from studio.engine.base.quaternions import inverse, multiply
from tests.engine.animation.export.matrix import BVH_MATRIX, FBX_MATRIX, PAIRS, SECONDS, Truth, source, truth
from tests.engine.animation.export.readers.programs import (
    BlenderScene,
    ReadBack,
    read_with_blender,
    read_with_bvhio,
    read_with_fbx_sdk,
    read_with_ufbx,
)

AT_KEYS_CM = 0.05
TURN_DEG = 0.05

BLENDER = [n for n, o in FBX_MATRIX.items() if o.key_error_cm is None or o.interpolation == "linear"]
"""Files for Blender: it makes cubic curves linear, so it cannot restore a key that was left out."""


def in_pairs(names: Iterable[str]) -> list:
    """Parameters of a test; names outside `PAIRS` are long."""
    return [name if name in PAIRS else pytest.param(name, marks=pytest.mark.long) for name in names]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The files of the matrix by name, written on first use."""
    folder = tmp_path_factory.mktemp("matrix")
    cases = {
        **{k: ("fbx", v) for k, v in FBX_MATRIX.items()},
        **{k: ("bvh", v) for k, v in BVH_MATRIX.items()},
    }

    def file(name: str) -> Path:
        format, options = cases[name]
        path = folder / f"{list(cases).index(name)}.{format}"
        if not path.exists():
            export(source(), path, format, options)
        return path

    return file


@pytest.fixture(scope="module")
def blender(
    files: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], BlenderScene]:
    """The files of the matrix as Blender reads them, in two runs: the long ones, and all others."""

    @cache
    def read(long: bool) -> dict[str, BlenderScene]:
        wanted = {name: FBX_MATRIX[name] for name in BLENDER if (name not in PAIRS) == long}
        if not long:
            wanted |= BVH_MATRIX
        jobs = {}
        for name, options in wanted.items():
            count = round(SECONDS * _rate(options)) + 1
            jobs[name] = {"file": files(name), "frames": list(range(count)), "scale": UNITS_M[options.unit]}
        return read_with_blender(jobs, tmp_path_factory.mktemp("blender"))

    return lambda name: read(name in FBX_MATRIX and name not in PAIRS)[name]


@pytest.mark.parametrize("name", in_pairs(FBX_MATRIX))
def test_ufbx(name: str, files: Callable[[str], Path]) -> None:
    options = FBX_MATRIX[name]
    back = read_with_ufbx(files(name), hz=_rate(options))
    _check(back, truth(options, _rate(options)), options)
    assert back.scene["frames_per_second"] == options.fps
    assert back.scene["unit_m"] == 0.01
    assert (back.scene["up"], back.scene["front"]) == (2, 4)  # +y, +z
    assert back.scene["bind_bones"] == len(back.names)
    begin = 0.0 if options.timecode is None else 3723 + 4 / 120
    assert back.scene["begin_s"] == pytest.approx(begin, abs=1e-9)
    assert back.scene["end_s"] == pytest.approx(begin + SECONDS, abs=1e-9)
    cubic = options.interpolation == "cubic"
    assert back.scene["cubic"] == (back.scene["curves"] if cubic else 0)


@pytest.mark.parametrize("name", in_pairs(FBX_MATRIX))
def test_fbx_sdk(name: str, files: Callable[[str], Path]) -> None:
    options = FBX_MATRIX[name]
    hz = min(_rate(options), 60)  # the highest rate of the program
    _check(read_with_fbx_sdk(files(name), hz=round(hz)), truth(options, hz), options)


@pytest.mark.parametrize("name", in_pairs(BLENDER))
def test_blender(name: str, blender: Callable[[str], BlenderScene]) -> None:
    options, scene = FBX_MATRIX[name], blender(name)
    found = truth(options, _rate(options))
    _check(scene.bones, found, options)
    assert scene.bones.scene["frames_per_second"] == options.fps
    assert any(options.take_name in action for action in scene.actions)
    if options.mesh:
        _check_mesh(scene, found)


@pytest.mark.parametrize("name", BVH_MATRIX)
def test_bvh(name: str, files: Callable[[str], Path], blender: Callable[[str], BlenderScene]) -> None:
    options = BVH_MATRIX[name]
    found = truth(options, _rate(options))
    back = read_with_bvhio(files(name))
    scale = UNITS_M[options.unit] * 100.0
    joints = back.in_order(found.motion.joint_names)
    columns = [found.motion.joint_names.index(joint) for joint in found.names]
    error = np.linalg.norm(joints.positions_cm[:, columns] * scale - found.positions_cm, axis=-1)
    assert error.max() < AT_KEYS_CM
    bones = blender(name).bones
    columns = [bones.names.index(joint) for joint in found.names]
    assert np.linalg.norm(bones.positions_cm[:, columns] - found.positions_cm, axis=-1).max() < AT_KEYS_CM
    assert bones.scene["frames_per_second"] == pytest.approx(options.fps)


def _rate(options: ExportOptions) -> float:
    return options.fps or 60.0


def _check(
    back: ReadBack,
    found: Truth,
    options: ExportOptions,
) -> None:
    """Check names, hierarchy and rest pose against the skeleton, and the joints' places against the poses."""
    motion = found.motion
    back = back.in_order(motion.joint_names)
    assert back.parents == tuple(motion.parents)
    assert back.rest_cm == pytest.approx(motion.rest_positions_m * 100, abs=0.01)
    columns = [motion.joint_names.index(name) for name in found.names]
    error = np.linalg.norm(back.positions_cm[:, columns] - found.positions_cm, axis=-1)
    assert error.max() < AT_KEYS_CM
    dots = np.abs((back.rotations_wxyz[:, columns] * found.rotations_wxyz).sum(axis=-1))
    turn = np.degrees(2 * np.arccos(np.minimum(dots, 1.0)))
    assert turn.max() < (0.5 if options.key_error_cm else TURN_DEG)


def _check_mesh(scene: BlenderScene, found: Truth) -> None:
    """Check the skinned body: at rest and in the last frame its vertices are where linear blending has them."""
    motion = found.motion
    mesh = mannequin(motion)
    assert scene.meshes_cm["rest"] == pytest.approx(mesh.vertices_m * 100, abs=0.01)
    (last,) = (v for key, v in scene.meshes_cm.items() if key not in ("rest", "0"))
    bones = scene.bones.in_order(motion.joint_names)
    turns = matrices(multiply(bones.rotations_wxyz[-1], inverse(motion.rest_rotations_wxyz)))
    posed = mesh.posed(motion.rest_positions_m, bones.positions_cm[-1] / 100, turns)
    assert np.abs(last - posed * 100).max() < AT_KEYS_CM
