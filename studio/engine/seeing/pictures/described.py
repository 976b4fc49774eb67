"""Descriptions of third-party pose networks: the input, the output and the points of an `.onnx` file.

A description is JSON or TOML next to the network; docs/devices.md has an example.
"""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.sentences import say
from studio.engine.model.joints import JOINT_SETS

ENDINGS = (".json", ".toml")
LAYOUTS = ("nchw", "nhwc")
COLOURS = ("rgb", "bgr")
KINDS = ("simcc", "heatmap", "points")
UNITS = ("input", "share")
COLUMNS = ("x", "y", "score")

_LANDMARKS = JOINT_SETS["mediapipe"]
_BODY = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip
_COCO = {name: k for k, name in enumerate(_BODY)}
JOINTS: dict[str, dict[str, int]] = {
    "coco_17": _COCO,
    "halpe_26": {**_COCO, "left_foot_index": 20, "right_foot_index": 21, "left_heel": 24, "right_heel": 25},
    "coco_133": {**_COCO, "left_foot_index": 17, "left_heel": 19, "right_foot_index": 20, "right_heel": 22},
}
"""Named sets of points: the index in each set of every BlazePose landmark that it has."""

_MOST_SIDE = 4096
_MOST_BYTES = 1 << 20


@dataclass(frozen=True)
class PoseDescription:
    """A third-party pose network.

    Attributes:
        network: its `.onnx` file.
        width, height: of its input [pixels].
        layout: `nchw` or `nhwc`.
        colour: `rgb` or `bgr`.
        scale, mean, deviation: the input is (pixel * `scale` - `mean`) / `deviation`, pixels 0..255, by colour.
        box: whether its input is cut out around a person; otherwise it is the whole picture.
        margin: size of the cut-out relative to the person.
        kind: of its output: `simcc` (a row and a column of bins per point), `heatmap`, or `points` (places, scores).
        split: for `simcc`, bins per pixel.
        unit: for `points`: pixels of the input, or shares of its size.
        columns: for `points`: the order of `x`, `y` and optionally `score`.
        joints: by landmark of BlazePose, the number of its point.
    """

    network: Path
    width: int
    height: int
    layout: str
    colour: str
    scale: float
    mean: NDArray[np.float32]
    deviation: NDArray[np.float32]
    box: bool
    margin: float
    kind: str
    split: float
    unit: str
    columns: tuple[str, ...]
    joints: dict[str, int]


def is_description(model: str | Path) -> bool:
    """Whether a model is given by a description file."""
    return Path(model).suffix.lower() in ENDINGS


def read_description(path: Path) -> PoseDescription:
    """Return the description of a network in a file.

    Raises:
        FormatError: the file cannot be read, lacks something, or names something unknown.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        text = path.read_text(encoding="utf-8")
        content = tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
        return _described(path, content)
    except StudioError:
        raise
    except KeyError as error:
        raise _bad(path, say("network.lacks", "it lacks {key}", key=str(error.args[0]))) from error
    except (OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise _bad(path, str(error) or type(error).__name__) from error


def _described(path: Path, content: Any) -> PoseDescription:
    network = path.parent / str(content["network"])
    if not network.is_file():
        raise _bad(path, say("network.none", "there is no network {file}", file=network.name))
    into, out = content["input"], content["output"]
    width, height = (int(into[side]) for side in ("width", "height"))
    if not (8 <= width <= _MOST_SIDE and 8 <= height <= _MOST_SIDE):
        raise ValueError(f"an input of {width} x {height}; allowed: 8 to {_MOST_SIDE} pixels")
    columns = tuple(out.get("columns", COLUMNS))
    if not {"x", "y"} <= set(columns) <= set(COLUMNS) or len(set(columns)) < len(columns):
        raise ValueError(f"columns {columns}; allowed: x, y and maybe score, in any order")
    joints = content["joints"]
    joints = JOINTS[_one_of("joints", joints, tuple(JOINTS))] if isinstance(joints, str) else dict(joints)
    strange = [name for name in joints if name not in _LANDMARKS]
    if strange or not joints or not all(isinstance(k, int) and k >= 0 for k in joints.values()):
        raise ValueError(
            f"joints {strange or joints}; allowed: names of {', '.join(_LANDMARKS)}, with numbers from 0"
        )
    mean, deviation = (_colours(into, key, usual) for key, usual in (("mean", 0.0), ("deviation", 1.0)))
    margin, split = float(content.get("margin", 1.25)), float(out.get("split", 2.0))
    if not (np.all(deviation > 0) and 0.5 <= margin <= 4 and split > 0):
        raise ValueError("deviation and split must be above 0, margin 0.5 to 4")
    return PoseDescription(
        network,
        width,
        height,
        _one_of("layout", into.get("layout", "nchw"), LAYOUTS),
        _one_of("colour", into.get("colour", "rgb"), COLOURS),
        float(into.get("scale", 1.0)),
        mean,
        deviation,
        bool(content.get("box", True)),
        margin,
        _one_of("kind", out["kind"], KINDS),
        split,
        _one_of("unit", out.get("unit", "input"), UNITS),
        columns,
        joints,
    )


def _colours(into: Any, key: str, usual: float) -> NDArray[np.float32]:
    values = np.array(into.get(key, usual), np.float32)
    if values.shape not in ((), (3,)) or not np.isfinite(values).all():
        raise ValueError(f"{key} must be one number, or three")
    return np.broadcast_to(values, 3)


def _one_of(key: str, value: object, allowed: tuple[str, ...]) -> str:
    if value not in allowed:
        raise ValueError(f"{key} {value!r}; allowed: {', '.join(allowed)}")
    return str(value)


def _bad(path: Path, error: str) -> FormatError:
    return FormatError(
        "network.description",
        "{path} does not describe a pose network ({error}); docs/devices.md has an example",
        path=path,
        error=error,
    )
