"""What there is to know of a rig before anything is exported onto it, and keeping a rig that was sent."""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.errors import FormatError
from studio.engine.files import write_atomically
from studio.engine.joints import OUTPUT_JOINTS
from studio.engine.retarget.files import read_rig
from studio.engine.retarget.mapping import (
    Mapping,
    guessed_bones,
    load_mapping,
    mapping_of,
    mapping_path,
    saved_bones,
)
from studio.engine.retarget.rig import Rig
from studio.engine.retarget.transfer import Body


def rig_facts(path: str | os.PathLike[str], mapping: str | os.PathLike[str] | None = None) -> dict[str, Any]:
    """Return a rig's mapping and size, units in the keys.

    `bones` has every role, null for one without a bone; `unmapped` are the bones that keep their rest pose. Where
    the mapping does not do yet, `problem` says why, and sizes are null.

    Args:
        path: of the rig.
        mapping: a table to look at; None = the saved one, else by the bones' names.

    Raises:
        FormatError: the rig or the mapping cannot be read. NotAvailableError: as `read_rig`.
    """
    rig = read_rig(path)
    saved = (load_mapping(Path(mapping))[1], Path(mapping)) if mapping is not None else saved_bones(rig)
    bones: dict[str, str] = {}
    try:
        bones = guessed_bones(rig) if saved is None else saved[0]
        checked, problem = mapping_of(rig, bones), None
    except FormatError as error:
        checked, problem = None, str(error)
    names = rig.joint_names if checked is None else checked.rig.joint_names
    return {
        "rig": rig.identity,
        "mapping": "by name" if saved is None else saved[1].name,
        "problem": problem,
        "bone_count": len(names),
        **_sizes(checked),
        "bones": {role: bones.get(role) for role in OUTPUT_JOINTS},
        "unmapped": [name for name in names if name not in bones.values()],
    }


def _sizes(mapping: Mapping | None) -> dict[str, float | None]:
    """Return height and legs [m], and how far arms hang below the T-pose [deg]; null without a mapping."""
    if mapping is None:
        return {"height_m": None, "leg_m": None, "arms_below_t_pose_deg": None}
    at = {role: mapping.rig.positions_m[joint] for role, joint in mapping.joints.items()}
    arms = []
    for side in ("Left", "Right"):
        if {f"{side}Arm", f"{side}Hand"} <= at.keys():
            way = at[f"{side}Hand"] - at[f"{side}Arm"]
            arms.append(np.degrees(np.arctan2(-way[1], np.hypot(way[0], way[2]))))
    return {
        "height_m": round(float(np.ptp(mapping.rig.positions_m[:, 1])), 3),
        "leg_m": round(Body(at).leg_m, 3),
        "arms_below_t_pose_deg": round(float(np.mean(arms)), 1) if arms else None,
    }


def keep_rig(data: bytes, path: Path) -> Rig:
    """Write a rig that was sent to `path`; a mapping of that name for other bones goes.

    Raises:
        FormatError: it cannot be read; then nothing is kept. StudioError: the file cannot be written.
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
    return rig
