"""Small takes and recordings that the tests of takes write."""

from pathlib import Path

import numpy as np

from studio import wire
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, JOINT_SETS
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter

FRAME_NS = 33_333_333


def hello(name: str, joint_set: str = "canonical", boot_id: str = "boot-1", token: str = "") -> wire.Hello:
    return wire.Hello(wire.PROTOCOL_VERSION, name, "test camera", joint_set, boot_id, token=token)


def message(k: int, seed: int = 0, joint_set: str = "canonical") -> wire.SkeletonFrame:
    count = len(JOINT_SETS[joint_set])
    rng = np.random.default_rng([seed, k])
    positions = rng.normal(size=(count, 3))
    positions[k % count] = np.nan
    hands = [wire.HandState("left", "circles", 0.25)]
    return wire.skeleton_frame(
        k, k * FRAME_NS, positions, rng.uniform(size=count), hands, (1.0, 0.0, 0.0, 0.0)
    )


def write_frames(writer: RawWriter, names: list[str], first: int, count: int) -> None:
    for k in range(first, first + count):
        for seed, name in enumerate(names):
            frame = message(k, seed)
            writer.frame(
                name,
                wire.encode(frame),
                arrival_ns=frame.device_time_ns + 5_000_000,
                device_time_ns=frame.device_time_ns,
                sequence=k,
            )
        writer.event(k * FRAME_NS, {"type": "tick", "stage_time_ns": k * FRAME_NS})


def recorded_take(path: Path, names: list[str], count: int) -> Take:
    """A finished take of `count` frames per camera."""
    take = Take.create(path, session="day", name="take_001", source="live")
    with RawWriter(take.raw_path) as writer:
        for name in names:
            writer.add_camera(hello(name))
            take.add_camera(hello(name))
        write_frames(writer, names, 0, count)
    take.meta["recording"] = "done"
    take.save_meta()
    return take


def joints_header() -> list[str]:
    return ["time_s", *(f"{name}_{part}" for name in CANONICAL for part in ("x", "y", "z", "confidence"))]


def joints_rows(count: int, start_s: float = 0.0) -> list[list[str]]:
    rng = np.random.default_rng(1)
    rows = []
    for k in range(count):
        values = np.concatenate(
            [rng.normal(size=(JOINT_COUNT, 3)), rng.uniform(size=(JOINT_COUNT, 1))], axis=1
        )
        rows.append([f"{start_s + k / 30:.5f}", *(f"{v:.4f}" for v in values.ravel())])
    return rows


def write_csv(file: Path, header: list[str], rows: list[list[str]]) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
    return file
