"""Roles of a rig's bones: a table from HumanIK roles to bones, guessed from names, editable, saved."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studio.engine.animation.retarget.rig import Rig
from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable_give_other
from studio.engine.base.files import write_json
from studio.engine.base.sentences import say
from studio.engine.base.versions import RIG_MAPPING
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.roles import roles_of

SUFFIX = ".mapping.json"
MAX_BYTES = 1 << 20

_LEGS = tuple(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot"))
_ARMS = tuple(f"{side}{part}" for side in ("Left", "Right") for part in ("Arm", "ForeArm", "Hand"))
_SHORTEST_M = 1e-3
"""A shorter bone of a limb has no direction."""


@dataclass(frozen=True)
class Mapping:
    """A rig's one skeleton, and the role of each of its bones.

    Attributes:
        rig: the tree of the hips.
        roles: HumanIK name of each bone, "" for one that keeps its rest pose, shape (J,).
    """

    rig: Rig
    roles: tuple[str, ...]

    @property
    def joints(self) -> dict[str, int]:
        """Role -> index of its bone."""
        return {role: joint for joint, role in enumerate(self.roles) if role}


def guessed_bones(rig: Rig) -> dict[str, str]:
    """Return role -> bone by the names of the bones, in the order of the output skeleton.

    Raises:
        FormatError: two characters have hips, and either could be meant.
    """
    roles = roles_of(rig.joint_names, rig.parents.tolist())
    found = {role: name for role, name in zip(roles, rig.joint_names, strict=True) if role}
    if "Hips" in found:
        _check_one_hips(rig, roles.index("Hips"))
    if "Spine" in found and not {"Spine1", "Spine2"} & set(
        found
    ):  # a single bone counts as the middle of the back
        found["Spine1"] = found.pop("Spine")
    return {role: found[role] for role in OUTPUT_JOINTS if role in found}


def _check_one_hips(rig: Rig, hips: int) -> None:
    """Refuse two hips of which neither is below the other."""
    for joint, name in enumerate(rig.joint_names):
        plain = name.rsplit("_", 1)[0] if name.rsplit("_", 1)[-1].isdecimal() else name
        if joint == hips or "Hips" not in (*roles_of([name], [-1]), *roles_of([plain], [-1])):
            continue
        if not rig.below(joint, hips) and not rig.below(hips, joint):
            raise FormatError(
                "rig.two_hips",
                "{path} has two hips, {one!r} and {other!r}; name one of them as Hips in a mapping, "
                "or export one character alone",
                path=rig.path,
                one=rig.joint_names[hips],
                other=name,
            )


def mapping_of(rig: Rig, bones: dict[str, str] | None = None) -> Mapping:
    """Return the bones of the roles, checked.

    Args:
        rig: as read.
        bones: role -> bone; None = by their names.

    Raises:
        FormatError: an unknown role or bone, a bone with two roles, a bone below a wrong one, no hips, no legs,
            or a limb without length.
    """
    bones = guessed_bones(rig) if bones is None else bones
    index = {name: joint for joint, name in enumerate(rig.joint_names)}
    owner: dict[str, str] = {}
    for role, name in bones.items():
        if role not in OUTPUT_JOINTS:
            raise FormatError(
                "rig.no_role",
                "mapping: {role!r} is no role; allowed are {allowed}",
                role=role,
                allowed=[*OUTPUT_JOINTS],
            )
        if name not in index:
            raise FormatError(
                "rig.no_such_bone",
                "mapping: {role} is {bone!r}, but {path} has no such bone; see `studio rig`",
                role=role,
                bone=name,
                path=rig.path,
            )
        if name in owner:
            raise FormatError(
                "rig.bone_used_twice",
                "mapping: bone {bone!r} is both {one} and {other}; give it to one of them",
                bone=name,
                one=owner[name],
                other=role,
            )
        owner[name] = role
    if "Hips" not in bones:
        raise FormatError(
            "rig.no_hips_bone",
            "{path}: no bone for the hips under any known name; it has {others}; name it as Hips "
            "in a mapping",
            path=rig.path,
            others=", ".join(rig.joint_names)[:300],
        )
    lacking = [role for role in _LEGS if role not in bones]
    if lacking:
        raise FormatError(
            "rig.bones_missing",
            "{path}: no bone for {names}; name them in a mapping: legs are needed",
            path=rig.path,
            names=[*lacking],
        )
    tree = rig.tree_of(index[bones["Hips"]])
    places = {name: joint for joint, name in enumerate(tree.joint_names)}
    _check_tree(tree, bones, places)
    roles = [""] * len(tree.joint_names)
    for role, name in bones.items():
        roles[places[name]] = role
    return Mapping(tree, tuple(roles))


def _check_tree(rig: Rig, bones: dict[str, str], places: dict[str, int]) -> None:
    """Refuse bones that are not below their carriers, and limbs without length."""
    for role, name in bones.items():
        above = _carrier(role, bones)
        if above is None:
            continue
        if name not in places or not rig.below(places[name], places[bones[above]]):
            raise FormatError(
                "rig.not_on_chain",
                "mapping: {role} ({bone!r}) does not hang on {other} ({carrier!r}); correct one of them",
                role=role,
                bone=name,
                other=above,
                carrier=bones[above],
            )
        if role.removeprefix("Left").removeprefix("Right") in ("ForeArm", "Hand", "Leg", "Foot"):
            bone = rig.positions_m[places[name]] - rig.positions_m[places[bones[above]]]
            if np.linalg.norm(bone) < _SHORTEST_M:
                raise FormatError(
                    "rig.no_length",
                    "{path}: from {one} ({bone!r}) to {other} ({end!r}) is no length; a limb's bones need one",
                    path=rig.path,
                    one=above,
                    bone=bones[above],
                    other=role,
                    end=name,
                )


def _carrier(role: str, bones: dict[str, str]) -> str | None:
    """Return the nearest mapped role above a role, None for the hips."""
    parent = int(OUTPUT_PARENTS[OUTPUT_JOINTS.index(role)])
    while parent >= 0 and OUTPUT_JOINTS[parent] not in bones:
        parent = int(OUTPUT_PARENTS[parent])
    return None if parent < 0 else OUTPUT_JOINTS[parent]


def mapping_path(rig_path: Path) -> Path:
    """Return the path of a rig's mapping, next to the rig."""
    return rig_path.with_name(rig_path.name + SUFFIX)


def save_mapping(path: Path, rig: Rig, bones: dict[str, str]) -> None:
    """Write a mapping as an editable table: every role, null for one without a bone.

    Raises:
        StudioError: the file cannot be written.
    """
    table = {"rig": rig.identity, "bones": {role: bones.get(role) for role in OUTPUT_JOINTS}}
    write_json(path, RIG_MAPPING.stamped(table))


def load_mapping(path: Path) -> tuple[str, dict[str, str]]:
    """Return the rig of a saved mapping, and its bones by role.

    Raises:
        FormatError: the file cannot be read, or is no mapping.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FormatError(
                "rig.mapping_too_large",
                "{path} has more than {n} bytes, which no mapping has",
                path=path,
                n=MAX_BYTES,
            )
        value = json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=_without_repeats)
    except OSError as error:
        raise FormatError(unreadable_give_other(path, error)) from error
    except (ValueError, RecursionError) as error:
        raise FormatError(
            "rig.mapping_unreadable",
            "{path} is no mapping: {error}; `studio rig FILE --out` writes one",
            path=path,
            error=str(error)[:120],
        ) from error
    if not isinstance(value, dict) or not isinstance(value.get("bones"), dict):
        raise FormatError(
            "rig.mapping_empty",
            "{path} is no mapping: it has no bones; `studio rig FILE --out` writes one",
            path=path,
        )
    value = RIG_MAPPING.current(value, path)
    return str(value.get("rig", "")), checked_bones(value["bones"], str(path))


def checked_bones(bones: dict[str, object], what: str) -> dict[str, str]:
    """Return role -> bone without roles that have none.

    Raises:
        FormatError: the name of a bone is no text.
    """
    for role, name in bones.items():
        if name is not None and not isinstance(name, str):
            raise FormatError(
                "rig.bone_name",
                "{path}: {role} is {bone!r}; allowed is the name of a bone, or null",
                path=what,
                role=role,
                bone=name,
            )
    return {role: name for role, name in bones.items() if isinstance(name, str) and name}


def _without_repeats(pairs: list[tuple[str, object]]) -> dict[str, object]:
    out = dict(pairs)
    if len(out) != len(pairs):
        twice = next(key for key, _ in pairs if sum(other == key for other, _ in pairs) > 1)
        raise ValueError(say("rig.name_twice", "{name!r} stands there twice", name=twice))
    return out


def saved_bones(rig: Rig) -> tuple[dict[str, str], Path] | None:
    """Return the saved mapping of a rig and its file: next to it, or of another file with the same bones.

    Raises:
        FormatError: the mapping next to the rig's file cannot be read, or is for other bones.
    """
    beside = mapping_path(rig.path)
    if beside.is_file():
        identity, bones = load_mapping(beside)
        if identity and identity != rig.identity:
            raise FormatError(
                "rig.other_bones",
                "{path} was saved for other bones than those of {file}; write it again with `studio "
                "rig {same} --out {path}`",
                path=beside,
                file=rig.path.name,
                same=rig.path,
            )
        return bones, beside
    for other in sorted(rig.path.parent.glob(f"*{SUFFIX}")):
        try:
            identity, bones = load_mapping(other)
        except FormatError:  # of another rig; the error is raised when that one is used
            continue
        if identity == rig.identity:
            return bones, other
    return None
