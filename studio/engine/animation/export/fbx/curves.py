"""Animation of an FBX file: a stack with one layer per take, and a curve per moving channel.

Every curve has unrolled Euler angles in the joint's rotation order. The order is the usual one unless a joint comes
near its gimbal lock, where a curve would no longer follow the motion between its keys.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import OFFSET_TOLERANCE_M, LocalMotion
from studio.engine.animation.curves.euler import euler_deg
from studio.engine.animation.curves.key_reduction import Place, Tracks, reduced_keys
from studio.engine.animation.curves.keys import CurveKeys, curve_keys
from studio.engine.animation.export.fbx import scene
from studio.engine.animation.export.fbx.binary import EncodedArray, Node
from studio.engine.animation.export.fbx.objects import Objects
from studio.engine.animation.export.fbx.skeleton import CM

_CUBIC = 0x2108  # cubic, automatic tangents, time-independent: the slope of the two neighbours' chord
_CUBIC_USER = 0x408  # cubic, with the slope of the key
_CUBIC_BROKEN = 0xC08  # cubic, with a separate slope on either side
_FLAGS = {"cubic": _CUBIC, "linear": 0x4, "constant": 0x2}

_WEIGHTS = np.array([0x0D050D05], np.int32).view(np.float32)[0]  # two thirds of 0.3333, in units of 1e-4
_CURVE_VERSION = 4008


def add_take(
    objects: Objects,
    rest: LocalMotion,
    motion: LocalMotion,
    turns_wxyz: NDArray[np.float64],
    models: list[np.int64],
    orders: list[str],
    name: str,
    options: ExportOptions,
    progress: Callable[[float], None],
    layer: np.int64 | None = None,
) -> tuple[np.int64, np.int64]:
    """Add a take and return its layer and the time of its last key.

    Args:
        objects: of the file.
        rest: the skeleton of the file.
        motion: the take.
        turns_wxyz: its rotations on top of the pre-rotations, shape (frame_count, joint_count, 4); of `between`
            where the take has it.
        models: identities of the bones.
        orders: of their rotations.
        name: of the take.
        options: `interpolation` and `key_error_cm` are used.
        progress: receives the share done.
        layer: of another performer in the same take; None = a take of its own.
    """
    times = scene.ticks_at(motion.start_s) + scene.ticks(
        np.arange(motion.frame_count), motion.frames_per_second
    )
    layer = _add_layer(objects, name, times[0], times[-1]) if layer is None else layer
    values = _channels(rest, motion.between or motion, turns_wxyz, orders)
    progress(0.3)
    writer = _Curves(objects, layer, times, motion.frames_per_second)
    steps = 1 if motion.between is None else (len(turns_wxyz) - 1) // max(1, motion.frame_count - 1)
    at_keys = {place: track[::steps] for place, track in values.items()}
    if options.key_error_cm is not None:
        tracks = Tracks(at_keys, tuple(orders), rest.rest_local_wxyz, motion)
        keys = reduced_keys(
            tracks, options.key_error_cm, options.interpolation, lambda share: progress(0.3 + 0.6 * share)
        )
    else:
        keys = {
            place: [
                curve_keys(
                    track[:, axis],
                    motion.frames_per_second,
                    options.interpolation,
                    between=values[place][:, axis] if steps > 1 else None,
                )
                for axis in range(3)
            ]
            for place, track in at_keys.items()
        }
    for done, ((joint, channel), three) in enumerate(keys.items()):
        writer.add(models[joint], channel, three, _FLAGS[options.interpolation])
        progress(0.9 + 0.1 * (done + 1) / len(keys))
    return layer, times[-1]


def _channels(
    rest: LocalMotion, motion: LocalMotion, turns_wxyz: NDArray[np.float64], orders: list[str]
) -> dict[Place, NDArray[np.float64]]:
    """Return the channels of the file: rotations of all joints, positions of those that move."""
    values: dict[Place, NDArray[np.float64]] = {}
    for joint in range(len(motion.parents)):
        keys = motion.positions_m.get(joint)
        if (
            keys is None
            and np.abs(motion.offsets_m[joint] - rest.offsets_m[joint]).max() > OFFSET_TOLERANCE_M
        ):
            keys = np.repeat(motion.offsets_m[joint][None], motion.frame_count, axis=0)
        if keys is not None:
            values[joint, "Translation"] = keys * CM
        values[joint, "Rotation"] = euler_deg(turns_wxyz[:, joint], orders[joint])
    return values


def _add_layer(objects: Objects, name: str, start: np.int64, stop: np.int64) -> np.int64:
    """Add a stack with one layer, which is returned."""
    span = [
        scene.time(f"{which}{end}", value)
        for which in ("Local", "Reference")
        for end, value in (("Start", start), ("Stop", stop))
    ]
    stack = objects.add("AnimationStack", name, "AnimStack", "", scene.properties(*span))
    layer = objects.add("AnimationLayer", "BaseLayer", "AnimLayer", "")
    objects.connect(layer, stack)
    return layer


class _Curves:
    """Adds the curves of one take."""

    def __init__(
        self, objects: Objects, layer: np.int64, times: NDArray[np.int64], frames_per_second: float
    ) -> None:
        self._objects, self._layer, self._times = objects, layer, times
        self._all_times = EncodedArray(times)
        self._rate = frames_per_second

    def add(self, model: np.int64, channel: str, three: list[CurveKeys], flags: int) -> None:
        """Add curves of x, y, z: `Translation` [cm] or `Rotation` [deg]."""
        objects = self._objects
        starts = [
            scene.number(f"d|{axis}", float(keys.values[0]), animated=True)
            for axis, keys in zip("XYZ", three, strict=True)
        ]
        node = objects.add("AnimationCurveNode", channel[0], "AnimCurveNode", "", scene.properties(*starts))
        objects.connect(node, self._layer)
        objects.connect(node, model, f"Lcl {channel}")
        for axis, keys in zip("XYZ", three, strict=True):
            whole = len(keys.frames) == len(self._times)
            curve = objects.add(
                "AnimationCurve", "", "AnimCurve", "",
                Node("Default", float(keys.values[0])),
                Node("KeyVer", _CURVE_VERSION),
                Node("KeyTime", self._all_times if whole else self._times[keys.frames]),
                Node("KeyValueFloat", keys.values.astype(np.float32)),
                *_attributes(keys, flags),
            )  # fmt: skip
            objects.connect(curve, node, f"d|{axis}")


def _attributes(keys: CurveKeys, flags: int) -> list[Node]:
    """Return flags and slopes of a curve's keys, with runs of equal ones merged.

    A key holds its slope to the right and the left slope of the next key. Keys with automatic
    tangents need none.
    """
    count = len(keys.frames)
    rows = np.zeros((count, 3))
    own = np.isfinite(keys.slopes)
    rows[:, 0] = np.where(own, np.where(keys.lefts == keys.slopes, _CUBIC_USER, _CUBIC_BROKEN), flags)
    rows[own, 1] = keys.slopes[own]
    before = np.flatnonzero(own[1:])
    rows[before, 2] = keys.lefts[before + 1]
    changes = np.flatnonzero((np.diff(rows, axis=0) != 0).any(axis=1)) + 1
    begins = np.concatenate([[0], changes])
    counts = np.diff(np.concatenate([begins, [count]]))
    rows = rows[begins]
    data = np.zeros((len(rows), 4), np.float32)  # right slope, left slope of the next key, weights, velocity
    data[:, :2] = rows[:, 1:]
    data[:, 2] = _WEIGHTS
    return [
        Node("KeyAttrFlags", rows[:, 0].astype(np.int32)),
        Node("KeyAttrDataFloat", data.ravel()),
        Node("KeyAttrRefCount", counts.astype(np.int32)),
    ]
