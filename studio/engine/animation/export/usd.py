"""USD: a UsdSkel skeleton with its animation and the mannequin, of one performer or several; an optional extra
(`usd-core`).

Metres, y up, a time code per frame; text for a file name that ends in .usda, else binary. USD interpolates between
time codes linearly.
"""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.mannequin import SEAM, SkinnedMesh, mannequin
from studio.engine.base.errors import NotAvailableError
from studio.engine.base.files import write_atomically

_BODY_RGB, _SEAM_RGB = (0.72, 0.70, 0.66), (0.16, 0.18, 0.22)


def write_usd(motion: LocalMotion, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the motion as a USD file, atomically; with the mannequin unless `options.mesh` is False.

    Raises:
        NotAvailableError: the package usd-core is not installed.
        FormatError: no body fits the skeleton.
        StudioError: the file cannot be written.
    """
    pxr = _pxr()
    mesh = None if options.mesh is False else mannequin(motion)
    stage = _stage(pxr, motion)
    root = _add_performer(pxr, stage, "/Performer", motion, mesh)
    stage.SetDefaultPrim(root.GetPrim())
    _save(stage, path)


def write_usd_scene(
    performers: Sequence[tuple[str, LocalMotion]], path: str | os.PathLike[str], options: ExportOptions
) -> None:
    """Write several performers, by name, as one USD file, atomically, each below `/Performers`; else as
    `write_usd`."""
    pxr = _pxr()
    stage = _stage(pxr, performers[0][1])
    top = pxr.UsdGeom.Xform.Define(stage, "/Performers")
    for name, motion in performers:
        mesh = None if options.mesh is False else mannequin(motion)
        _add_performer(pxr, stage, f"/Performers/{pxr.Tf.MakeValidIdentifier(name)}", motion, mesh)
    stage.SetDefaultPrim(top.GetPrim())
    _save(stage, path)


def _save(stage: Any, path: str | os.PathLike[str]) -> None:
    suffix = ".usda" if Path(path).suffix.lower() == ".usda" else ".usdc"
    with write_atomically(path) as file, tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / f"motion{suffix}"
        stage.GetRootLayer().Export(str(written))
        file.write(written.read_bytes())


def _pxr() -> Any:
    try:
        import pxr
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt  # noqa: F401  (loads what `pxr.` names)
    except ImportError as error:
        raise NotAvailableError(
            "export.no_usd", "export to USD needs the package usd-core (209 MB): install capture-studio[usd]"
        ) from error
    return pxr


def _stage(pxr: Any, motion: LocalMotion) -> Any:
    """Return a stage with the rate and span of a motion."""
    stage = pxr.Usd.Stage.CreateInMemory()
    pxr.UsdGeom.SetStageUpAxis(stage, pxr.UsdGeom.Tokens.y)
    pxr.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(motion.frames_per_second)
    stage.SetFramesPerSecond(motion.frames_per_second)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(motion.frame_count - 1)
    if motion.timecode is not None:
        told = {"timecode": str(motion.timecode), "timecodeRate": motion.timecode.rate.name}
        stage.GetRootLayer().customLayerData = told
    return stage


def _add_performer(pxr: Any, stage: Any, path: str, motion: LocalMotion, mesh: SkinnedMesh | None) -> Any:
    """Add a performer at a path, and return the prim above skeleton, animation and body."""
    root = pxr.UsdSkel.Root.Define(stage, path)
    joints = _joint_paths(pxr, motion)
    skeleton = pxr.UsdSkel.Skeleton.Define(stage, f"{path}/Skeleton")
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateBindTransformsAttr(_matrices(pxr, motion.rest_rotations_wxyz, motion.rest_positions_m))
    skeleton.CreateRestTransformsAttr(_matrices(pxr, motion.rest_local_wxyz, motion.offsets_m))
    animation = _animation(pxr, stage, path, motion, joints)
    binding = pxr.UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation])
    if mesh is not None:
        _add_mesh(pxr, stage, path, mesh, skeleton)
    return root


def _joint_paths(pxr: Any, motion: LocalMotion) -> list[str]:
    paths: list[str] = []
    for name, parent in zip(motion.joint_names, motion.parents.tolist(), strict=True):
        own = pxr.Tf.MakeValidIdentifier(name)
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _matrices(pxr: Any, rotations_wxyz: NDArray[np.float64], positions: NDArray[np.float64]) -> Any:
    """USD matrices, which multiply row vectors from the right."""
    out = np.tile(np.eye(4), (len(positions), 1, 1))
    out[:, :3, :3] = Rotation.from_quat(rotations_wxyz, scalar_first=True).as_matrix().transpose(0, 2, 1)
    out[:, 3, :3] = positions
    return pxr.Vt.Matrix4dArray([pxr.Gf.Matrix4d(*matrix.ravel().tolist()) for matrix in out])


def _animation(pxr: Any, stage: Any, path: str, motion: LocalMotion, joints: list[str]) -> Any:
    name = pxr.Tf.MakeValidIdentifier(motion.name)
    animation = pxr.UsdSkel.Animation.Define(stage, f"{path}/{name}")
    animation.CreateJointsAttr(joints)
    animation.CreateScalesAttr([pxr.Gf.Vec3h(1, 1, 1)] * len(joints))
    turns, places = animation.CreateRotationsAttr(), animation.CreateTranslationsAttr()
    rotations = np.roll(motion.rotations_wxyz, -1, axis=-1).astype(
        np.float32
    )  # the real part lies last in memory
    positions = motion.local_positions_m().astype(np.float32)
    for frame in range(motion.frame_count):
        turns.Set(pxr.Vt.QuatfArray.FromNumpy(rotations[frame]), frame)
        places.Set(pxr.Vt.Vec3fArray.FromNumpy(positions[frame]), frame)
    _add_undecided(pxr, animation, motion)
    return animation.GetPath()


def _add_undecided(pxr: Any, animation: Any, motion: LocalMotion) -> None:
    """Add the attribute `undecided`: whether the performer's identity is uncertain, frame by frame."""
    if motion.undecided_s is None:
        return
    doubt = animation.GetPrim().CreateAttribute("undecided", pxr.Sdf.ValueTypeNames.Bool, True)
    doubt.Set(False, 0)
    for begin, end in motion.undecided_s:
        doubt.Set(True, round(begin * motion.frames_per_second))
        doubt.Set(False, round(end * motion.frames_per_second) + 1)


def _add_mesh(pxr: Any, stage: Any, path: str, mesh: SkinnedMesh, skeleton: Any) -> None:
    shape = pxr.UsdGeom.Mesh.Define(stage, f"{path}/Mannequin")
    shape.CreatePointsAttr(pxr.Vt.Vec3fArray.FromNumpy(mesh.vertices_m))
    shape.CreateNormalsAttr(pxr.Vt.Vec3fArray.FromNumpy(mesh.normals))
    shape.SetNormalsInterpolation(pxr.UsdGeom.Tokens.vertex)
    shape.CreateFaceVertexCountsAttr([3] * len(mesh.triangles))
    shape.CreateFaceVertexIndicesAttr(mesh.triangles.ravel().tolist())
    shape.CreateSubdivisionSchemeAttr(pxr.UsdGeom.Tokens.none)
    shape.CreateDoubleSidedAttr(False)
    colours = shape.CreateDisplayColorPrimvar(pxr.UsdGeom.Tokens.uniform)
    colours.Set([pxr.Gf.Vec3f(*(_SEAM_RGB if tone == SEAM else _BODY_RGB)) for tone in mesh.tones.tolist()])
    binding = pxr.UsdSkel.BindingAPI.Apply(shape.GetPrim())
    width = mesh.joint_indices.shape[1]
    binding.CreateJointIndicesPrimvar(False, width).Set(mesh.joint_indices.astype(int).ravel().tolist())
    binding.CreateJointWeightsPrimvar(False, width).Set(mesh.weights.ravel().tolist())
    binding.CreateGeomBindTransformAttr(pxr.Gf.Matrix4d(1.0))
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
