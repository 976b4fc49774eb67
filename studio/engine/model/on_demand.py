"""Lists of frames that are made when requested, because an hour of three cameras does not fit in memory."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import overload

from studio.engine.model.frames import CameraFrame


class FramesOnDemand(Sequence[CameraFrame]):
    """Frames that are made by `at`, which takes indices from 0."""

    @overload
    def __getitem__(self, index: int) -> CameraFrame: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[CameraFrame]: ...
    def __getitem__(self, index: int | slice) -> CameraFrame | Sequence[CameraFrame]:
        places = range(len(self))[index]
        return [self.at(i) for i in places] if isinstance(places, range) else self.at(places)

    @abstractmethod
    def at(self, index: int) -> CameraFrame:
        """Return one frame."""
