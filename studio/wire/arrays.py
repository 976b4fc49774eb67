"""Arrays as messages, and messages as arrays: skeletons, landmarks, depth images, previews."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import zstandard
from msgspec.structs import replace
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.wire.messages import (
    PREVIEW_PIXELS,
    Body,
    DepthImage,
    HandState,
    Intrinsics,
    Landmarks,
    Preview,
    SkeletonFrame,
)


def skeleton_frame(
    sequence: int,
    device_time_ns: int,
    positions: NDArray[np.floating],
    confidence: NDArray[np.floating],
    hands: list[HandState] | None = None,
    head_wxyz: tuple[float, float, float, float] | None = None,
    body: int = 0,
) -> SkeletonFrame:
    """Return a frame of device joints [m], shape (joint_count, 3), with confidence, shape (joint_count,).

    `body`: the device's own number of the body.
    """
    return SkeletonFrame(
        sequence=sequence,
        device_time_ns=device_time_ns,
        positions=_floats(positions),
        confidence=_floats(confidence),
        hands=hands or [],
        head_wxyz=head_wxyz,
        body=body,
    )


def with_others(frame: SkeletonFrame, others: Sequence[SkeletonFrame]) -> SkeletonFrame:
    """Return a frame of one body with further bodies, each given as its own frame."""
    return replace(
        frame,
        others=[
            Body(one.body, one.positions, one.confidence, one.hands, one.head_wxyz, one.landmarks)
            for one in others
        ],
    )


def each_body(frame: SkeletonFrame) -> list[SkeletonFrame]:
    """Return every body of a frame as its own frame; of equal numbers only the first."""
    found = {frame.body: replace(frame, others=[]) if frame.others else frame}
    for one in frame.others:
        alone = SkeletonFrame(
            frame.sequence, frame.device_time_ns, one.positions, one.confidence, one.hands, one.head_wxyz,
            one.landmarks, one.number,
        )  # fmt: skip
        found.setdefault(one.number, alone)
    return list(found.values())


def depth_image(sequence: int, device_time_ns: int, depth_mm: NDArray[np.uint16]) -> DepthImage:
    """Return a depth image [mm], uint16, shape (height, width), as a message."""
    return DepthImage(sequence=sequence, device_time_ns=device_time_ns, data=_packed(depth_mm))


def _packed(depth_mm: NDArray[np.uint16]) -> bytes:
    return zstandard.ZstdCompressor(level=1).compress(np.ascontiguousarray(depth_mm, dtype="<u2").tobytes())


def preview_image(device_time_ns: int, depth_mm: NDArray[np.uint16]) -> Preview:
    """Return a depth image [mm], uint16, shape (height, width), as a preview of 80 pixels at most each way."""
    step = -(-max(depth_mm.shape) * 2 // PREVIEW_PIXELS)
    small = depth_mm[::step, ::step]
    return Preview(device_time_ns, small.shape[1], small.shape[0], step, _packed(small))


def depth_array(image: DepthImage, intrinsics: Intrinsics) -> NDArray[np.uint16]:
    """Return a message's depth [mm], uint16, shape (height, width).

    Raises:
        FormatError: the data is damaged, or its size is not that of `intrinsics`.
    """
    return _unpacked(image.data, intrinsics.width, intrinsics.height, f"depth image {image.sequence}")


def preview_array(preview: Preview) -> NDArray[np.uint16]:
    """Return a preview's depth [mm], uint16, shape (height, width).

    Raises:
        FormatError: the data is damaged, or its size is not that of the message.
    """
    return _unpacked(preview.data, preview.width, preview.height, "a preview")


def _unpacked(data: bytes, width: int, height: int, what: str) -> NDArray[np.uint16]:
    size = 2 * width * height
    try:
        packed = zstandard.frame_content_size(data)
        rows = b"" if packed > size else zstandard.ZstdDecompressor().decompress(data, size)
    except zstandard.ZstdError as error:
        raise FormatError(
            "protocol.not_unpacked", "{what} cannot be unpacked: {error}", what=what, error=error
        ) from error
    if len(rows) != size:
        raise FormatError(
            "protocol.image_size",
            "{what} has {n} bytes; {width} x {height} pixels need {size}",
            what=what,
            n=max(packed, len(rows)),
            width=width,
            height=height,
            size=size,
        )
    return np.frombuffer(rows, dtype="<u2").reshape(height, width)


HAND_LANDMARKS = 21
"""Number of landmarks of a hand: the wrist, then four of each finger from the thumb on, root to tip."""

_OUTSIDE = 2.0
"""Maximum coordinate of a landmark, as a multiple of its picture's size; beyond it is an error, and unseen."""

_WIDEST_M = 3.0
"""Maximum coordinate of a guessed joint about the middle of the hips [m]; beyond it is an error, and unseen."""


@dataclass(frozen=True)
class LandmarkArrays:
    """A performer's landmarks in a picture; NaN = unseen.

    Attributes:
        width, height: size of the picture [pixels].
        pixels: column and row, shape (joint_count, 2). The centre of the first pixel is (0, 0).
        world_m: about the middle of the hips, in the picture's axes, shape (joint_count, 3); None = unknown.
        left_hand, right_hand: pixels of a hand's landmarks, shape (21, 2); None = not seen.
    """

    width: int
    height: int
    pixels: NDArray[np.float64]
    world_m: NDArray[np.float64] | None = None
    left_hand: NDArray[np.float64] | None = None
    right_hand: NDArray[np.float64] | None = None


def landmark_frame(
    sequence: int, device_time_ns: int, seen: LandmarkArrays, visibility: NDArray[np.floating]
) -> SkeletonFrame:
    """Return a frame of a camera without depth; `visibility` of the landmarks, shape (joint_count,), is 0..1."""
    optional = (seen.world_m, seen.left_hand, seen.right_hand)
    return SkeletonFrame(
        sequence=sequence,
        device_time_ns=device_time_ns,
        positions=b"",
        confidence=_floats(visibility),
        landmarks=Landmarks(
            seen.width,
            seen.height,
            _floats(seen.pixels),
            *(b"" if values is None else _floats(values) for values in optional),
        ),
    )


def landmark_arrays(frame: SkeletonFrame, joint_set: str) -> LandmarkArrays | None:
    """Return a frame's landmarks, None if it has none. Landmarks far outside the picture count as unseen.

    Raises:
        FormatError: other numbers of landmarks than the joint set or a hand has.
    """
    landmarks = frame.landmarks
    if landmarks is None:
        return None
    count = len(JOINT_SETS[joint_set])
    size = np.array([landmarks.width, landmarks.height], np.float64)
    world_m = None
    if landmarks.world:
        world_m = _numbers(frame, landmarks.world, count, 3)
        world_m[~(np.abs(world_m) <= _WIDEST_M).all(axis=1)] = np.nan
    return LandmarkArrays(
        landmarks.width,
        landmarks.height,
        _within(_numbers(frame, landmarks.pixels, count, 2), size),
        world_m,
        left_hand=_hand(frame, landmarks.left_hand, size),
        right_hand=_hand(frame, landmarks.right_hand, size),
    )


def _hand(frame: SkeletonFrame, data: bytes, size: NDArray[np.float64]) -> NDArray[np.float64] | None:
    return _within(_numbers(frame, data, HAND_LANDMARKS, 2), size) if data else None


def _within(pixels: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
    far = ~np.all(np.abs(pixels) <= _OUTSIDE * size, axis=1)  # not a number is far
    pixels[far] = np.nan
    return pixels


def _floats(values: NDArray[np.floating]) -> bytes:
    return np.ascontiguousarray(values, dtype="<f4").tobytes()


def _numbers(frame: SkeletonFrame, data: bytes, count: int, each: int) -> NDArray[np.float64]:
    """Return numbers of a frame, shape (count, each)."""
    if len(data) != 4 * count * each:
        raise FormatError(
            "protocol.landmarks_size",
            "frame {number} has {n} bytes where {count} landmarks of {each} numbers need {needed}",
            number=frame.sequence,
            n=len(data),
            count=count,
            each=each,
            needed=4 * count * each,
        )
    with np.errstate(invalid="ignore"):  # for any kind of NaN
        return np.frombuffer(data, dtype="<f4").reshape(count, each).astype(np.float64)


def joint_arrays(frame: SkeletonFrame, joint_set: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a frame's device joints: positions, shape (joint_count, 3), and confidence, shape (joint_count,).

    The positions of a frame of landmarks are NaN.

    Raises:
        FormatError: the frame has another number of joints than its joint set, or a confidence out of 0..1.
    """
    count = len(JOINT_SETS[joint_set])
    depthless = frame.landmarks is not None and not frame.positions
    if (len(frame.positions) != 12 * count and not depthless) or len(frame.confidence) != 4 * count:
        raise FormatError(
            "protocol.frame_size",
            "frame {number} has {n} bytes of positions and {confidence} of confidence; joint set "
            "{joint_set!r} needs {needed} and {least}",
            number=frame.sequence,
            n=len(frame.positions),
            confidence=len(frame.confidence),
            joint_set=joint_set,
            needed=12 * count,
            least=4 * count,
        )
    with np.errstate(invalid="ignore"):  # for any kind of NaN
        given = np.frombuffer(frame.positions, dtype="<f4") if frame.positions else np.full(3 * count, np.nan)
        positions = given.reshape(count, 3).astype(np.float64)
        confidence = np.frombuffer(frame.confidence, dtype="<f4").astype(np.float64)
    if not ((confidence >= 0) & (confidence <= 1)).all():
        raise FormatError(
            "protocol.confidence", "frame {number}: confidence must be within 0..1", number=frame.sequence
        )
    return positions, confidence
