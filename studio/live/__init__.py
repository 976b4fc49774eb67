"""The live stage: cameras join, their frames go through the pipeline at once, and are recorded.

`stage` is the way in for the server, safe from any thread. `engine` is the thread that owns the pipeline, fed
by `inbox`; `roster`, `camera` and `clocks` know the cameras and their clocks, `log` performs and words every
decision, `recorder` and `recording` make a take, `calibrator` and `calibrations` calibrate, `status` tells.
"""

from studio.live.camera import CameraRefused
from studio.live.stage import LiveStage

__all__ = ["CameraRefused", "LiveStage"]
