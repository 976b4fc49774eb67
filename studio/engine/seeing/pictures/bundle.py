"""Bundles of networks: `.task` files, zip files of networks for LiteRT."""

import zipfile
from pathlib import Path

from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.base.value_sentences import unknown

MODELS = Path(__file__).parents[3] / "models"
"""Folder of the bundles that come with the studio; its README says where they are from."""

POSE_MODELS = {
    "lite": "pose_landmarker_lite.task",
    "full": "pose_landmarker_full.task",
    "heavy": "pose_landmarker_heavy.task",
}
"""Files of the pose models by name; the heavy one does not come with the studio."""

DETECTOR, LANDMARKS = "pose_detector.tflite", "pose_landmarks_detector.tflite"

_MOST_BYTES = 200_000_000


def model_file(model: str | Path) -> Path:
    """Return the file of a pose model.

    Args:
        model: `lite`, `full` or `heavy`, or the path of a bundle.

    Raises:
        NotAvailableError: the heavy model is not there.
        FormatError: no file of this name, and no model of this name.
    """
    path = MODELS / POSE_MODELS[str(model)] if str(model) in POSE_MODELS else Path(model)
    if path.is_file():
        return path
    if str(model) == "heavy":
        raise NotAvailableError(
            "model.no_heavy",
            "the heavy model is not here: it does not come with the studio; use full, or fetch it as "
            "docs/devices.md says",
        )
    raise FormatError(unknown("model", str(model), [*POSE_MODELS, "a file (.task)"]))


def networks_in(path: Path, names: tuple[str, ...] = (DETECTOR, LANDMARKS)) -> tuple[bytes, ...]:
    """Return the networks of a bundle by their names in it.

    Raises:
        FormatError: it cannot be read, is no bundle, or lacks a network.
    """
    try:
        with zipfile.ZipFile(path) as bundle:
            if sum(one.file_size for one in bundle.infolist()) > _MOST_BYTES:
                raise broken(path, f"it unpacks to more than {_MOST_BYTES >> 20} MB")
            return tuple(bundle.read(name) for name in names)
    except (OSError, zipfile.BadZipFile, KeyError, NotImplementedError, RuntimeError, EOFError) as error:
        raise broken(path, error) from error


def broken(path: Path, error: object) -> FormatError:
    """Return the error of a file that is no pose model."""
    return FormatError(
        "model.broken",
        "{path} is no pose model ({error}); use lite or full, or a whole bundle (.task)",
        path=path,
        error=str(error) or type(error).__name__,
    )
