"""Faults that are put into the frames of a take on purpose, and the one edit that corrects each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studio.engine.edits.edit import Edit, ExchangeEdit, PinEdit
from studio.engine.edits.frames import Changed, with_sides_exchanged
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT

Frames = Mapping[str, Sequence[CameraFrame]]

CLICK_M = 0.02
"""Standard deviation of the distance of a clicked place from the true one."""


LENGTHS_S = {"lost": 1.0, "swapped": 2.0, "held": 1.0, "stuck": 1.5}
"""Duration of each kind of fault; a fault is a second or more from the ends of the performance."""

DRAWN = 6
"""Number of random times from which that of a held foot is chosen."""


@dataclass(frozen=True)
class Fault:
    """A fault, from begin to end [s]; `joint` is the one to correct, None = the one with the largest error."""

    kind: str
    begin_s: float
    end_s: float
    joint: str | None
    camera: str | None = None
    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


def a_fault(
    kind: str,
    rng: np.random.Generator,
    span_s: tuple[float, float],
    cameras: Sequence[str],
    true_m: Callable[[np.ndarray], np.ndarray],
) -> Fault:
    """Return a fault of a kind somewhere within a performance.

    A foot is held while it truly moves: of some random times, the one in which it moves furthest.

    Args:
        true_m: returns the true joints [m], shape (time_count, 21, 3), at times [s].
    """
    side = str(rng.choice(["left", "right"]))
    length = LENGTHS_S[kind]
    begins = rng.uniform(span_s[0] + 1.0, span_s[1] - length - 1.0, size=DRAWN if kind == "held" else 1)
    if kind == "held":
        foot = INDEX[f"{side}_ankle"]
        ways = [np.ptp(true_m(np.linspace(one, one + length, 20))[:, foot], axis=0).max() for one in begins]
        begins = begins[[int(np.argmax(ways))]]
    begin = float(begins[0])
    end = begin + length
    if kind == "lost":
        return Fault(kind, begin, end, f"{side}_wrist")
    if kind == "swapped":
        return Fault(kind, begin, end, None, str(rng.choice(list(cameras))))
    if kind == "held":
        return Fault(kind, begin, end, f"{side}_ankle")
    way = rng.normal(size=3)
    x, y, z = (0.2 * way / np.linalg.norm(way)).tolist()
    return Fault(kind, begin, end, f"{side}_{rng.choice(['wrist', 'ankle'])}", None, (x, y, z))


def faulty(frames: Frames, calibration: Calibration, fault: Fault) -> dict[str, Sequence[CameraFrame]]:
    """Return the frames with a fault."""
    out: dict[str, Sequence[CameraFrame]] = {}
    for name, mine in frames.items():
        if fault.camera not in (None, name):
            out[name] = mine
            continue
        camera = calibration.cameras[name]
        clock = camera.clock
        change = _CHANGES[fault.kind](fault, camera.T_stage_camera[:3, :3])
        changed = {
            place: change(frame)
            for place, frame in enumerate(mine)
            if fault.begin_s <= clock.stage_ns(frame.device_time_ns) * 1e-9 <= fault.end_s
        }
        out[name] = Changed(mine, changed)
    return out


def _outward(joint: str | None) -> list[int]:
    """A joint and all joints that it carries."""
    assert joint is not None
    side, name = joint.split("_")
    return [INDEX[joint], INDEX[f"{side}_{'hand' if name == 'wrist' else 'toe'}"]]


def _lost(fault: Fault, R: np.ndarray) -> Callable[[CameraFrame], CameraFrame]:
    def change(frame: CameraFrame) -> CameraFrame:
        positions, confidence = frame.positions.copy(), frame.confidence.copy()
        for joint in _outward(fault.joint):
            positions[joint], confidence[joint] = positions[INDEX["spine"]], 0.4
            confidence[joint] *= np.isfinite(positions[joint, 0])
        return replace(frame, positions=positions, confidence=confidence)

    return change


def _held(fault: Fault, R: np.ndarray) -> Callable[[CameraFrame], CameraFrame]:
    places: dict[int, np.ndarray] = {}

    def change(frame: CameraFrame) -> CameraFrame:
        positions = frame.positions.copy()
        for joint in _outward(fault.joint):
            if np.isfinite(positions[joint, 0]):
                positions[joint] = places.setdefault(joint, positions[joint].copy())
        return replace(frame, positions=positions)

    return change


def _stuck(fault: Fault, R: np.ndarray) -> Callable[[CameraFrame], CameraFrame]:
    assert fault.joint is not None
    side, name = fault.joint.split("_")
    limb = [INDEX[f"{side}_{'elbow' if name == 'wrist' else 'knee'}"], *_outward(fault.joint)]
    shift = np.array(fault.shift_m) @ R

    def change(frame: CameraFrame) -> CameraFrame:
        positions = frame.positions.copy()
        positions[limb] += shift
        return replace(frame, positions=positions)

    return change


def _swapped(fault: Fault, R: np.ndarray) -> Callable[[CameraFrame], CameraFrame]:
    return lambda frame: with_sides_exchanged(frame, np.ones(JOINT_COUNT, dtype=bool))


_CHANGES = {"lost": _lost, "held": _held, "stuck": _stuck, "swapped": _swapped}
KINDS = tuple(_CHANGES)


def mending(fault: Fault, at_s: float, true_m: np.ndarray, rng: np.random.Generator) -> Edit:
    """Return the one edit that corrects a fault: at an instant, with the true place plus the error of a click."""
    if fault.kind == "swapped":
        return ExchangeEdit(id="mend", start_s=at_s, end_s=at_s, camera=fault.camera)
    assert fault.joint is not None
    x, y, z = (true_m + rng.normal(size=3) * CLICK_M / np.sqrt(3.0)).tolist()
    return PinEdit(id="mend", start_s=at_s, end_s=at_s, joint=fault.joint, place_m=(x, y, z))
