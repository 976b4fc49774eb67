"""Reading a robot's model, MJCF or URDF: one tree of hinges on a free base."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable_give_other
from studio.engine.robots.free_joint import FREE

MAX_BYTES = 64 << 20
UNLIMITED_RAD = float(np.pi)
"""Assumed range of a joint without limits, to both sides."""

_MISSING = re.compile(
    r"(?:Error opening file|could not open|resource not found|not found)[^'\"]*['\"]([^'\"]+)['\"]"
)


@dataclass(frozen=True)
class ReadModel:
    """A robot's model as in its file.

    Attributes:
        path: the file.
        spec: the robot alone, with a free base; may be changed and compiled again.
        model: compiled from `spec`.
        range_rad: lowest and highest angle of each hinge, shape (hinge_count, 2).
        unlimited: names of hinges without limits in the file.
        velocity_rad_s: limit of each hinge that a URDF states, shape (hinge_count,); NaN = not stated.
    """

    path: Path
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    range_rad: NDArray[np.float64]
    unlimited: tuple[str, ...]
    velocity_rad_s: NDArray[np.float64]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the hinges in the model's order."""
        return tuple(self.model.joint(k).name for k in range(1, self.model.njnt))


def read_model(path: Path) -> ReadModel:
    """Return a robot's model.

    A base that is fixed to the world becomes free. Everything else in the world is left out.

    Raises:
        FormatError: the file cannot be read, lacks a mesh, has no joints, or has joints other than hinges.
    """
    text = _text(path)
    spec = _spec(path, text)
    bodies = list(spec.worldbody.bodies)
    base = max(bodies, key=_hinge_count, default=None)
    if base is None or _hinge_count(base) == 0:
        raise FormatError(
            "robot.no_joints", "{path}: no joints; give the MJCF or URDF of a humanoid", path=path
        )
    _alone(spec, base)
    for joint in spec.joints:
        if joint.type not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_FREE):
            raise FormatError(
                "robot.joint_kind",
                "{path}: joint {name!r} is no hinge; a robot may have hinges and one free base",
                path=path,
                name=joint.name,
            )
    model = compiled(path, spec)
    if (
        model.njnt == 0
        or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE
        or model.nq != model.njnt + FREE - 1
    ):
        raise FormatError(
            "robot.base", "{path}: the free base must be the first joint, and the only one", path=path
        )
    limited = model.jnt_limited[1:].astype(bool)
    ranges = np.where(limited[:, None], model.jnt_range[1:], [-UNLIMITED_RAD, UNLIMITED_RAD])
    names = [model.joint(k).name for k in range(1, model.njnt)]
    stated = _stated_velocities(text)
    return ReadModel(
        path,
        spec,
        model,
        ranges,
        tuple(name for name, known in zip(names, limited, strict=True) if not known),
        np.array([stated.get(name, np.nan) for name in names]),
    )


def compiled(path: Path, spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the compiled model.

    Raises:
        FormatError: MuJoCo refuses it; a missing mesh is named.
    """
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _refused(path, error) from error


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FormatError("robot.too_large", "{path} is too large for a robot's model", path=path)
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise FormatError(unreadable_give_other(path, error)) from error


def _spec(path: Path, text: str) -> mujoco.MjSpec:
    """Return the model of a file; for a URDF, its first link is a body too, and its meshes are found."""
    urdf = _urdf(text)
    try:
        if urdf is None:
            return mujoco.MjSpec.from_file(str(path))
        compiler = _child(_child(urdf, "mujoco"), "compiler")
        compiler.attrib |= {"fusestatic": "false", "discardvisual": "false"}
        folder = path.parent / compiler.attrib.pop("meshdir", "")
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(urdf, encoding="unicode"))
    except (ValueError, mujoco.FatalError) as error:
        raise _refused(path, error) from error
    for mesh in spec.meshes:
        mesh.file = str(_mesh(path, folder, mesh.file))
    return spec


def _urdf(text: str) -> ElementTree.Element | None:
    if "<robot" not in text:
        return None
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError:
        return None
    return root if root.tag == "robot" else None


def _child(element: ElementTree.Element, tag: str) -> ElementTree.Element:
    found = element.find(tag)
    return found if found is not None else ElementTree.SubElement(element, tag)


def _mesh(path: Path, folder: Path, name: str) -> Path:
    """Return a mesh of a URDF: next to it, or in the package that contains the URDF."""
    plain = name.removeprefix("file://").removeprefix("package://")
    parts = Path(plain).parts
    for place in (folder, *path.resolve().parents[:4]):
        for first in range(len(parts)):
            candidate = place.joinpath(*parts[first:]).resolve()
            if candidate.is_file():
                return candidate
    raise FormatError(
        "robot.mesh_missing",
        "{path}: its file {mesh!r} is missing; put the meshes where the model says",
        path=path,
        mesh=name,
    )


def _refused(path: Path, error: Exception) -> FormatError:
    told = " ".join(str(error).split())
    missing = _MISSING.search(told)
    if missing is not None:
        return FormatError(
            "robot.mesh_missing",
            "{path}: its file {mesh!r} is missing; put the meshes where the model says",
            path=path,
            mesh=Path(missing[1]).name,
        )
    return FormatError(
        "robot.unreadable",
        "{path} is no robot's model: {error}; give an MJCF or URDF file",
        path=path,
        error=told[:160],
    )


def _hinge_count(body: mujoco.MjsBody) -> int:
    own = sum(joint.type == mujoco.mjtJoint.mjJNT_HINGE for joint in body.joints)
    return own + sum(_hinge_count(child) for child in body.bodies)


def _alone(spec: mujoco.MjSpec, base: mujoco.MjsBody) -> None:
    """Leave the robot alone in its world, on a free base."""
    for body in list(spec.worldbody.bodies):
        if body.name != base.name:
            spec.delete(body)
    for geom in list(spec.worldbody.geoms):
        spec.delete(geom)
    for key in list(spec.keys):
        spec.delete(key)
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in base.joints):
        base.add_freejoint()


def _stated_velocities(text: str) -> dict[str, float]:
    """Return the velocity limits in a URDF [rad/s], by joint; MuJoCo does not read them."""
    root = _urdf(text)
    out = {}
    for joint in () if root is None else root.iter("joint"):
        limit = joint.find("limit")
        try:
            velocity = float(limit.get("velocity", "nan")) if limit is not None else np.nan
        except ValueError:
            continue
        if np.isfinite(velocity) and velocity > 0.0:
            out[joint.get("name", "")] = velocity
    return out
