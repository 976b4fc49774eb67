"""Depth in ROS bags: RealSense recordings (`.bag`, `.db3`) and bags of camera drivers.

A camera is a topic with `depth` in its name and 16-bit images, raw or as PNG (`compressedDepth`); its
intrinsics are the `CameraInfo` with the longest common prefix. Its time is the device's: the SDK's metadata
if a bag has them, else the message's stamp, else the time of recording.
"""

import io
import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say
from studio.take.importers.bag_files import Bag, open_bag
from studio.take.importers.recording import DepthStream, Progress, ReadCamera, ReadDepth, ReadRecording

_IMAGE, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_ENCODINGS = ("16UC1", "mono16", "z16")
_MODELS = ("", "none", "plumb_bob", "brown conrady", "rational_polynomial")
_PNG_HEADER = b"\x89PNG"


def matches(path: Path) -> bool:
    """Whether `path` is a `.bag`, a `.db3`, or a folder with a ROS 2 bag."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() and any(path.glob("*.db3"))
    return path.is_file() and path.suffix.lower() in (".bag", ".db3")


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording, one camera per depth topic; images are read when it is written.

    Raises:
        FormatError: not a bag, or one without depth images or intrinsics.
    """
    notes: list[str] = []
    cameras = read_cameras(path, notes)
    progress(1.0)
    return ReadRecording(cameras=cameras, notes=notes)


def read_cameras(path: Path, notes: list[str]) -> tuple[ReadCamera, ...]:
    """Return a bag's cameras, `camera_0`, `camera_1`, ...; damage is noted when their streams are read.

    Raises:
        FormatError: not a bag, or one without depth images or intrinsics.
    """
    bag = open_bag(path)
    topics = _depth_topics(bag)
    if not topics:
        none = say(
            "import.no_depth_topic",
            "{path} has no depth images; its topics: {names}",
            path=path,
            names=", ".join(sorted(bag.topics)) or "none",
        )
        raise FormatError(
            say("text.detail", "{text} ({detail})", text=none, detail=bag.problem) if bag.problem else none
        )
    if len(topics) > 1:
        notes += [f"{path.name}: camera_{k} is topic {topic}" for k, topic in enumerate(topics)]
    return tuple(
        ReadCamera.of_depth(f"camera_{k}", _read_depth(bag, path, topic, notes))
        for k, topic in enumerate(topics)
    )


def _depth_topics(bag: Bag) -> list[str]:
    found = []
    for name, topic in sorted(bag.topics.items()):
        if "depth" not in name.lower() or topic.message_type not in (_IMAGE, _COMPRESSED) or not topic.count:
            continue
        message = _first(bag, name)
        kind = "" if message is None else str(getattr(message, "encoding", "") or message.format)
        if kind in _ENCODINGS or "compressedDepth" in kind:
            found.append(name)
    return found


def _read_depth(bag: Bag, path: Path, topic: str, notes: list[str]) -> ReadDepth:
    intrinsics = _intrinsics(path, bag, topic)
    unit_m = _unit_m(bag, topic)
    times_ns = _metadata_times(bag, topic)
    period_s = _period_s(times_ns, bag, topic)
    return ReadDepth(
        device=_device(bag, topic),
        intrinsics=intrinsics,
        frame_count=bag.topics[topic].count,
        frames_per_second=1.0 / period_s,
        stream=lambda: _stream(bag, path, topic, intrinsics, 1e3 * unit_m, times_ns, notes),
    )


def _stream(
    bag: Bag,
    path: Path,
    topic: str,
    intrinsics: wire.Intrinsics,
    step_mm: float,
    times_ns: dict[int, int],
    notes: list[str],
) -> DepthStream:
    newest_ns, kept, broken, late = -1, 0, "", 0
    for _, recorded_ns, message in bag.messages((topic,)):
        time_ns = times_ns.get(recorded_ns, _stamp_ns(message) or recorded_ns)
        if time_ns <= newest_ns:
            late += 1
            continue
        try:
            depth_mm = _image(message, intrinsics, step_mm)
        except FormatError as error:
            broken = broken or str(error)
            continue
        newest_ns, kept = time_ns, kept + 1
        yield time_ns, depth_mm
    if bag.problem:
        notes.append(f"{path.name}: {bag.problem}; the {kept} images that it holds were kept")
    if broken:
        notes.append(f"{path.name}: images were left out; the first: {broken}")
    if late:
        notes.append(f"{path.name}: {late} images whose time does not advance were left out")


def _image(message: Any, intrinsics: wire.Intrinsics, step_mm: float) -> NDArray[np.uint16]:
    shape = (intrinsics.height, intrinsics.width)
    if hasattr(message, "format"):
        data = bytes(message.data)
        try:
            values = np.array(
                Image.open(io.BytesIO(data[max(data.find(_PNG_HEADER, 0, 64), 0) :]), formats=("PNG",))
            )
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            raise FormatError(
                "import.ros_compressed", "a compressed image cannot be read ({error})", error=error
            ) from error
    else:
        order = ">u2" if message.is_bigendian else "<u2"
        rows = np.asarray(message.data, dtype=np.uint8)
        if message.step < 2 * message.width or len(rows) != message.height * message.step:
            raise FormatError(
                "import.ros_bytes",
                "an image has {n} bytes where {rows} x {step} belong",
                n=len(rows),
                rows=message.height,
                step=message.step,
            )
        values = rows.reshape(message.height, message.step)[:, : 2 * message.width].copy().view(order)
    if values.shape != shape:
        raise FormatError(
            "import.ros_shape",
            "an image has shape {shape}, the intrinsics {other}",
            shape=values.shape,
            other=shape,
        )
    if step_mm == 1.0:
        return values.astype(np.uint16)
    return np.clip(np.rint(values * step_mm), 0, 65535).astype(np.uint16)


def _intrinsics(path: Path, bag: Bag, topic: str) -> wire.Intrinsics:
    about = _nearest(bag, topic, lambda name, kind: kind == "sensor_msgs/msg/CameraInfo")
    message = None if about is None else _first(bag, about)
    if message is None:
        raise FormatError(
            "import.ros_no_info",
            "{path}: topic {topic} has no camera_info; record it with the images",
            path=path,
            topic=topic,
        )
    k = np.asarray(getattr(message, "K", getattr(message, "k", None)), dtype=float)
    d = np.asarray(getattr(message, "D", getattr(message, "d", None)), dtype=float)
    model = message.distortion_model.lower()
    if d.any() and (model not in _MODELS or len(d) > 8):
        raise FormatError(
            "import.ros_distortion",
            "{path}: {about} has distortion {model!r}; allowed: {allowed}",
            path=path,
            about=about,
            model=message.distortion_model,
            allowed=_MODELS,
        )
    if k.shape != (9,) or not np.isfinite([*k, *d]).all() or min(k[0], k[4]) <= 0:
        raise FormatError(
            "import.ros_no_intrinsics", "{path}: {about} holds no intrinsics", path=path, about=about
        )
    if not (0 < message.width <= 4096 and 0 < message.height <= 4096):
        raise FormatError(
            "import.ros_image_size",
            "{path}: {about} has an image of {width} x {height}",
            path=path,
            about=about,
            width=message.width,
            height=message.height,
        )
    distortion = tuple(d.tolist()) if d.any() else ()
    return wire.Intrinsics(
        float(k[0]),
        float(k[4]),
        float(k[2]),
        float(k[5]),
        int(message.width),
        int(message.height),
        distortion,
    )


def _unit_m(bag: Bag, topic: str) -> float:
    """Return the unit of the images [m]: the RealSense option `Depth Units`, else a millimetre."""
    option = _nearest(bag, topic, lambda name, kind: re.search(r"Depth[ _]Units/value$", name) is not None)
    message = None if option is None else _first(bag, option)
    try:
        unit_m = round(float(message.data), 9) if message is not None else 0.001
    except ValueError:
        return 0.001
    return unit_m if 1e-6 < unit_m < 1 else 0.001


def _device(bag: Bag, topic: str) -> str:
    """Return the device's name: a RealSense recording has it as a key and value under `/device_N/info`."""
    about = re.match(r"(/device_\d+)/", topic)
    if about is None:
        return "depth camera"
    for _, _, message in bag.messages((f"{about[1]}/info",)):
        if getattr(message, "key", "") == "Name":
            return str(message.value)
        named = re.search(r"(?:^|;)Name=([^;]*)", str(getattr(message, "data", "")))
        if named:
            return named[1]
    return "RealSense"


def _metadata_times(bag: Bag, topic: str) -> dict[int, int]:
    """Return device times [ns] by time of recording, if the SDK wrote them as text next to the images."""
    beside = f"{topic.partition('/image/data')[0]}/image/metadata"
    times = {}
    for _, recorded_ns, message in bag.messages((beside,)):
        found = re.search(r"(?:^|;)timestamp=([\d.]+)", str(getattr(message, "data", "")))
        if found:
            times[recorded_ns] = round(float(found[1]) * 1e6)
    return times


def _period_s(times_ns: dict[int, int], bag: Bag, topic: str) -> float:
    if times_ns:
        stamps = sorted(times_ns.values())
    else:
        stamps = sorted(_stamp_ns(message) or time for _, time, message in _some(bag, topic, 30))
    gaps_s = np.diff(stamps) * 1e-9
    return float(np.median(gaps_s)) if len(gaps_s) and np.median(gaps_s) > 1e-4 else 1 / 30


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _nearest(bag: Bag, topic: str, allowed: Any) -> str | None:
    """Return the allowed topic with the longest common prefix with `topic`; None = none is allowed."""
    names = [name for name, of in bag.topics.items() if of.count and allowed(name, of.message_type)]
    return max(names, key=lambda name: _shared_parts(name, topic), default=None)


def _shared_parts(one: str, other: str) -> int:
    pairs = zip(one.split("/"), other.split("/"), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _first(bag: Bag, topic: str) -> Any:
    return next((message for _, _, message in _some(bag, topic, 1)), None)


def _some(bag: Bag, topic: str, count: int) -> Iterator[tuple[str, int, Any]]:
    for k, item in enumerate(bag.messages((topic,))):
        if k == count:
            return
        yield item
