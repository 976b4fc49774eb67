"""Frames of a take outside memory, because an hour of three cameras has 324,000."""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.records import BLOCK, Records
from studio.engine.model.frames import CameraFrame, HandSeen, PictureJoints
from studio.engine.model.human.face import LANDMARKS as FACE_LANDMARKS
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.on_demand import FramesOnDemand

_DTYPE = np.dtype(
    [
        ("positions", "f8", (JOINT_COUNT, 3)),
        ("confidence", "f8", (JOINT_COUNT,)),
        ("head_wxyz", "f8", (4,)),
        ("sequence", "i8"),
        ("device_time_ns", "i8"),
        ("camera", "i2"),
        ("has_head", "?"),
        ("picture", "i8"),
        ("body", "i4"),
        ("others", "i2"),
    ],
    align=True,
)
_PICTURE_DTYPE = np.dtype(
    [
        ("pixels", "f8", (JOINT_COUNT, 2)),
        ("world_m", "f8", (JOINT_COUNT, 3)),
        ("width", "i4"),
        ("height", "i4"),
        ("hands", "i8"),
        ("face", "f8", (FACE_LANDMARKS, 2)),
    ],
    align=True,
)
_HANDS_DTYPE = np.dtype(("f8", (2, 21, 2)))
_BLOCKS = 8
"""Number of cached blocks of records; frames that are adjacent in a recording are needed together."""


class KeptFrames:
    """Frames of any cameras in the order of their addition; `frames` returns them once all are added."""

    def __init__(self) -> None:
        """Make an empty list."""
        self._several = False
        self._records, self._pictures = Records(_DTYPE), Records(_PICTURE_DTYPE)
        self._hand_pixels = Records(_HANDS_DTYPE)
        self._cameras: dict[str, int] = {}
        self._kinds: dict[tuple[str, str], int] = {}  # kinds of hand states: side and method
        self._hands_end, self._hand_kinds, self._hand_open = array("q"), array("h"), array("d")
        self._block = lru_cache(_BLOCKS)(partial(_read_block, self._records))
        self._picture_block = lru_cache(_BLOCKS)(partial(_read_block, self._pictures))
        self._hands_block = lru_cache(_BLOCKS)(partial(_read_block, self._hand_pixels))

    def __len__(self) -> int:
        return len(self._records)

    @property
    def several(self) -> bool:
        """Whether a frame has more than one body."""
        return self._several

    def add(self, frame: CameraFrame) -> int:
        """Add a frame; return its index.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        place = len(self._records)
        for one in (frame, *frame.others):
            self._add(one)
        self._several = self._several or bool(frame.others)
        return place

    def _add(self, frame: CameraFrame) -> None:
        head, picture = frame.head_wxyz, frame.picture
        self._records.add((
            frame.positions, frame.confidence, (0.0,) * 4 if head is None else head, frame.sequence,
            frame.device_time_ns, self._cameras.setdefault(frame.camera, len(self._cameras)), head is not None,
            -1 if picture is None else len(self._pictures), frame.body, len(frame.others),
        ))  # fmt: skip
        if picture is not None:
            place = -1 if picture.hands is None else len(self._hand_pixels)
            face = np.nan if picture.face is None else picture.face
            self._pictures.add((picture.pixels, picture.world_m, picture.width, picture.height, place, face))
            if picture.hands is not None:
                self._hand_pixels.add(picture.hands)
        for hand in frame.hands:
            self._hand_kinds.append(self._kinds.setdefault((hand.side, hand.method), len(self._kinds)))
            self._hand_open.append(hand.open_probability)
        self._hands_end.append(len(self._hand_kinds))

    def frames(self, places: NDArray[np.int64], times_ns: NDArray[np.int64]) -> "Sequence[CameraFrame]":
        """Return frames by their index of addition, each with a new device time [ns]."""
        return _Chosen(self, places, times_ns)

    def frame(self, place: int, time_ns: int) -> CameraFrame:
        """Return one frame, with another device time [ns]."""
        block, row = divmod(place, BLOCK)
        record = self._block(block)[row]
        w, x, y, z = record["head_wxyz"].tolist()
        return CameraFrame(
            camera=list(self._cameras)[record["camera"]],
            sequence=int(record["sequence"]),
            device_time_ns=time_ns,
            positions=record["positions"],
            confidence=record["confidence"],
            hands=self._hands(place),
            head_wxyz=(w, x, y, z) if record["has_head"] else None,
            picture=self._picture(int(record["picture"])),
            body=int(record["body"]),
            others=tuple(self.frame(place + 1 + k, time_ns) for k in range(int(record["others"]))),
        )

    def _picture(self, place: int) -> PictureJoints | None:
        if place < 0:
            return None
        block, row = divmod(place, BLOCK)
        record = self._picture_block(block)[row]
        size, place = (int(record["width"]), int(record["height"])), int(record["hands"])
        hands = None
        if place >= 0:
            block, row = divmod(place, BLOCK)
            hands = self._hands_block(block)[row]
        face = None if np.isnan(record["face"]).all() else record["face"]
        return PictureJoints(*size, record["pixels"], record["world_m"], hands, face)

    def _hands(self, place: int) -> tuple[HandSeen, ...]:
        begin, end = self._hands_end[place - 1] if place else 0, self._hands_end[place]
        if begin == end:
            return ()
        kinds = list(self._kinds)
        return tuple(HandSeen(*kinds[self._hand_kinds[i]], self._hand_open[i]) for i in range(begin, end))


def _read_block(records: Records, block: int) -> NDArray[np.void]:
    return records.read(block * BLOCK, (block + 1) * BLOCK)


class _Chosen(FramesOnDemand):
    """Some of the kept frames, in any order."""

    def __init__(self, kept: KeptFrames, places: NDArray[np.int64], times_ns: NDArray[np.int64]) -> None:
        self._kept, self._places, self._times_ns = kept, places, times_ns

    def __len__(self) -> int:
        return len(self._places)

    @property
    def several(self) -> bool:
        """Whether any of the kept frames has more than one body."""
        return self._kept.several

    def at(self, index: int) -> CameraFrame:
        return self._kept.frame(int(self._places[index]), int(self._times_ns[index]))

    def __iter__(self) -> Iterator[CameraFrame]:
        for place, time_ns in zip(self._places.tolist(), self._times_ns.tolist(), strict=True):
            yield self._kept.frame(place, time_ns)


def several_bodies(frames: Mapping[str, Sequence[CameraFrame]]) -> bool:
    """Whether a frame has more than one body; reads no frame of `KeptFrames.frames`."""
    return any(
        mine.several if isinstance(mine, _Chosen) else any(frame.others for frame in mine)
        for mine in frames.values()
    )


class Joined(FramesOnDemand):
    """The frames of several cameras one after the other, as one sequence."""

    def __init__(self, parts: Sequence[Sequence[CameraFrame]]) -> None:
        """Use the parts without a copy."""
        self._parts = parts
        self._ends = np.cumsum([len(part) for part in parts], dtype=np.int64)

    def __len__(self) -> int:
        return int(self._ends[-1]) if len(self._ends) else 0

    def at(self, index: int) -> CameraFrame:
        part = int(np.searchsorted(self._ends, index, side="right"))
        return self._parts[part][index - int(self._ends[part]) + len(self._parts[part])]

    def __iter__(self) -> Iterator[CameraFrame]:
        for part in self._parts:
            yield from part
