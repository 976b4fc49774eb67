"""The parts of an FBX file besides its objects: header, axes, unit, time, and property rows."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.export.fbx.binary import CREATION_TIME, FILE_ID, VERSION, Node

TICKS_PER_SECOND = 46_186_158_000

_TIME_MODES = {120.0: 1, 100.0: 2, 60.0: 3, 50.0: 4, 48.0: 5, 30.0: 6, 30 / 1.001: 9, 25.0: 10, 24.0: 11,
               1000.0: 12, 24 / 1.001: 13, 96.0: 15, 72.0: 16, 60 / 1.001: 17, 120 / 1.001: 18}  # fmt: skip
_CUSTOM_TIME_MODE = 14
_DROP_FRAME_MODE = 8
_APPLICATION = "Capture Studio"


def ticks(frame: NDArray[np.int64], frames_per_second: float) -> NDArray[np.int64]:
    """Return FBX times of frame numbers, same shape; exact for rates that divide the ticks of a second."""
    return np.rint(frame * (TICKS_PER_SECOND / frames_per_second)).astype(np.int64)


def ticks_at(time_s: float) -> np.int64:
    """Return the FBX time of an instant [s]."""
    return np.int64(round(time_s * TICKS_PER_SECOND))


def properties(*rows: Node) -> Node:
    return Node("Properties70", children=rows, closed=True)


def number(name: str, value: float, *, animated: bool = False) -> Node:
    kind = ("Number", "", "A") if animated else ("double", "Number", "")
    return Node("P", name, *kind, float(value))


def integer(name: str, value: int, kind: str = "int") -> Node:
    """A row of kind `int`, `bool` or `enum`."""
    return Node("P", name, kind, "Integer" if kind == "int" else "", "", int(value))


def text(name: str, value: str) -> Node:
    return Node("P", name, "KString", "", "", value)


def custom_text(name: str, value: str) -> Node:
    """A property of the user's own."""
    return Node("P", name, "KString", "", "U", value)


def time(name: str, value: np.int64) -> Node:
    return Node("P", name, "KTime", "Time", "", np.int64(value))


def vector(name: str, values: NDArray[np.float64], *, animated: bool = False) -> Node:
    """A local transformation: `Lcl Translation`, `Lcl Rotation` or `Lcl Scaling`."""
    return Node("P", name, name, "", "A+" if animated else "A", *(float(v) for v in values))


def vector_of(name: str, values: NDArray[np.float64]) -> Node:
    """A property of three numbers, such as `PreRotation`."""
    return Node("P", name, "Vector3D", "Vector", "", *(float(v) for v in values))


def colour(name: str, values: tuple[float, float, float]) -> Node:
    """A colour of red, green and blue, 0..1."""
    return Node("P", name, "Color", "", "A", *values)


def header() -> list[Node]:
    """Return the opening nodes; the creation time is the constant of the footer."""
    stamp = {"Version": 1000, "Year": 1970, "Month": 1, "Day": 1, "Hour": 10, "Minute": 0, "Second": 0,
             "Millisecond": 0}  # fmt: skip
    application = [text(f"{which}|ApplicationName", _APPLICATION) for which in ("Original", "LastSaved")]
    info = Node(
        "SceneInfo", "GlobalInfo\x00\x01SceneInfo", "UserData",
        children=[Node("Type", "UserData"), Node("Version", 100), properties(*application)],
    )  # fmt: skip
    extension = [
        Node("FBXHeaderVersion", 1003),
        Node("FBXVersion", VERSION),
        Node("EncryptionType", 0),
        Node("CreationTimeStamp", children=[Node(key, value) for key, value in stamp.items()]),
        Node("Creator", _APPLICATION),
        info,
    ]
    return [
        Node("FBXHeaderExtension", children=extension),
        Node("FileId", FILE_ID),
        Node("CreationTime", CREATION_TIME),
        Node("Creator", _APPLICATION),
    ]


def global_settings(
    frames_per_second: float, start: np.int64, stop: np.int64, *, timecode: bool, drop: bool = False
) -> Node:
    """Return the settings: y up, facing +z, right-handed, centimetres, frame rate and time span.

    With `timecode`, programs show times as hh:mm:ss:ff; `drop`: drop-frame, at 29.97.
    """
    mode = _TIME_MODES.get(frames_per_second, _CUSTOM_TIME_MODE)
    if drop and frames_per_second == 30 / 1.001:
        mode = _DROP_FRAME_MODE
    rows = [
        integer("UpAxis", 1), integer("UpAxisSign", 1),
        integer("FrontAxis", 2), integer("FrontAxisSign", 1),
        integer("CoordAxis", 0), integer("CoordAxisSign", 1),
        integer("OriginalUpAxis", 1), integer("OriginalUpAxisSign", 1),
        number("UnitScaleFactor", 1.0), number("OriginalUnitScaleFactor", 1.0),
        integer("TimeMode", mode, "enum"), integer("TimeProtocol", 0 if timecode else 2, "enum"),
        integer("SnapOnFrameMode", 0, "enum"),
        time("TimeSpanStart", start), time("TimeSpanStop", stop),
        number("CustomFrameRate", frames_per_second if mode == _CUSTOM_TIME_MODE else -1.0),
    ]  # fmt: skip
    return Node("GlobalSettings", children=[Node("Version", 1000), properties(*rows)])


def documents(identity: np.int64, take_name: str) -> list[Node]:
    document = Node(
        "Document", identity, "", "Scene",
        children=[properties(text("ActiveAnimStackName", take_name)), Node("RootNode", np.int64(0))],
    )  # fmt: skip
    return [
        Node("Documents", children=[Node("Count", 1), document]),
        Node("References", closed=True),
    ]


def definitions(objects: list[Node]) -> Node:
    """Return the number of objects of each type in the file, settings included."""
    counts: dict[str, int] = {"GlobalSettings": 1}
    for item in objects:
        counts[item.name.decode()] = counts.get(item.name.decode(), 0) + 1
    types = [Node("ObjectType", name, children=[Node("Count", count)]) for name, count in counts.items()]
    return Node("Definitions", children=[Node("Version", 100), Node("Count", sum(counts.values())), *types])


def takes(spans: list[tuple[str, np.int64, np.int64]]) -> Node:
    """Return the list of takes: name, start and stop of each; the first is the current one."""
    nodes = []
    for name, start, stop in spans:
        times = [Node(kind, start, stop) for kind in ("LocalTime", "ReferenceTime")]
        nodes.append(Node("Take", name, children=[Node("FileName", f"{name.replace(' ', '_')}.tak"), *times]))
    return Node("Takes", children=[Node("Current", spans[0][0]), *nodes])
