"""Files that a robot's model names: included models, meshes, textures. A model from somebody else may name no files
outside its own folder."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from itertools import product
from pathlib import Path

from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable_give_other

ENDINGS = (".xml", ".mjcf", ".urdf")
"""Endings of models."""

_FOLDERS = ("meshdir", "texturedir", "assetdir")
_FILES = re.compile(r"file(name|left|right|up|down|front|back)?")
_PACKAGE = re.compile(r"^(package|file)://")
_MOST_INCLUDES = 100


def models_in(folder: Path) -> list[Path]:
    """Return the robots' models in a folder, at any depth, sorted.

    Parts that another model includes are left out, and scenes too: these have no joints, and include one model.

    Raises:
        FormatError: a file cannot be read.
    """
    found = sorted(path for path in folder.rglob("*") if path.suffix.lower() in ENDINGS and _is_model(path))
    includes = {path: set(_included(path)) & set(found) for path in found}
    scenes = {path for path, inner in includes.items() if len(inner) == 1 and not _moves(path)}
    parts = {inner for path in found if path not in scenes for inner in includes[path]}
    return [path for path in found if path not in scenes and path not in parts]


def check_named_files(model: Path, folder: Path) -> None:
    """Check that all files that a model names lie in a folder.

    Args:
        model: MJCF or URDF.
        folder: the folder that contains the model, at any depth.

    Raises:
        FormatError: it names a file outside, or it or an included file is no XML.
    """
    root = folder.resolve()
    models = [model, *_all_included(model)]
    folders = {"", *(value for one in models for value in _values(one, _FOLDERS))}
    for one in models:
        for name, inner, start in product(_names(one), folders, {one.parent, model.parent}):
            if not (start / inner / name).resolve().is_relative_to(root):
                raise FormatError(
                    "robot.file_outside",
                    "{path} names the file {name!r} outside of its folder; put it inside, and name it from there",
                    path=model,
                    name=name,
                )


def _is_model(path: Path) -> bool:
    try:
        return _read(path).tag in ("mujoco", "robot")
    except FormatError:
        return False


def _moves(path: Path) -> bool:
    """Whether a file has joints itself."""
    return any(True for _ in _read(path).iter("joint"))


def _all_included(model: Path) -> list[Path]:
    found: list[Path] = []
    left = [model]
    while left and len(found) < _MOST_INCLUDES:
        for path in _included(left.pop()):
            if path not in found and path.is_file():
                found.append(path)
                left.append(path)
    return found


def _included(path: Path) -> Iterator[Path]:
    for one in _read(path).iter("include"):
        yield Path(path.parent, one.get("file", ""))


def _names(path: Path) -> Iterator[str]:
    for element in _read(path).iter():
        for key, value in element.attrib.items():
            if _FILES.fullmatch(key):
                yield _PACKAGE.sub("", value)


def _values(path: Path, keys: tuple[str, ...]) -> Iterator[str]:
    for element in _read(path).iter("compiler"):
        yield from (element.attrib[key] for key in keys if key in element.attrib)


def _read(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.parse(path).getroot()
    except OSError as error:
        raise FormatError(unreadable_give_other(path, error)) from error
    except ElementTree.ParseError as error:
        raise FormatError(
            "robot.unreadable",
            "{path} is no robot's model: {error}; give an MJCF or URDF file",
            path=path,
            error=str(error),
        ) from error
