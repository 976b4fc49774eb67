"""`studio robot`: humanoid robots as characters."""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, figure, table, write_result

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

_TEXT = """\
Keep humanoid robots, for exports onto them (`studio export --robot`), or play a motion of one.

MODEL is an MJCF or URDF file of a humanoid. `add` finds the parts of its body by joints and names, measures it, shows
both, and keeps a table in SESSIONS/robots/NAME.json, where parts and velocity limits can be corrected. The model and
its meshes stay where they are. docs/robots.md explains it."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "robot", run, _TEXT)
    actions = parser.add_subparsers(
        dest="action", metavar="ACTION", title="actions", help="what to do", required=True
    )
    add = _action(actions, "add", "read a model, and keep it")
    add.add_argument("model", metavar="MODEL", type=Path, help="an MJCF or URDF file")
    add.add_argument("--name", metavar="NAME", required=True, help="name of the robot")
    add.add_argument("--part", metavar="PART=BODY", action="append", default=[],
        help="this part is this body of the model, such as left_hand=left_palm_link; may be given again")  # fmt: skip
    add.add_argument("--velocity", metavar="RAD_S", type=float,
        help="velocity limit of every joint (default: the model's, else 9.42)")  # fmt: skip
    add_json(add)
    _action(actions, "list", "names of the kept robots")
    show = _action(actions, "show", "parts, sizes and limits of a kept robot")
    show.add_argument("name", metavar="NAME", help="of the robot")
    add_json(show)
    remove = _action(actions, "remove", "remove a kept robot; its model stays")
    remove.add_argument("name", metavar="NAME", help="of the robot")
    play = _action(actions, "play", "show a motion in MuJoCo's viewer, or write pictures or a video of it")
    play.add_argument("name", metavar="NAME", help="of the robot")
    play.add_argument(
        "motion", metavar="FILE", type=Path, help="npz or CSV, as `studio export --robot` writes it"
    )
    play.add_argument(
        "--out", metavar="FILE", type=Path, help="write a strip of pictures (.png) or a video (.mp4)"
    )
    play.add_argument("--fps", metavar="F", type=float, default=30.0,
        help="frames per second of a CSV, which tells none (default 30)")  # fmt: skip


def _action(actions: Any, name: str, text: str) -> argparse.ArgumentParser:
    parser = actions.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    add_sessions(parser)
    return parser


def add_sessions(parser: Any) -> None:
    """Add the option for the folder of sessions, which has the kept robots."""
    parser.add_argument(
        "--sessions", metavar="DIR", type=Path, default=Path("sessions"),
        help="folder of the recorded takes (default sessions)",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    if args.action == "play":
        _draw_without_screen()
    from studio.engine.robots.files import FOLDER, add_robot, kept_robots, load_robot, remove_robot

    folder = args.sessions / FOLDER
    if args.action == "list":
        print("\n".join(kept_robots(folder)) or f"no robots in {folder}")
    elif args.action == "remove":
        remove_robot(folder, args.name)
        print(f"{args.name}: removed")
    elif args.action == "play":
        _play(load_robot(folder, args.name), args.motion, args.fps, args.out)
    elif args.action == "show":
        _show(args, load_robot(folder, args.name))
    else:
        robot = add_robot(
            folder, args.model, args.name, parts=_parts(args.part), velocity_rad_s=args.velocity
        )
        _show(args, robot)
        print(f"{folder / args.name}.json: written; correct it there")
    return 0


def _draw_without_screen() -> None:
    """Choose a way of drawing without a screen; MuJoCo reads it when it is loaded."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        os.environ.setdefault("MUJOCO_GL", "egl")


def _parts(given: list[str]) -> dict[str, str]:
    from studio.engine.base.errors import SettingsError

    for text in given:
        if "=" not in text:
            raise SettingsError(
                "robot.part_option", "--part {text}: give it as PART=BODY, such as left_hand=palm", text=text
            )
    return {part: body for part, _, body in (text.partition("=") for text in given)}


def _show(args: argparse.Namespace, robot: "Robot") -> None:
    from msgspec import to_builtins

    from studio.engine.robots.describe import robot_facts

    facts = robot_facts(robot)
    print(table([("part", "body"), *facts.parts.items()]))
    rows = [["joint", "from rad", "to rad", "rad/s", "N m", "turns"]]
    for joint in facts.joints:
        limits = (joint.low_rad, joint.high_rad, joint.velocity_rad_s)
        rows.append(
            [joint.name, *(figure(value, 2) for value in limits), figure(joint.torque_nm, 0), joint.turns]
        )
    print(table(rows))
    sizes = [f"legs {facts.leg_m:.3f} m"]
    sizes += [f"{limb.replace('_', ' ')} {length:.3f} m" for limb, length in facts.lengths_m.items()]
    sizes.append("soles " + " x ".join(f"{100.0 * side:.1f}" for side in facts.sole_m) + " cm")
    print(f"{robot.name}: {facts.height_m:.2f} m high, {facts.mass_kg:.1f} kg; {', '.join(sizes)}")
    print(f"{len(facts.joints)} joints, {facts.moved} of them moved; the others keep their place")
    for note in facts.notes:
        print(f"note: {note}")
    write_result(args, to_builtins(facts, enc_hook=str))


def _play(robot: "Robot", file: Path, csv_fps: float, out: Path | None) -> None:
    from studio.engine.robots.motion import load_motion
    from studio.review.render.robot import play, write_pictures

    motion = load_motion(file, robot, csv_fps)
    if out is None:
        play(robot, motion)
    else:
        write_pictures(robot, motion, out)
        print(f"{out}: {len(motion.time_s)} frames, {motion.time_s[-1] - motion.time_s[0]:.1f} s")
