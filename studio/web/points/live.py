"""The newest depth images of the live stage: previews, and whole images while a take with depth is recorded."""

from collections.abc import Callable

from studio.engine.model.calibration import Calibration
from studio.live.cameras.newest_depth import NewestDepth
from studio.web.points.seen import NO_IMAGE, NO_PLACE, DepthSeen

FRESH_S = 1.0
"""Maximum age of an image that counts as current [s]."""


class LiveDepth:
    """See `DepthImages`; the newest images, whatever the stage time.

    Args:
        newest: the images.
        calibration: returns the calibration in use; clock: the server's [s].
    """

    def __init__(
        self, newest: NewestDepth, calibration: Callable[[], Calibration | None], clock: Callable[[], float]
    ) -> None:
        self._newest = newest
        self._calibration = calibration
        self._clock = clock

    @property
    def cameras(self) -> tuple[str, ...]:
        return self._newest.names()

    def at(self, name: str, time_s: float) -> DepthSeen | str:
        del time_s
        image, calibration = self._newest.get(name), self._calibration()
        if image is None or self._clock() - image.arrival_ns * 1e-9 > FRESH_S:
            return NO_IMAGE
        if calibration is None or name not in calibration.cameras:
            return NO_PLACE
        return DepthSeen(
            image.arrival_ns, image.camera, image.depth_mm, calibration.cameras[name].T_stage_camera
        )

    def close(self) -> None:
        """Do nothing: nothing is open."""
