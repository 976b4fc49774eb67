"""Depth in takes: written, read back without holding a take in memory, recovered, and imported from PNG folders."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.frames import ClockModel
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.raw.depth import DepthRecording, depth_cameras, depth_frames
from studio.take.raw.frames import RawDepth, RawWriter, camera_frames, inspect_raw, read_raw
from studio.take.upkeep.doctor import check_take
from tests.refused import refused
from tests.take.helpers import FRAME_NS, hello, joints_header, joints_rows, write_csv, write_frames

INTRINSICS = wire.Intrinsics(50.0, 51.0, 19.5, 14.5, 40, 30, (0.1, -0.05, 0.0, 0.0))


def image(seed: int, k: int) -> np.ndarray:
    return np.random.default_rng([seed, k]).integers(0, 9000, (30, 40)).astype(np.uint16)


def depth_hello(name: str, boot_id: str = "boot-1", width: int = 40) -> wire.Hello:
    intrinsics = wire.Intrinsics(50.0, 51.0, 19.5, 14.5, width, 30, INTRINSICS.distortion)
    return wire.Hello(1, name, "test camera", "canonical", boot_id, intrinsics=intrinsics)


def write_depth(writer: RawWriter, name: str, seed: int, numbers: range) -> None:
    for k in numbers:
        message = wire.depth_image(k, k * FRAME_NS + seed, image(seed, k))
        writer.depth(
            name,
            wire.encode(message),
            arrival_ns=k * FRAME_NS + 9_000_000,
            device_time_ns=message.device_time_ns,
            sequence=k,
        )


def depth_take(path: Path, count: int) -> Take:
    """Two cameras with depth and skeletons; the second one's images came late and partly twice."""
    take = Take.create(path, session="day", name="take_001", source="live")
    with RawWriter(take.raw_path) as writer:
        for name in ("camera_0", "camera_1"):
            writer.add_camera(depth_hello(name))
            take.add_camera(depth_hello(name))
        write_frames(writer, ["camera_0", "camera_1"], 0, count)
        write_depth(writer, "camera_0", 0, range(count))
        writer.flush()
        write_depth(writer, "camera_1", 1, range(count // 2, count))
        write_depth(writer, "camera_1", 1, range(count // 2 + 2))
    take.meta["recording"] = "done"
    take.save_meta()
    return take


def test_depth_comes_back_in_order_of_time_and_once(tmp_path: Path) -> None:
    take = depth_take(tmp_path / "take", 20)
    frames = list(depth_frames(take.raw_path))
    assert [(f.device_time_ns, f.camera) for f in frames] == [
        (k * FRAME_NS + seed, f"camera_{seed}") for k in range(20) for seed in (0, 1)
    ]
    for frame in frames:
        np.testing.assert_array_equal(frame.depth_mm, image(int(frame.camera[-1]), frame.sequence))
    assert depth_cameras(take.raw_path)["camera_1"] == DepthCamera(
        50.0, 51.0, 19.5, 14.5, 40, 30, INTRINSICS.distortion
    )
    assert len(camera_frames(take.raw_path)["camera_0"]) == 20
    raw = next(r for r in read_raw(take.raw_path) if isinstance(r, RawDepth))
    assert raw.camera == "camera_0" and raw.arrival_ns == 9_000_000
    np.testing.assert_array_equal(raw.frame().depth_mm, image(0, 0))


def test_depth_is_ordered_by_the_stage_clock_and_begins_where_asked(tmp_path: Path) -> None:
    recording = DepthRecording(depth_take(tmp_path / "take", 6).raw_path)
    ahead = {"camera_1": ClockModel(offset_ns=-2 * FRAME_NS)}
    order = [(f.camera, f.sequence) for f in recording.frames(clocks=ahead, start_ns=FRAME_NS)]
    assert order[:3] == [("camera_0", 1), ("camera_1", 3), ("camera_0", 2)]
    assert [f.sequence for f in recording.frames(["camera_1"])] == list(range(6))
    assert recording.times_ns("camera_0").tolist() == [k * FRAME_NS for k in range(6)]


def test_what_a_crash_leaves_of_depth_is_recovered(tmp_path: Path) -> None:
    take = depth_take(tmp_path / "take", 40)
    data = take.raw_path.read_bytes()
    take.raw_path.write_bytes(data[: int(len(data) * 0.6)])
    (finding,) = check_take(take.path)
    summary = inspect_raw(take.raw_path)
    assert finding.repaired and f"camera_0 {summary.depth_frames['camera_0']} depth images" in finding.action
    assert summary.complete and summary.depth_frames["camera_0"] == 40
    assert all(
        (f.depth_mm == image(0, f.sequence)).all() for f in DepthRecording(take.raw_path).frames(["camera_0"])
    )


def test_an_image_that_cannot_be_unpacked_or_has_another_size_is_left_out_and_told(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(depth_hello("a"))
        write_depth(writer, "a", 0, range(2))
        broken = wire.encode(wire.DepthImage(2, 2 * FRAME_NS, b"nothing"))
        writer.depth("a", broken, arrival_ns=0, device_time_ns=2 * FRAME_NS, sequence=2)
        writer.add_camera(depth_hello("a", "boot-2", width=41))
        write_depth(writer, "a", 0, range(5, 6))
    recording = DepthRecording(tmp_path / "raw.mcap")
    assert "other intrinsics" in (recording.problem or "")
    assert [f.sequence for f in recording.frames()] == [0, 1]
    with RawWriter(tmp_path / "none.mcap") as writer:
        writer.add_camera(hello("b"))
        with pytest.raises(KeyError):
            writer.depth("b", b"", arrival_ns=0, device_time_ns=0, sequence=0)
    assert depth_cameras(tmp_path / "none.mcap") == {}


def test_images_of_a_client_that_was_started_again_are_on_its_last_clock(tmp_path: Path) -> None:
    clock = {"type": "clock", "camera": "a", "drift_ppm": 0.0, "reference_ns": 0}
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(depth_hello("a"))
        writer.event(0, clock | {"clock_id": "boot-1", "offset_ns": 5 * FRAME_NS})
        write_depth(writer, "a", 0, range(3))
        writer.add_camera(depth_hello("a", "boot-2"))
        writer.event(0, clock | {"clock_id": "boot-2", "offset_ns": 9 * FRAME_NS})
        write_depth(writer, "a", 0, range(4, 7))
    times = [(f.sequence, f.device_time_ns) for f in DepthRecording(tmp_path / "raw.mcap").frames()]
    assert times == [(k, (k - 4) * FRAME_NS) for k in range(3)] + [(k, k * FRAME_NS) for k in range(4, 7)]


def png_camera(folder: Path, seed: int, count: int, **changes: object) -> Path:
    (folder / "depth").mkdir(parents=True)
    lines = []
    for k in range(count):
        Image.fromarray(image(seed, k)).save(folder / "depth" / f"{k}.png")
        lines.append(f"{k / 30 + 0.001 * seed:.5f} depth/{k}.png")
    (folder / "depth.txt").write_text("\n".join(lines) + "\n")
    about = {
        "sensor": "test",
        "width": 40,
        "height": 30,
        "fx": 50,
        "fy": 51,
        "cx": 19.5,
        "cy": 14.5,
        "fps": 30,
    }
    (folder / "camera.json").write_text(json.dumps(about | changes))
    return folder


def test_folders_of_png_and_of_joints_become_one_take(tmp_path: Path) -> None:
    png_camera(tmp_path / "in" / "camera_0", 0, 5)
    png_camera(tmp_path / "in" / "camera_1", 1, 5, depth_unit_m=0.002)
    write_csv(tmp_path / "in" / "camera_1" / "joints.csv", joints_header(), joints_rows(4, start_s=0.001))
    (tmp_path / "in" / "camera_0" / "depth" / "3.png").write_bytes(b"\x89PNG\r\n")
    take = import_recording(tmp_path / "in", tmp_path / "take")
    assert "camera_0: 1 of 5 images left out" in take.meta["notes"] and "3.png" in take.meta["notes"]
    assert take.meta["cameras"][0]["intrinsics"]["width"] == 40
    summary = inspect_raw(take.raw_path)
    assert summary.depth_frames == {"camera_0": 4, "camera_1": 5} and summary.frames == {
        "camera_0": 0,
        "camera_1": 4,
    }
    by_camera = {
        name: [f for f in depth_frames(take.raw_path) if f.camera == name] for name in take.camera_names
    }
    np.testing.assert_array_equal(by_camera["camera_0"][2].depth_mm, image(0, 2))
    np.testing.assert_array_equal(by_camera["camera_1"][2].depth_mm, image(1, 2) * 2)
    joints = {f.device_time_ns: f.sequence for f in camera_frames(take.raw_path)["camera_1"]}
    assert [joints.get(f.device_time_ns, f.sequence) for f in by_camera["camera_1"]] == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("file", "text", "code"),
    [
        ("camera.json", "{}", "import.camera_json"),
        ("camera.json", '{"width":40,"height":30,"fx":0,"fy":1,"cx":1,"cy":1}', "import.intrinsics_numbers"),
        ("depth.txt", "0.0 ../../../etc/passwd\n", "import.image_line"),
        ("depth.txt", "soon depth/0.png\n", "import.not_finite_number"),
        ("depth.txt", "\n", "import.no_image"),
        ("depth.txt", "0.0 depth/missing.png\n", "import.no_frame_readable"),
    ],
)
def test_a_broken_depth_folder_is_told(tmp_path: Path, file: str, text: str, code: str) -> None:
    png_camera(tmp_path / "in" / "camera_0", 0, 2)
    (tmp_path / "in" / "camera_0" / file).write_text(text)
    with refused(FormatError, code):
        import_recording(tmp_path / "in", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_intrinsics_must_fit_the_images(tmp_path: Path) -> None:
    png_camera(tmp_path / "in" / "camera_0", 0, 2, width=41)
    with refused(FormatError, "import.no_frame_readable"):
        import_recording(tmp_path / "in", tmp_path / "out")
