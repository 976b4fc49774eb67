"""Edits made before a take was calibrated again: their places and directions move with the cameras."""

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError, FormatError, TakeError
from studio.engine.base.sentences import Said, say
from studio.engine.edits.edit import DirectionEdit, Edit, OffsetEdit, PinEdit
from studio.take.edits.kept import EditStep, TakeEdits, read_edits
from studio.take.folder.take import Take, read_calibration


@dataclass(frozen=True)
class EditsOfSolve:
    """The edits that a solve of a take honours.

    Attributes:
        edits: those that are on, under the calibration in use.
        revision: of the list; None if it cannot be read.
        says: why some are not used, or were carried to another calibration; "" = nothing.
    """

    edits: tuple[Edit, ...]
    revision: int | None
    says: Said | str = ""


def edits_of_solve(take: Take) -> EditsOfSolve:
    """Return the edits that a solve honours. A list that cannot be read, or cannot be carried to the calibration in
    use, is left out, and `says` reports it: the take can still be solved."""
    try:
        kept, says = carried(take, read_edits(take))
    except (FormatError, TakeError) as error:
        return EditsOfSolve(
            (), None, say("edits.not_used", "the edits of this take are not used: {why}", why=error.sentence)
        )
    return EditsOfSolve(tuple(one for one in kept.edits if one.on), kept.revision, says)


def carried(take: Take, kept: TakeEdits) -> tuple[TakeEdits, Said | str]:
    """Return the list with its places and directions under the calibration in use, and a sentence if they moved.

    They keep their places relative to the cameras that both calibrations have.

    Raises:
        TakeError: a calibration cannot be read, or they have no camera in common.
    """
    now = take.meta["calibration"]
    if now is None or kept.calibration == now:
        return kept, ""
    if kept.calibration is None or not any(map(_has_place, _all(kept))):
        return msgspec.structs.replace(kept, calibration=now), ""
    try:
        old = read_calibration(take.calibration_path(kept.calibration)).cameras
        new = take.calibration().cameras
    except CalibrationError as error:
        raise TakeError(
            "edits.calibration",
            "they were made under calibration {number}: {why}",
            number=kept.calibration,
            why=error.sentence,
        ) from error
    T = [new[name].T_stage_camera @ np.linalg.inv(old[name].T_stage_camera) for name in old if name in new]
    if not T:
        raise TakeError(
            "edits.other_cameras",
            "they were made under calibration {number}, which has no camera in common with calibration {now}",
            number=kept.calibration,
            now=now,
        )
    T_new_old = _mean(np.array(T))
    says = say(
        "edits.carried",
        "the edits were made under calibration {number} and were carried to calibration {now}",
        number=kept.calibration,
        now=now,
    )
    return _moved_list(kept, T_new_old, now), says


def _all(kept: TakeEdits) -> list[Edit]:
    steps = [step for change in (*kept.undo, *kept.redo) for step in change]
    found = [*kept.edits, *(step.before for step in steps), *(step.after for step in steps)]
    return [one for one in found if one is not None]


def _has_place(one: Edit) -> bool:
    return isinstance(one, PinEdit | DirectionEdit) or (isinstance(one, OffsetEdit) and any(one.move_m))


def _mean(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of rigid transforms, shape (n, 4, 4): of the places, and the rotation nearest to the mean."""
    out = T.mean(axis=0)
    u, _, vt = np.linalg.svd(out[:3, :3])
    out[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return out


def _moved_list(kept: TakeEdits, T: NDArray[np.float64], calibration: int) -> TakeEdits:
    def changes(of: tuple[tuple[EditStep, ...], ...]) -> tuple[tuple[EditStep, ...], ...]:
        return tuple(
            tuple(EditStep(s.place, s.before and _moved(s.before, T), s.after and _moved(s.after, T)) for s in change)
            for change in of
        )  # fmt: skip

    return msgspec.structs.replace(
        kept,
        calibration=calibration,
        edits=tuple(_moved(one, T) for one in kept.edits),
        undo=changes(kept.undo),
        redo=changes(kept.redo),
    )


def _moved(one: Edit, T: NDArray[np.float64]) -> Edit:
    if isinstance(one, PinEdit):
        return msgspec.structs.replace(one, place_m=_tuple(T[:3, :3] @ one.place_m + T[:3, 3]))
    if isinstance(one, DirectionEdit):
        return msgspec.structs.replace(one, direction=_tuple(T[:3, :3] @ one.direction))
    if isinstance(one, OffsetEdit):
        return msgspec.structs.replace(one, move_m=_tuple(T[:3, :3] @ one.move_m))
    return one


def _tuple(of: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = of.tolist()
    return x, y, z
