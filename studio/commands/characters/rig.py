"""`studio rig`: the roles of a user's rig's bones."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from studio.commands.common import add_command, add_json, table, write_result

if TYPE_CHECKING:
    from studio.engine.animation.retarget.facts import RigFacts

_TEXT = """\
Show the roles of a rig's bones, for exports onto it (`studio export --rig`).

FILE is a GLB, FBX or BVH with a skeleton in a T-pose or an A-pose. --save writes the table beside it, as
FILE.mapping.json, where you can correct it; every export onto these bones uses it from then on."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "rig", run, _TEXT)
    parser.add_argument("rig", metavar="FILE", type=Path, help="a GLB, FBX or BVH file with a skeleton")
    parser.add_argument("--mapping", metavar="FILE", type=Path, help="show this table instead")
    parser.add_argument("--save", action="store_true", help="write the table beside the rig")
    parser.add_argument("--out", metavar="FILE", type=Path, help="write the table there instead")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.engine.animation.retarget.facts import rig_facts
    from studio.engine.animation.retarget.files import read_rig
    from studio.engine.animation.retarget.mapping import checked_bones, mapping_path, save_mapping

    facts = rig_facts(args.rig, args.mapping)
    print(_shown(args.rig, facts))
    out = args.out if args.out is not None else mapping_path(args.rig) if args.save else None
    if out is not None:
        save_mapping(out, read_rig(args.rig), checked_bones(dict(facts.bones), str(args.rig)))
        print(f"{out}: written; correct it there")
    write_result(args, structs.asdict(facts))
    return 0


def _shown(path: Path, facts: "RigFacts") -> str:
    rows = [(role, bone or "-") for role, bone in facts.bones.items()]
    width = max(len(bone) for _, bone in rows)
    lines = table([("role", "bone".ljust(width)), *((role, bone.ljust(width)) for role, bone in rows)])
    mapped = sum(bone is not None for bone in facts.bones.values())
    told = f"{path}: {facts.bone_count} bones, {mapped} of them mapped ({facts.mapping})"
    if facts.problem is not None:
        told += f"\nnot ready: {facts.problem}"
    else:
        told += f", {facts.height_m:.2f} m high, legs {facts.leg_m:.2f} m"
    if facts.arms_below_t_pose_deg is not None:
        told += f", arms {facts.arms_below_t_pose_deg:.0f} degrees below the T-pose"
    others = ", ".join(facts.unmapped) or "none"
    return f"{lines}\n{told}\nbones that keep their rest pose: {others}"
