"""The live stage: cameras join, and their frames go through the pipeline and into recordings.

`stage` is the server's interface and safe from any thread. `engine` is the thread that owns the pipeline, fed by
`inbox`. `recording_control` starts and stops takes. `cameras` holds the cameras and their clocks, `calibration` the
calibration in use, `performers` who is on stage, `recording` the take being recorded, `keeping` frames that arrive
late, and `status` the status.
"""

from studio.live.cameras.camera import CameraRefused
from studio.live.stage import LiveStage

__all__ = ["CameraRefused", "LiveStage"]
