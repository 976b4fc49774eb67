"""Writer of depth as an Azure Kinect recording (`.mkv`): one depth track, calibration, times to the microsecond.

The file has the elements that readers of such recordings need: `V_MS/VFW/FOURCC` with `b16g`
(big-endian 16-bit), a cluster per image, `calibration.json` attached, and the tags of track and device. The
Matroska elements are those of RFC 9559.
"""

import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.model.cameras.depth import DepthCamera
from studio.take.importers.k4a import calibration_json, mode_of

_TRACK_UID, _FILE_UID = 1, 2
_UNKNOWN_SIZE = b"\x01" + b"\xff" * 7


def write_k4a(
    path: Path,
    camera: DepthCamera,
    frames: Iterable[tuple[int, NDArray[np.uint16]]],
    *,
    frames_per_second: float = 30.0,
    serial: str = "",
) -> int:
    """Write depth images as an Azure Kinect recording, atomically; return their number.

    Args:
        path: the file, replaced if it exists.
        camera: of every image; its size must be that of a depth mode of the device.
        frames: device time [ns], increasing, and depth [mm], shape (height, width).

    Raises:
        FormatError: no image, an image size that the device does not have, or an image of another size.
        StudioError: the file cannot be written.
    """
    count, start_ns = 0, 0
    with write_atomically(path) as file:
        for count, (time_ns, depth_mm) in enumerate(frames, start=1):
            if count == 1:
                start_ns = time_ns
                file.write(_head(camera, frames_per_second, serial, start_ns))
            if depth_mm.shape != (camera.height, camera.width):
                raise FormatError(
                    "depth.image_shape",
                    "image {n} has shape {shape}; the camera's is needed",
                    n=count,
                    shape=depth_mm.shape,
                )
            file.write(_cluster((time_ns - start_ns) // 1000, depth_mm))
        if not count:
            raise FormatError("depth.no_image", "there is no depth image to write")
        size = file.tell() - _SEGMENT_DATA
        file.seek(_SEGMENT_DATA - 8)
        file.write((1 << 56 | size).to_bytes(8, "big"))  # marks the file as finished
    return count


def _element(number: str, data: bytes | str | int) -> bytes:
    """Return a Matroska element: number as hexadecimal, length in eight bytes, data."""
    if isinstance(data, int):
        data = data.to_bytes(max((data.bit_length() + 7) // 8, 1), "big")
    elif isinstance(data, str):
        data = data.encode()
    return bytes.fromhex(number) + (1 << 56 | len(data)).to_bytes(8, "big") + data


_EBML = _element(
    "1A45DFA3",
    _element("4286", 1)
    + _element("42F7", 1)
    + _element("42F2", 4)
    + _element("42F3", 8)
    + _element("4282", "matroska")
    + _element("4287", 2)
    + _element("4285", 2),
)
_SEGMENT_DATA = len(_EBML) + 12


def _head(camera: DepthCamera, frames_per_second: float, serial: str, start_ns: int) -> bytes:
    """Return everything before the first cluster: EBML header, start of the segment, info, track, attachment,
    tags."""
    info = (
        _element("2AD7B1", 1000)  # times in microseconds
        + _element("4D80", "capture studio")
        + _element("5741", "capture studio")
        + _element("7BA9", "Azure Kinect")
    )
    bitmap = struct.pack(
        "<IiiHH4sI16x", 40, camera.width, camera.height, 1, 16, b"b16g", 2 * camera.width * camera.height
    )
    track = (
        _element("D7", 1)
        + _element("73C5", _TRACK_UID)
        + _element("83", 1)
        + _element("9C", 0)
        + _element("23E383", round(1e9 / frames_per_second))
        + _element("86", "V_MS/VFW/FOURCC")
        + _element("536E", "DEPTH")
        + _element("63A2", bitmap)
        + _element("E0", _element("B0", camera.width) + _element("BA", camera.height))
    )
    attachment = _element(
        "61A7",
        _element("466E", "calibration.json")
        + _element("4660", "application/octet-stream")
        + _element("465C", calibration_json(camera, serial))
        + _element("46AE", _FILE_UID),
    )
    of_track, of_file = _element("63C5", _TRACK_UID), _element("63C6", _FILE_UID)
    tags = (
        _tag(of_track, K4A_DEPTH_MODE=mode_of(camera), K4A_DEPTH_TRACK=str(_TRACK_UID))
        + _tag(of_file, K4A_CALIBRATION_FILE="calibration.json")
        + _tag(
            b"", K4A_DEVICE_SERIAL_NUMBER=serial, K4A_START_OFFSET_NS=str(start_ns), K4A_DEPTH_DELAY_NS="0"
        )
    )
    return (
        _EBML
        + bytes.fromhex("18538067")
        + _UNKNOWN_SIZE
        + _element("1549A966", info)
        + _element("1654AE6B", _element("AE", track))
        + _element("1941A469", attachment)
        + _element("1254C367", tags)
    )


def _tag(target: bytes, **values: str) -> bytes:
    simple = b"".join(
        _element("67C8", _element("45A3", name) + _element("4487", value)) for name, value in values.items()
    )
    return _element("7373", _element("63C0", target) + simple)


def _cluster(time_us: int, depth_mm: NDArray[np.uint16]) -> bytes:
    block = (
        b"\x81\x00\x00\x80" + depth_mm.astype(">u2").tobytes()
    )  # track 1, at the cluster's time, key frame
    return _element("1F43B675", _element("E7", time_us) + _element("A3", block))
