"""Bundles of networks: `.task` files, zip files of networks for LiteRT."""

import zipfile
from pathlib import Path

from studio.engine.base.errors import FormatError, NotAvailableError, SettingsError
from studio.engine.base.value_sentences import unknown

MODELS = Path(__file__).parents[3] / "models"
"""Folder of the bundles that come with the studio; its README gives their sources."""

POSE_MODELS = {
    "lite": "pose_landmarker_lite.task",
    "full": "pose_landmarker_full.task",
    "heavy": "pose_landmark_heavy.tflite",
}
"""Files of the pose models by name; the heavy one does not come with the studio."""

_MOST_BYTES = 200_000_000


def model_file(model: str | Path) -> Path:
    """Return the file of a pose model.

    Args:
        model: `lite`, `full` or `heavy`, or the path of a bundle (`.task`), of a network of landmarks (`.tflite`), or
            of the description of a third-party network (`.json`, `.toml`).

    Raises:
        NotAvailableError: the heavy model is not installed.
        SettingsError: no model and no file has this name.
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
    raise SettingsError(unknown("model", str(model), [*POSE_MODELS, "a file (.task, .tflite, .json, .toml)"]))


def pose_networks(path: Path) -> tuple[bytes, bytes]:
    """Return the networks of a pose model: the detector of people, and the landmarks.

    A network of landmarks alone (`.tflite`) is used with the detector that comes with the studio.

    Raises:
        FormatError: the file cannot be read, is no bundle, or lacks a network.
    """
    if path.suffix.lower() != ".tflite":
        return _member(path, "pose_detector.tflite"), _member(path, "pose_landmarks_detector.tflite")
    try:
        landmarks = path.read_bytes()
    except OSError as error:
        raise broken(path, error) from error
    return _member(MODELS / POSE_MODELS["lite"], "pose_detector.tflite"), landmarks


def hand_network(path: Path) -> bytes:
    """Return the network of a hand's landmarks in a bundle.

    Raises:
        FormatError: the file cannot be read, is no bundle, or lacks the network.
    """
    return _member(path, "hand_landmarks_detector.tflite")


def _member(path: Path, name: str) -> bytes:
    try:
        with zipfile.ZipFile(path) as bundle:
            if bundle.getinfo(name).file_size > _MOST_BYTES:
                raise broken(path, f"{name} is larger than {_MOST_BYTES >> 20} MB")
            return bundle.read(name)
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
