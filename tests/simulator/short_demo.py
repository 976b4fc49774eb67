"""The beginning of the embedded performer's motion, for takes that may be short."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.simulator import simulate
from studio.simulator.motion import stage_motion


@contextmanager
def short_demo(seconds: float) -> Iterator[None]:
    """Make simulated performers stop after this many seconds; the calibration part before them does not change."""

    def cut(path: str | Path, **options: object) -> tuple[CanonicalMotion, float | None]:
        motion, calibration_s = stage_motion(path, **options)
        count = round(((calibration_s or 0.0) + seconds) / motion.frame_s)
        kept = motion.positions_m[:count], motion.hands_open[:count]
        return replace(motion, positions_m=kept[0], hands_open=kept[1]), calibration_s

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulate, "stage_motion", cut)
        yield
