"""The calibration of a recording that is played as cameras: used while it plays, kept nowhere."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.calibration.result import Calibration
from studio.engine.errors import StudioError
from studio.engine.frames import ClockModel
from studio.live.calibrations import BORROWED, Kept, load_last_calibration
from studio.take.sessions import MOST_KEPT, Stamp, file_stamp
from studio.take.take import Take, read_calibration

if TYPE_CHECKING:
    from studio.live.engine import Engine


def calibration_of_recording(path: Path, cameras: tuple[str, ...]) -> Calibration | None:
    """Return the calibration that a recording brings for all of its cameras, with latency corrections as clocks.

    None where it has none, one that was refused, or one without a performer.

    Args:
        path: a take, or a folder of cameras with a `calibration.json`.
        cameras: that are played.
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
    """Whether `calibration_of_recording` finds one: a list of recordings costs a look at each of them.

    What was found is kept, and read again where a file is another than before.
    """
    return _brings(
        path, cameras, tuple(file_stamp(path / n) for n in ("take.json", "calibrations", "calibration.json"))
    )


@lru_cache(maxsize=MOST_KEPT)
def _brings(path: Path, cameras: tuple[str, ...], _: tuple[Stamp, ...]) -> bool:
    return calibration_of_recording(path, cameras) is not None


def _as_played(calibration: Calibration) -> Calibration:
    """Return it for frames that are stamped anew by one clock: what their own were apart stays in the stamps."""
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
    """Use a recording's calibration from now on; None: the stage's own again, where a borrowed one is in use.

    Called on the engine thread.
    """
    if calibration is not None:
        engine.use_calibration(calibration, Kept(BORROWED, calibration))
    elif engine.kept is not None and engine.kept.number == BORROWED:
        own = load_last_calibration(engine.folder / "calibrations")
        engine.use_calibration(own.calibration if own else None, own)
