"""The edits of a take within its solve: which of them count for whom, and the outcome of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.layers import missed_deg, with_layers
from studio.engine.animation.splicing.retime import retimed
from studio.engine.base.sentences import Said, say
from studio.engine.edits.edit import ContactEdit, DirectionEdit, Edit, RetimeEdit, TrimEdit
from studio.engine.edits.honoured import direction_outcome, outcomes, refused, touch_outcome
from studio.engine.edits.time_map import TimeMap
from studio.engine.edits.timing import of_kind, of_performer
from studio.engine.edits.touches import is_touch, is_touch_of_other
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.poses import Poses
from studio.engine.model.solve_metrics import EditJson, SolveMetrics
from studio.engine.solve.touching import missed_touch_m
from studio.engine.whole_take.mending.told import PinFinding
from studio.take.folder.solves import Solved

USUAL_HEIGHT_M = 1.75

_Frames = Mapping[str, Sequence[CameraFrame]]


@dataclass
class AskedEdits:
    """What an operator asks of a solve.

    Attributes:
        edits: those that are on.
        mended: errors that pins revealed; solves append to it.
    """

    edits: tuple[Edit, ...] = ()
    mended: list[PinFinding] = field(default_factory=list)
    _lines: dict[str, Said] = field(default_factory=dict)
    _heights_m: dict[str, float] = field(default_factory=dict)

    def of(self, performer: str, frames: _Frames, calibration: Calibration) -> tuple[Edit, ...]:
        """Return a performer's edits that can be honoured, as far as is known before the solve."""
        known = calibration.performer
        self._heights_m[performer] = USUAL_HEIGHT_M if known is None else known.height_m
        mine = of_performer(self.edits, performer)
        if not mine:
            return ()
        lines = refused(
            mine,
            cameras=list(calibration.cameras),
            performers=[performer],
            span_s=_span_s(frames, calibration),
        )
        self._lines |= lines
        return tuple(edit for edit in mine if edit.id not in lines)

    def applied(
        self, solved: Mapping[str, Solved], frames: _Frames, metrics: SolveMetrics
    ) -> tuple[dict[str, Solved], SolveMetrics]:
        """Return the solve with the edits that are applied after it, and its figures with the edits' outcomes."""
        if not self.edits:
            return dict(solved), metrics
        strangers = [edit for edit in self.edits if edit.performer not in solved]
        lines = self._lines | refused(
            strangers, cameras=list(frames), performers=list(solved), span_s=(-1e18, 1e18)
        )
        for edit in of_kind(self.edits, ContactEdit):
            if is_touch_of_other(edit) and edit.other not in solved:
                line = say("evidence.no_performer", "the take has no {performer}", performer=edit.other or "")
                lines.setdefault(edit.id, line)
        kept = [edit for edit in self.edits if edit.id not in lines]
        layered = {
            name: replace(one, poses=with_layers(one.poses, of_performer(kept, name)))
            for name, one in solved.items()
        }
        before = {name: one.poses for name, one in solved.items()}  # an offset moves a limb off its pin
        poses = {name: one.poses for name, one in layered.items()}
        told = outcomes(self.edits, lines, before) | _directions(kept, poses) | self._contacts(kept, before)
        for found in self.mended:
            for pin in found.pins:
                told[pin].setdefault("mended", []).append(found.to_json())
        retimes = of_kind(kept, RetimeEdit)
        metrics = {**metrics, "edits": told}
        if retimes:
            metrics["retimed"] = [
                {"start_s": one.start_s, "end_s": one.end_s, "ease_s": one.ease_s, "factor": one.factor}
                for one in retimes
            ]
        times = TimeMap(retimes)
        return {name: _retimed(_trimmed(one, kept), times) for name, one in layered.items()}, metrics

    def _contacts(self, edits: Sequence[Edit], poses: Mapping[str, Poses]) -> dict[str, EditJson]:
        told = {}
        for edit in of_kind(edits, ContactEdit):
            if is_touch(edit) or is_touch_of_other(edit):
                mine, theirs = edit.performer, edit.other or edit.performer
                missed_m = missed_touch_m(
                    edit, poses[mine], self._heights_m[mine], (poses[theirs], self._heights_m[theirs])
                )
                told[edit.id] = touch_outcome(edit, missed_m)
        return told


def _directions(edits: Sequence[Edit], poses: Mapping[str, Poses]) -> dict[str, EditJson]:
    return {
        edit.id: direction_outcome(edit, missed_deg(edit, poses[edit.performer]))
        for edit in of_kind(edits, DirectionEdit)
    }


def _trimmed(solved: Solved, edits: Sequence[Edit]) -> Solved:
    """Return the part of a solve that trims leave; trims that leave nothing are ignored."""
    trims = of_kind(edits, TrimEdit)
    if not trims:
        return solved
    begin, end = max(trim.start_s for trim in trims), min(trim.end_s for trim in trims)
    first, last = np.searchsorted(solved.poses.time_s, [begin - 1e-6, end + 1e-6])
    if last - first < 2:
        return solved
    rows = slice(int(first), int(last))
    trace = None if solved.trace is None else solved.trace.part(rows)
    return replace(solved, poses=frames_of(solved.poses, rows), trace=trace)


def _retimed(solved: Solved, times: TimeMap) -> Solved:
    """Return a solve with faster or slower parts; the trace of each frame is that of the nearest original one."""
    if not times:
        return solved
    poses = retimed(solved.poses, times)
    if solved.trace is None:
        return replace(solved, poses=poses)
    own_s = solved.poses.time_s
    rows = np.searchsorted(0.5 * (own_s[1:] + own_s[:-1]), times.stage_s(poses.time_s))
    trace = replace(solved.trace.part(rows), time_ns=np.rint(1e9 * poses.time_s).astype(np.int64))
    return replace(solved, poses=poses, trace=trace)


def _span_s(frames: _Frames, calibration: Calibration) -> tuple[float, float]:
    """Stage time of the first and the last frame [s]."""
    times = [
        calibration.cameras[name].clock.stage_ns(mine[end].device_time_ns) * 1e-9
        for name, mine in frames.items()
        if name in calibration.cameras and len(mine)
        for end in (0, -1)
    ]
    return (min(times), max(times)) if times else (0.0, 0.0)
