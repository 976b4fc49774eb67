"""The performers of a solve, drawn together in one picture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.performers.colours import performer_colour
from studio.engine.model.poses import Poses
from studio.review.render.figure import PosedFigure, Projection

_HIPS = OUTPUT_INDEX["Hips"]
_NEAR_FRAMES = 1.5
_AROUND_M = 1.5
"""Width added around the hips of several performers."""


@dataclass(frozen=True)
class DrawnPerformers:
    """Performers with their bodies; several get the colours of their numbers."""

    poses: tuple[Poses, ...]
    mannequins: tuple[Mannequin, ...]

    @classmethod
    def of(cls, name: str, poses: Sequence[Poses], body: str = BODIES[0]) -> "DrawnPerformers":
        """Return the performers of the solve `name`.

        Raises:
            FormatError: no frames, another skeleton than the output skeleton, or bones that no body fits.
        """
        for one in poses:
            if one.joint_names != OUTPUT_JOINTS:
                raise FormatError(
                    "picture.other_joints",
                    "solve {name!r} has other joints than the output skeleton; solve the take again",
                    name=name,
                )
            if one.frame_count == 0:
                raise FormatError(
                    "picture.no_frames", "solve {name!r} has no frames; nothing to draw", name=name
                )
        return cls(tuple(poses), tuple(Mannequin.of(one, body) for one in poses))

    def at(self, time_s: float) -> list[PosedFigure]:
        """Return the figures at a stage time [s], from the nearest frames. Absent performers are left out, unless all
        are absent."""
        found: list[PosedFigure] = []
        nearest = [int(np.argmin(np.abs(one.time_s - time_s))) for one in self.poses]
        away = [
            abs(float(one.time_s[frame]) - time_s) * one.frames_per_second > _NEAR_FRAMES
            for one, frame in zip(self.poses, nearest, strict=True)
        ]
        for number, (one, mannequin, frame) in enumerate(
            zip(self.poses, self.mannequins, nearest, strict=True), 1
        ):
            if away[number - 1] and not all(away):
                continue
            tint = performer_colour(number) if len(self.poses) > 1 else None
            found.append(PosedFigure(mannequin, one.positions_m[frame], one.rotations_wxyz[frame], tint))
        return found

    def begins_s(self) -> float:
        """Return the stage time of the first frame of any performer [s]."""
        return min(one.begins_s for one in self.poses)


def looking_at(figures: Sequence[PosedFigure], view: Projection) -> Projection:
    """Return a view centred on the figures; several figures are scaled to fit into the picture."""
    hips = np.array([one.positions_m[_HIPS] for one in figures])
    if len(hips) == 1:
        return replace(view, target_m=(float(hips[0, 0]), float(hips[0, 1]), 0.0))
    across = hips @ view.axes()[0]
    middle = (hips.min(axis=0) + hips.max(axis=0)) / 2.0
    wide_m = float(np.ptp(across)) + _AROUND_M
    scale = min(view.pixels_per_m, view.width / wide_m)
    return replace(view, target_m=(float(middle[0]), float(middle[1]), 0.0), pixels_per_m=scale)
