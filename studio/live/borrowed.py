"""The calibration of a recording that is played as cameras. It is used during playback and not kept."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.base.errors import StudioError
from studio.engine.base.files import FileStamp, file_stamp
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel
from studio.live.calibration.kept import BORROWED, KeptCalibration, load_last_calibration
from studio.take.folder.take import Take, read_calibration

if TYPE_CHECKING:
    from studio.live.engine import Engine


MOST_KEPT = 1 << 17
"""Maximum number of recordings whose check for a calibration is cached."""


def calibration_of_recording(path: Path, cameras: tuple[str, ...]) -> Calibration | None:
    """Return a recording's calibration for all of its cameras, with latency corrections as clocks.

    None if it has none, one that was refused, or one without a performer.

    Args:
        path: a take, or a folder of cameras with a `calibration.json`.
        cameras: the played cameras.
    """
    try:
        if (path / "take.json").is_file():
            found = Take.open(path).calibration()
        elif (path / "calibration.json").is_file():
            found = read_calibration(path / "calibration.json")
        else:
            return None
    except StudioError:
        return None
    if found.refused or found.performer is None or not set(cameras) <= set(found.cameras):
        return None
    return _as_played(found)


def brings_calibration(path: Path, cameras: tuple[str, ...]) -> bool:
    """Whether `calibration_of_recording` finds one.

    The result is cached until the file changes, because a list of recordings asks for each.
    """
    return _brings(
        path, cameras, tuple(file_stamp(path / n) for n in ("take.json", "calibrations", "calibration.json"))
    )


@lru_cache(maxsize=MOST_KEPT)
def _brings(path: Path, cameras: tuple[str, ...], _: tuple[FileStamp, ...]) -> bool:
    return calibration_of_recording(path, cameras) is not None


def _as_played(calibration: Calibration) -> Calibration:
    """Return the calibration for frames stamped again by one clock; the new stamps already contain the clocks'
    offsets."""
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    main = clocks.get(calibration.reference, ClockModel())
    return replace(
        calibration,
        cameras={
            name: replace(camera, clock=ClockModel(offset_ns=clocks[name].offset_ns - main.offset_ns))
            for name, camera in calibration.cameras.items()
        },
    )


def borrow(engine: "Engine", calibration: Calibration | None) -> None:
    """Use a recording's calibration from now on. None: return to the stage's own if a borrowed one is in use.

    Called on the engine thread.
    """
    if calibration is not None:
        engine.use_calibration(calibration, KeptCalibration(BORROWED, calibration))
    elif engine.kept is not None and engine.kept.number == BORROWED:
        own = load_last_calibration(engine.folder / "calibrations")
        engine.use_calibration(own.calibration if own else None, own)
