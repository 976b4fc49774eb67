"""Incoming robots: models and meshes sent by a browser are kept among the sessions, and read as robots."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.file_sentences import unwritable
from studio.engine.robots.body.named_files import ENDINGS, check_named_files, models_in
from studio.engine.robots.files import MODELS, MOST_NAME, add_robot, kept_robots
from studio.take.folder.names import free_name, inside, safe_name
from studio.take.library.incoming import given_names


def import_robots(
    folder: Path,
    root: str,
    label: str,
    robots: Path,
    *,
    progress: Callable[[float], None] | None = None,
) -> list[str]:
    """Keep the robots among the received files at `root` in `folder`; return their names.

    Their files move to their own folder among the kept robots. A robot is named after its model's file, numbered if
    that name is taken. If one of several models is no humanoid, the others are kept.

    Args:
        folder: of the received files.
        root: path in it; empty = all of it.
        label: its name for people.
        robots: folder of the kept robots.
        progress: receives the share done.

    Raises:
        FormatError: no model, none of a humanoid, or one that names files outside of its folder.
        StudioError: the files cannot be written.
    """
    came = inside(folder, *root.split("/")) if root else folder
    with given_names(folder, label):
        models = models_in(came)
        if not models:
            raise FormatError(
                "robot.no_model",
                "{name} has no robot's model; give one that ends in {allowed}, with its meshes",
                name=label,
                allowed=[*ENDINGS],
            )
        for model in models:
            check_named_files(model, came)
    store = _moved(came, robots / MODELS, Path(label).stem)
    kept: list[str] = []
    try:
        with given_names(store, label):
            kept = _added(robots, [store / model.relative_to(came) for model in models], progress)
    finally:
        if not kept:
            shutil.rmtree(store, ignore_errors=True)
    return kept


def _added(robots: Path, models: Sequence[Path], progress: Callable[[float], None] | None) -> list[str]:
    """Keep those models that are humanoids; return their names."""
    kept: list[str] = []
    problem: StudioError | None = None
    for k, model in enumerate(models):
        if progress is not None:
            progress(k / len(models))
        try:
            kept.append(add_robot(robots, model, _name_of(robots, model)).name)
        except StudioError as error:
            problem = problem or error
    if not kept and problem is not None:
        raise problem
    return kept


def _name_of(robots: Path, model: Path) -> str:
    """Return an allowed and free name for a robot, after its model."""
    plain = "".join(one if one.isalnum() or one in "-_" else "_" for one in model.stem)[: MOST_NAME - 4]
    return free_name(plain, kept_robots(robots).__contains__)


def _moved(came: Path, models: Path, label: str) -> Path:
    """Move the received files to their own folder; return it."""
    place = models / free_name(safe_name(label, "robot"), lambda one: (models / one).exists())
    try:
        models.mkdir(parents=True, exist_ok=True)
        shutil.move(came, place)
    except OSError as error:
        raise StudioError(unwritable(models, error)) from error
    return place
