"""The stretches of a take that edits change, so that only these are solved again.

The take is solved without edits. Around the changes it is solved again with them, from the state that the solve had
there. Everything else stays as it is: noise, floor and accelerations are estimated over the whole take without edits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.base.geometry import matrices
from studio.engine.base.quaternions import blended
from studio.engine.edits.edit import Edit, ExchangeEdit, LeaveOutEdit
from studio.engine.edits.frames import Frames, changed_spans_s, stage_s
from studio.engine.edits.pins import Pins
from studio.engine.edits.timing import eased
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.human.skeleton import Skeleton, forward_positions

AROUND_S = 0.5
"""Time before and after a change within which the take may move [s]."""

LEAD_S = 0.1
"""A filter begins to differ this long before a change [s], because of its look-ahead."""

MOST = 0.5
"""Largest share of a take in which cameras or joints are doubted; beyond it, the edits are about the whole take."""

WHOLE = 0.999
"""Largest share of a take that may move because of edits; beyond it, nothing stays as it is."""

Span = tuple[float, float]


@dataclass(frozen=True)
class Edited:
    """Changes of a performer's take by edits.

    Attributes:
        pins: known places from edits, and those known without edits.
        spans_s: begin and end of each changed stretch, in order, apart from one another [s].
        frames: the frames with edits: as many as without, in the same order.
    """

    pins: Pins
    spans_s: list[Span]
    frames: Sequence[CameraFrame] = ()

    def span_at(self, time_s: float) -> Span | None:
        """Return the changed stretch for which the solve needs a frame at a time; None = none."""
        return next((one for one in self.spans_s if one[0] - LEAD_S <= time_s <= one[1] + AROUND_S), None)

    def share(self, time_s: NDArray[np.float64], also: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the share of the solve with edits at times [s], shape (frame_count,): 1 where they change the take,
        0 where it does not move. `also`: further frames that they change."""
        more = [(time_s[first], time_s[stop - 1]) for first, stop in runs(also)]
        away = [
            np.maximum(np.maximum(begin - time_s, time_s - end), 0.0) for begin, end in [*self.spans_s, *more]
        ]
        return eased((AROUND_S - np.min(away, axis=0)) / (AROUND_S - LEAD_S))


def edited_of(
    frames: Frames,
    edited: Frames,
    edits: Sequence[Edit],
    pins: Pins,
    calibration: Calibration,
    start_s: float | None = None,
) -> Edited | None:
    """Return the changes of a performer's take by edits; None where they change nothing, or so much that the whole
    take has to be solved with them.

    Args:
        frames: by camera, in order of time.
        edited: the same frames after edits.
        edits: of the performer.
        pins: as `Edited` has them.
        calibration: has the cameras' clocks.
        start_s: stage time before which nothing counts [s].
    """
    spans_s = _apart([*changed_spans_s(frames, edited, calibration), *pins.spans_s])
    ends = [
        stage_s(calibration, name)(mine[end])
        for name, mine in frames.items()
        if name in calibration.cameras and len(mine)
        for end in (0, -1)
    ]
    if not spans_s or not ends:
        return None
    begin_s, end_s = max(min(ends), -np.inf if start_s is None else start_s), max(ends)
    asked_s = [(edit.start_s, edit.end_s) for edit in edits if isinstance(edit, ExchangeEdit | LeaveOutEdit)]
    moved_s = [(begin - AROUND_S, end + AROUND_S) for begin, end in spans_s]
    if _share(asked_s, begin_s, end_s) > MOST or _share(moved_s, begin_s, end_s) > WHOLE:
        return None
    return Edited(pins, spans_s)


def _share(spans_s: Sequence[Span], begin_s: float, end_s: float) -> float:
    """Share of the time from `begin_s` to `end_s` that lies in spans [s]."""
    covered_s, last_s = 0.0, begin_s
    for begin, end in sorted(spans_s):
        covered_s += max(min(end, end_s) - max(begin, last_s), 0.0)
        last_s = max(last_s, end)
    return covered_s / max(end_s - begin_s, 1e-9)


def _apart(spans_s: Sequence[Span]) -> list[Span]:
    """Return spans [s] in order; those so near that the take also moves between them are joined."""
    out: list[Span] = []
    for begin, end in sorted(spans_s):
        if out and begin - out[-1][1] <= AROUND_S + LEAD_S:
            out[-1] = out[-1][0], max(out[-1][1], end)
        else:
            out.append((begin, end))
    return out


def going_back(own: StepResult, edited: StepResult, span: Span, skeleton: Skeleton) -> StepResult:
    """Return a step of a solve with edits; after the changed stretch, it is blended to the one without.

    Args:
        own: the step without edits.
        edited: the same step with them.
        span: the stretch [s].
        skeleton: of the performer.
    """
    after_s = own.frame_set.stage_time_ns * 1e-9 - span[1]
    share = float(eased(np.array(1.0 - after_s / AROUND_S)))
    if share == 1.0:
        return edited
    rotations = blended(own.rotations_wxyz, edited.rotations_wxyz, share)
    positions = (1.0 - share) * own.positions_m + share * edited.positions_m
    if own.configuration is not None:  # without a solved pose, joints are where they are measured
        positions = forward_positions(skeleton, positions[0], matrices(rotations))
    return replace(
        edited,
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=(1.0 - share) * own.confidence + share * edited.confidence,
        uncertainty_mm=(1.0 - share) * own.uncertainty_mm + share * edited.uncertainty_mm,
    )
