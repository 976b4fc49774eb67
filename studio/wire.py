"""The wire protocol between camera clients and the server (version 1), and the messages kept in `raw.mcap`.

A camera client opens a WebSocket at `/api/v1/link` and sends `Hello`; the server answers `Welcome` or
`Refused` and closes. Then, in any order: `ClockRequest` -> `ClockReply` (the exchange that gives offset and
drift), `SkeletonFrame`, `Status` from the client, `Recording` and `Ack` from the server. While a take is recorded
the client keeps its frames (`Kept`) until an `Ack` says that they are on the disk, and sends again what is missing
(`Late`). Every message is one binary WebSocket message: a MessagePack map with a `type` key. `decode` checks it
against its schema.

A `SkeletonFrame` is written to `raw.mcap` as the very bytes that arrived.
"""

import re
from typing import Annotated

import msgspec
import numpy as np
import zstandard
from msgspec import Meta
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS

PROTOCOL_VERSION = 1
MAX_MESSAGE_BYTES = 4 * 1024 * 1024
LINK_PATH = "/api/v1/link"

Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}\Z")]
TimeNs = Annotated[int, Meta(ge=0, le=2**62)]
PREVIEW_PIXELS = 160
"""Largest width and height of a preview; clients send half of it."""

ENDED = 2**62
"""`up_to` of the last `Ack` of a take."""

Sequence = Annotated[int, Meta(ge=0, le=2**62)]
Percent = Annotated[int, Meta(ge=0, le=100)]
Id = Annotated[str, Meta(max_length=64)]
Text = Annotated[str, Meta(max_length=500)]


class Intrinsics(msgspec.Struct, forbid_unknown_fields=True):
    """Pinhole intrinsics in pixels: focal lengths, principal point, image size.

    `distortion`: Brown-Conrady coefficients in OpenCV's order, empty or 4 to 8 of them.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: Annotated[int, Meta(ge=1, le=4096)]
    height: Annotated[int, Meta(ge=1, le=4096)]
    distortion: Annotated[tuple[float, ...], Meta(max_length=8)] = ()


class Hello(msgspec.Struct, tag="hello", forbid_unknown_fields=True):
    """First message of a camera client.

    `boot_id` changes with every start of the client, so that (name, boot_id, sequence) identifies a frame for good.
    `machine` is the same for all clients of one machine, `usb_controller` for all cameras on one of its controllers.
    """

    protocol_version: int
    name: Name
    device: Text
    joint_set: Text
    boot_id: Id
    frames_per_second: float = 30.0
    serial: Text = ""
    machine: Text = ""
    usb_controller: Text = ""
    intrinsics: Intrinsics | None = None
    token: Text = ""


class Welcome(msgspec.Struct, tag="welcome", forbid_unknown_fields=True):
    """The server's answer to `Hello`: the name in use, and whether this camera is the reference."""

    name: str
    reference: bool


class Refused(msgspec.Struct, tag="refused", forbid_unknown_fields=True):
    """The server refuses the camera; `reason` is for a person. The link is closed after it."""

    code: str
    reason: str


class ClockRequest(msgspec.Struct, tag="clock_request", forbid_unknown_fields=True):
    """Sent by the client; `client_send_ns` is its device clock."""

    client_send_ns: TimeNs


class ClockReply(msgspec.Struct, tag="clock_reply", forbid_unknown_fields=True):
    """The server's immediate answer: arrival of the request and departure of this reply, on the server's clock."""

    client_send_ns: TimeNs
    server_receive_ns: TimeNs
    server_send_ns: TimeNs


class ClockSample(msgspec.Struct, tag="clock_sample", forbid_unknown_fields=True):
    """One finished exchange, from which the server estimates the clock (as in NTP)."""

    client_send_ns: TimeNs
    server_receive_ns: TimeNs
    server_send_ns: TimeNs
    client_receive_ns: TimeNs


class HandState(msgspec.Struct, forbid_unknown_fields=True):
    """State of one hand from the client, by one method (`circles` or `shape`)."""

    side: Id  # "left" or "right"
    method: Id
    open_probability: Annotated[float, Meta(ge=0, le=1)]


class SkeletonFrame(msgspec.Struct, tag="skeleton", forbid_unknown_fields=True):
    """One skeleton in the camera frame [m], in the joint set named by `Hello`.

    `positions`: little-endian float32, joint_count * 3, NaN = unseen. `confidence`: float32, joint_count.
    `head_wxyz`: measured head orientation in the camera frame where known.
    """

    sequence: Sequence
    device_time_ns: TimeNs
    positions: bytes
    confidence: bytes
    hands: Annotated[list[HandState], Meta(max_length=8)] = []
    head_wxyz: tuple[float, float, float, float] | None = None


class DepthImage(msgspec.Struct, tag="depth", forbid_unknown_fields=True):
    """One depth image: `data` is zstd of little-endian uint16 rows, z in millimetres, 0 = no reading.

    The size is that of `Hello.intrinsics`. A client that sends both gives an image its skeleton's `sequence`.
    """

    sequence: Sequence
    device_time_ns: TimeNs
    data: bytes


class Preview(msgspec.Struct, tag="preview", forbid_unknown_fields=True):
    """A small depth image for people and for the floor: every `step`-th column and row of the whole one.

    `data` is as in `DepthImage`, of `width` x `height` pixels; the first pixel is the first of the whole image, and
    `step` is the distance of the pixels in it. Never stored; left out on a slow link.
    """

    device_time_ns: TimeNs
    width: Annotated[int, Meta(ge=1, le=PREVIEW_PIXELS)]
    height: Annotated[int, Meta(ge=1, le=PREVIEW_PIXELS)]
    step: Annotated[int, Meta(ge=1, le=4096)]
    data: bytes


class Status(msgspec.Struct, tag="status", forbid_unknown_fields=True):
    """Health of the client, about once a second.

    `message_code`, `message_values`: which message it is and what it was made of, if it has a code.
    `processor_percent`, `sending_percent`: load of its tracker or process, and share of time in which messages waited
    for the network, over the last three seconds.
    """

    frames_sent: int
    frames_dropped: int
    message: Text = ""
    frames_kept: int = 0
    frames_not_kept: int = 0
    frames_unknown: int = 0
    processor_percent: Percent = 0
    sending_percent: Percent = 0
    message_code: Id = ""
    message_values: Annotated[dict[Id, Text | int | float], Meta(max_length=8)] = {}


class Recording(msgspec.Struct, tag="recording", forbid_unknown_fields=True):
    """From the server: a take is being recorded from now on, or no longer.

    `take` is `<session>/<name>`, `take_id` identifies it for good, `start_ns` is its beginning on the server's clock.
    """

    active: bool
    take: str
    take_id: Id = ""
    start_ns: TimeNs = 0


class Kept(msgspec.Struct, tag="kept", forbid_unknown_fields=True):
    """From the client: it keeps the frames `first` to `last` of a take; more may follow during the recording.

    `hello` comes with frames of an earlier start of the client (`boot_id`): the hello of that start.
    """

    take_id: Id
    boot_id: Id
    first: Sequence
    last: Annotated[int, Meta(ge=-1, le=2**62)]
    hello: Hello | None = None


class Ack(msgspec.Struct, tag="ack", forbid_unknown_fields=True):
    """From the server: of the frames kept for a take, those up to `up_to` are on the disk, except `missing`.

    `missing` holds ranges with both ends included. `up_to` = `ENDED`: the take has ended, and no other frames than
    `missing` belong to it. `known` = the server has this take; if not, keep the frames.
    """

    take_id: Id
    boot_id: Id
    up_to: Annotated[int, Meta(ge=-1, le=2**62)]
    missing: list[tuple[int, int]] = []
    known: bool = True


class Late(msgspec.Struct, tag="late", forbid_unknown_fields=True):
    """From the client: a kept frame that was lost; `data` is the whole `SkeletonFrame` message."""

    take_id: Id
    boot_id: Id
    data: bytes


Message = (
    Hello
    | Welcome
    | Refused
    | ClockRequest
    | ClockReply
    | ClockSample
    | SkeletonFrame
    | DepthImage
    | Preview
    | Status
    | Recording
    | Kept
    | Ack
    | Late
)

_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(Message)


def encode(message: Message) -> bytes:
    """Return the message as the bytes of one WebSocket message."""
    return _encoder.encode(message)


def decode(data: bytes) -> Message:
    """Return the message in `data`.

    Raises:
        FormatError: not a message of this protocol, or a field that its schema does not allow.
    """
    if len(data) > MAX_MESSAGE_BYTES:
        raise FormatError(
            "protocol.message_size",
            "message of {n} bytes; at most {most} are allowed",
            n=len(data),
            most=MAX_MESSAGE_BYTES,
        )
    try:
        return _decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError(
            "protocol.not_a_message", "not a message of the camera protocol: {error}", error=error
        ) from error


def check_hello(hello: Hello) -> None:
    """Raise FormatError for a `Hello` with another protocol version or an unknown joint set."""
    if hello.protocol_version != PROTOCOL_VERSION:
        raise FormatError(
            "protocol.version",
            "camera speaks protocol version {version}, the server version {own}; install the "
            "same version on both",
            version=hello.protocol_version,
            own=PROTOCOL_VERSION,
        )
    if hello.joint_set not in JOINT_SETS:
        raise FormatError(
            "joints.unknown_set",
            "unknown joint set {name!r}; known: {known}",
            name=hello.joint_set,
            known=[*JOINT_SETS],
        )


def is_camera_name(name: str) -> bool:
    """Whether `name` may name a camera: 1 to 63 letters, digits, `_`, `.` or `-`, no leading mark."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,62}", name) is not None


def skeleton_frame(
    sequence: int,
    device_time_ns: int,
    positions: NDArray[np.floating],
    confidence: NDArray[np.floating],
    hands: list[HandState] | None = None,
    head_wxyz: tuple[float, float, float, float] | None = None,
) -> SkeletonFrame:
    """Return a frame of device joints [m], shape (joint_count, 3), with confidence, shape (joint_count,)."""
    return SkeletonFrame(
        sequence=sequence,
        device_time_ns=device_time_ns,
        positions=np.ascontiguousarray(positions, dtype="<f4").tobytes(),
        confidence=np.ascontiguousarray(confidence, dtype="<f4").tobytes(),
        hands=hands or [],
        head_wxyz=head_wxyz,
    )


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


def joint_arrays(frame: SkeletonFrame, joint_set: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a frame's device joints: positions, shape (joint_count, 3), and confidence, shape (joint_count,).

    Raises:
        FormatError: the frame has another number of joints than its joint set, or a confidence out of 0..1.
    """
    count = len(JOINT_SETS[joint_set])
    if len(frame.positions) != 12 * count or len(frame.confidence) != 4 * count:
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
        positions = np.frombuffer(frame.positions, dtype="<f4").reshape(count, 3).astype(np.float64)
        confidence = np.frombuffer(frame.confidence, dtype="<f4").astype(np.float64)
    if not ((confidence >= 0) & (confidence <= 1)).all():
        raise FormatError(
            "protocol.confidence", "frame {number}: confidence must be within 0..1", number=frame.sequence
        )
    return positions, confidence
