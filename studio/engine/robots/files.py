"""Kept robots: one table per robot, which names its model, its parts and its velocity limits.

The model stays where it is, with its meshes; models sent by a browser are in `models`. A table can be corrected by
hand; docs/formats.md describes it.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable_give_other
from studio.engine.base.files import write_json
from studio.engine.base.versions import ROBOT

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

FOLDER = "robots"
"""Folder of the kept robots among the sessions."""

MODELS = "models"
"""Folder in it for sent models; tables name these relative to the folder of the kept robots."""

MOST_NAME = 64
"""Maximum number of characters of a robot's name."""


def add_robot(
    folder: Path,
    model: Path,
    name: str,
    *,
    parts: Mapping[str, str] | None = None,
    velocity_rad_s: float | None = None,
) -> "Robot":
    """Read a robot's model, write its table to `folder/name.json`, and return the robot.

    Args:
        folder: folder of the kept robots.
        model: MJCF or URDF.
        name: name of the robot; a robot of that name is replaced.
        parts: corrections of the mapping, part -> body.
        velocity_rad_s: limit of every hinge; None = the model's, else the usual one.

    Raises:
        FormatError: as `build_robot`; or a name that is not allowed.
        StudioError: the table cannot be written.
    """
    from studio.engine.robots.body.robot import build_robot

    robot_table(folder, name)  # reports a name that is not allowed
    return _keep(folder, model, build_robot(model, name, parts=parts, velocity_rad_s=velocity_rad_s))


def _keep(folder: Path, model: Path, robot: "Robot") -> "Robot":
    """Write a robot's table; return the robot."""
    limits = zip(robot.joint_names, robot.velocity_rad_s.tolist(), strict=True)
    table = {
        "model": _named_from(folder, model),
        "sha256": _digest(model),
        "parts": dict(robot.parts),
        "velocity_rad_s": {joint: round(limit, 6) for joint, limit in limits},
    }
    write_json(robot_table(folder, robot.name), ROBOT.stamped(table))
    return robot


def load_robot(folder: Path, name: str) -> "Robot":
    """Return a kept robot.

    Raises:
        FormatError: there is none of that name, its table cannot be read, or its model is missing or has changed.
    """
    from studio.engine.robots.body.robot import build_robot

    table, model = _table_of(folder, name)
    robot = build_robot(model, name, parts=table["parts"], velocity_rad_s=table.get("velocity_rad_s"))
    return replace(robot, name=name)


def correct_robot(
    folder: Path, name: str, parts: Mapping[str, str], velocity_rad_s: float | None = None
) -> "Robot":
    """Read a kept robot again with other parts, save it, and return it.

    Args:
        folder: folder of the kept robots.
        name: name of the robot.
        parts: corrections of its parts, part -> body; the others stay.
        velocity_rad_s: limit of every hinge; None = its present limits.

    Raises:
        FormatError: as `load_robot`.
        StudioError: the table cannot be written.
    """
    from studio.engine.robots.body.robot import build_robot

    table, model = _table_of(folder, name)
    velocity = table.get("velocity_rad_s") if velocity_rad_s is None else velocity_rad_s
    return _keep(
        folder, model, build_robot(model, name, parts=table["parts"] | parts, velocity_rad_s=velocity)
    )


def _table_of(folder: Path, name: str) -> tuple[dict[str, Any], Path]:
    """Return a robot's table and its model, which exists and is unchanged."""
    table = _read(find_robot(folder, name))
    model = folder / table["model"]
    if not model.is_file():
        raise FormatError(
            "robot.model_gone",
            "the model of robot {name}, {path}, is gone; add the robot again",
            name=name,
            path=model,
        )
    if _digest(model) != table.get("sha256"):
        raise FormatError(
            "robot.model_changed",
            "the model of robot {name}, {path}, is not as it was; add the robot again",
            name=name,
            path=model,
        )
    return table, model


def kept_robots(folder: Path) -> list[str]:
    """Return the names of the kept robots, sorted."""
    return sorted(path.stem for path in folder.glob("*.json"))


def remove_robot(folder: Path, name: str) -> None:
    """Remove a kept robot, so that `restore_robot` can bring it back; its model stays.

    Raises:
        FormatError: there is none of that name.
    """
    path = find_robot(folder, name)
    path.replace(_removed(path))


def restore_robot(folder: Path, name: str) -> None:
    """Bring back the robot that was last removed under a name.

    Raises:
        FormatError: none was removed, or another has the name now.
    """
    path = robot_table(folder, name)
    if path.is_file() or not _removed(path).is_file():
        raise FormatError("robot.not_removed", "no robot {name!r} is removed that could come back", name=name)
    _removed(path).replace(path)


def _removed(path: Path) -> Path:
    return path.with_suffix(".removed")


def find_robot(folder: Path, name: str) -> Path:
    """Return the table of a kept robot.

    Raises:
        FormatError: there is none of that name.
    """
    path = robot_table(folder, name)
    if not path.is_file():
        raise FormatError(
            "robot.none",
            "there is no robot {name!r}; kept are: {known}; `studio robot add MODEL --name {name}` adds one",
            name=name,
            known=", ".join(kept_robots(folder)) or "none",
        )
    return path


def robot_table(folder: Path, name: str) -> Path:
    """Return the file of a robot's table.

    Raises:
        FormatError: a name that is not allowed.
    """
    if not name or len(name) > MOST_NAME or not all(one.isalnum() or one in "-_" for one in name):
        raise FormatError(
            "robot.name", "robot {name!r}: allowed are up to 64 letters, digits, - and _", name=name
        )
    return folder / f"{name}.json"


def _named_from(folder: Path, model: Path) -> str:
    """Return the path of a model for a table: relative inside the folder of kept robots, else absolute."""
    model, folder = model.resolve(), folder.resolve()
    return model.relative_to(folder).as_posix() if model.is_relative_to(folder) else str(model)


def _digest(model: Path) -> str:
    try:
        return sha256(model.read_bytes()).hexdigest()
    except OSError as error:
        raise FormatError(unreadable_give_other(model, error)) from error


def _read(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(
            "robot.table",
            "{path} is no table of a robot: {error}; add the robot again",
            path=path,
            error=str(error)[:120],
        ) from error
    wrong = not isinstance(value, dict) or not isinstance(value.get("model"), str)
    if wrong or not _texts(value.get("parts")) or not _numbers(value.get("velocity_rad_s", {})):
        raise FormatError(
            "robot.table",
            "{path} is no table of a robot: {error}; add the robot again",
            path=path,
            error="model, parts and velocity_rad_s are needed",
        )
    return ROBOT.current(value, path)


def _texts(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(one, str) for one in value.values())


def _numbers(value: object) -> bool:
    return isinstance(value, dict) and all(
        isinstance(one, int | float) and not isinstance(one, bool) for one in value.values()
    )
