"""Description of a rig for the user before an export onto it, and storage of an uploaded rig."""

import os
import tempfile
from pathlib import Path

import numpy as np
from msgspec import Struct

from studio.engine.animation.retarget.files import read_rig
from studio.engine.animation.retarget.mapping import (
    Mapping,
    checked_bones,
    guessed_bones,
    load_mapping,
    mapping_of,
    mapping_path,
    save_mapping,
    saved_bones,
)
from studio.engine.animation.retarget.transfer import RigBody
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.model.joints import OUTPUT_JOINTS


class RigFacts(Struct):
    """A rig's mapping and size.

    Attributes:
        rig: identity of its bones; mapping: file of the mapping, or `by name`.
        problem: why the mapping is incomplete, else None. Then heights and angles are None.
        height_m, leg_m: height and leg length [m].
        arms_below_t_pose_deg: angle of the arms [deg]; None without arms.
        bones: by role the name of the bone; None for a role without one.
        unmapped: the bones that keep their rest pose.
    """

    rig: str
    mapping: str
    problem: str | None
    bone_count: int
    height_m: float | None
    leg_m: float | None
    arms_below_t_pose_deg: float | None
    bones: dict[str, str | None]
    unmapped: list[str]


def rig_facts(path: str | os.PathLike[str], mapping: str | os.PathLike[str] | None = None) -> RigFacts:
    """Return a rig's mapping and size.

    Args:
        path: of the rig.
        mapping: a table to use; None = the saved one, else by the bones' names.

    Raises:
        FormatError: the rig or the mapping cannot be read.
        NotAvailableError: as `read_rig`.
    """
    rig = read_rig(path)
    saved = (load_mapping(Path(mapping))[1], Path(mapping)) if mapping is not None else saved_bones(rig)
    bones: dict[str, str] = {}
    try:
        bones = guessed_bones(rig) if saved is None else saved[0]
        checked, problem = mapping_of(rig, bones), None
    except FormatError as error:
        checked, problem = None, error.sentence
    names = rig.joint_names if checked is None else checked.rig.joint_names
    height_m, leg_m, arms_deg = (None, None, None) if checked is None else _sizes(checked)
    return RigFacts(
        rig=rig.identity,
        mapping="by name" if saved is None else saved[1].name,
        problem=problem,
        bone_count=len(names),
        height_m=height_m,
        leg_m=leg_m,
        arms_below_t_pose_deg=arms_deg,
        bones={role: bones.get(role) for role in OUTPUT_JOINTS},
        unmapped=[name for name in names if name not in bones.values()],
    )


def _sizes(mapping: Mapping) -> tuple[float, float, float | None]:
    """Return height and leg length [m], and the angle of the arms below the T-pose [deg]."""
    at = {role: mapping.rig.positions_m[joint] for role, joint in mapping.joints.items()}
    arms = []
    for side in ("Left", "Right"):
        if {f"{side}Arm", f"{side}Hand"} <= at.keys():
            way = at[f"{side}Hand"] - at[f"{side}Arm"]
            arms.append(np.degrees(np.arctan2(-way[1], np.hypot(way[0], way[2]))))
    height_m = round(float(np.ptp(mapping.rig.positions_m[:, 1])), 3)
    return height_m, round(RigBody(at).leg_m, 3), round(float(np.mean(arms)), 1) if arms else None


def keep_rig(data: bytes, path: Path) -> RigFacts:
    """Write an uploaded rig to `path`; return its `rig_facts`. A mapping next to it for other bones is deleted.

    Raises:
        FormatError: it cannot be read; then nothing is stored.
        StudioError: the file cannot be written.
    """
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / path.name
        trial.write_bytes(data)
        rig = read_rig(trial)
    beside = mapping_path(path)
    with write_atomically(path) as file:
        file.write(data)
    if beside.is_file() and load_mapping(beside)[0] != rig.identity:
        beside.unlink()
    return rig_facts(path)


def map_rig(path: Path, bones: dict[str, str | None]) -> RigFacts:
    """Save the roles of a rig's bones next to it; return its `rig_facts`.

    Args:
        path: of the rig.
        bones: name of the bone by role; None where there is none.

    Raises:
        FormatError: the rig cannot be read, or the mapping does not fit it; then the saved one stays.
    """
    rig, named = read_rig(path), checked_bones(dict(bones), "mapping")
    mapping_of(rig, named)
    save_mapping(mapping_path(path), rig, named)
    return rig_facts(path)
