"""The edits of a take within its solve: which of them count for whom, and what became of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from studio.engine.base.sentences import Said
from studio.engine.edits.edit import Edit
from studio.engine.edits.honoured import outcomes, refused
from studio.engine.edits.timing import of_performer
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.solves import Solved

_Frames = Mapping[str, Sequence[CameraFrame]]


@dataclass
class AskedEdits:
    """What an operator asks of a solve.

    Attributes:
        edits: those that are on.
    """

    edits: tuple[Edit, ...] = ()
    _lines: dict[str, Said] = field(default_factory=dict)

    def of(self, performer: str, frames: _Frames, calibration: Calibration) -> tuple[Edit, ...]:
        """Return a performer's edits that can be honoured, as far as is known before the solve."""
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
        """Return the solve with what is done after it, and its figures with what became of the edits."""
        if not self.edits:
            return dict(solved), metrics
        strangers = [edit for edit in self.edits if edit.performer not in solved]
        lines = self._lines | refused(
            strangers, cameras=list(frames), performers=list(solved), span_s=(-1e18, 1e18)
        )
        poses = {name: one.poses for name, one in solved.items()}
        return dict(solved), {**metrics, "edits": outcomes(self.edits, lines, poses)}


def _span_s(frames: _Frames, calibration: Calibration) -> tuple[float, float]:
    """Stage time of the first and the last frame [s]."""
    times = [
        calibration.cameras[name].clock.stage_ns(mine[end].device_time_ns) * 1e-9
        for name, mine in frames.items()
        if name in calibration.cameras and len(mine)
        for end in (0, -1)
    ]
    return (min(times), max(times)) if times else (0.0, 0.0)
