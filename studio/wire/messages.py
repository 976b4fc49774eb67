"""The messages between camera clients and the server (version 3), also kept in `raw.mcap`.

A camera client opens a WebSocket at `/api/v1/link` and sends `Hello`; the server answers `Welcome` or
`Refused` and closes. Then, in any order: `ClockRequest` -> `ClockReply` (the exchange that gives offset and
drift), `SkeletonFrame`, `Status` from the client, `Recording` and `Ack` from the server. While a take is recorded
the client keeps its frames (`Kept`) until an `Ack` says that they are on the disk, and sends again what is missing
(`Late`). Every message is one binary WebSocket message: a MessagePack map with a `type` key. `decode` checks it
against its schema.

A `SkeletonFrame` is written to `raw.mcap` with exactly the bytes that arrived. Version 2 added its `landmarks`,
version 3 several bodies; clients of earlier versions are welcome.
"""

import re
from typing import Annotated

import msgspec
from msgspec import Meta

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS

PROTOCOL_VERSION = 3
KNOWN_VERSIONS = (1, 2, PROTOCOL_VERSION)
"""Versions of camera clients that the server understands."""

MAX_MESSAGE_BYTES = 4 * 1024 * 1024
LINK_PATH = "/api/v1/link"
VIDEO_PATH = "/api/v1/video"
"""Address to which clients upload the videos that they recorded during takes."""


Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}\Z")]
TimeNs = Annotated[int, Meta(ge=0, le=2**62)]
PREVIEW_PIXELS = 160
"""Largest width and height of a preview; clients send half of it."""

ENDED = 2**62
"""`up_to` of the last `Ack` of a take."""

Sequence = Annotated[int, Meta(ge=0, le=2**62)]
Percent = Annotated[int, Meta(ge=0, le=100)]
BodyNumber = Annotated[int, Meta(ge=0, le=2**31 - 1)]
MOST_OTHERS = 15
"""Maximum number of bodies of a frame besides its first."""
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

    `boot_id` changes with every start of the client, so that (name, boot_id, sequence) always identifies a frame.
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


class Landmarks(msgspec.Struct, forbid_unknown_fields=True):
    """Positions of a performer's joints in a picture. All numbers are little-endian float32.

    `width`, `height`: size of this picture [pixels]. `pixels`: joint_count * 2 (column, row), NaN = unseen; the
    centre of the first pixel is (0, 0). `world`: joint_count * 3 [m] about the middle of the hips, in the picture's
    axes (x right, y down, z away), as guessed from one picture alone; empty = none. `left_hand`,
    `right_hand`: 21 * 2 pixels of a hand's landmarks, empty = not seen.
    """

    width: Annotated[int, Meta(ge=16, le=16384)]
    height: Annotated[int, Meta(ge=16, le=16384)]
    pixels: bytes
    world: bytes = b""
    left_hand: bytes = b""
    right_hand: bytes = b""


class Body(msgspec.Struct, forbid_unknown_fields=True):
    """A further body in a `SkeletonFrame`; its fields are as there. `number` is the device's own (`body` there)."""

    number: BodyNumber
    positions: bytes
    confidence: bytes
    hands: Annotated[list[HandState], Meta(max_length=8)] = []
    head_wxyz: tuple[float, float, float, float] | None = None
    landmarks: Landmarks | None = None


class SkeletonFrame(msgspec.Struct, tag="skeleton", forbid_unknown_fields=True):
    """The bodies that a camera sees at one moment, in the camera frame [m], in the joint set named by `Hello`.

    `positions`: little-endian float32, joint_count * 3, NaN = unseen. `confidence`: float32, joint_count.
    `head_wxyz`: measured head orientation in the camera frame where known.
    `landmarks`: of a camera that sees no depth; `positions` is empty then, and `confidence` how visible each is.
    `body`: the device's own number of this body, a hint: it changes when the device loses the body. `others`: further
    bodies, each with another number.
    """

    sequence: Sequence
    device_time_ns: TimeNs
    positions: bytes
    confidence: bytes
    hands: Annotated[list[HandState], Meta(max_length=8)] = []
    head_wxyz: tuple[float, float, float, float] | None = None
    landmarks: Landmarks | None = None
    body: BodyNumber = 0
    others: Annotated[list[Body], Meta(max_length=MOST_OTHERS)] = []


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

    `message_code`, `message_values`: the message's code and its values, if it has a code.
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

    `take` is `<session>/<name>`, `take_id` always identifies it, `start_ns` is its beginning on the server's clock.
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
    if hello.protocol_version not in KNOWN_VERSIONS:
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
