"""Devices are found without being opened, each kind by itself; pictures of them; no process of the search remains."""

import io
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from PIL import Image

from studio.camera.devices.plugged import camera_name, seen_without_library, usb_devices, video_devices
from studio.camera.finding import search
from studio.camera.finding.search import FoundKind, Search, ShortProcess, picture_by
from studio.camera.sources.registry import SOURCES
from studio.engine.base.errors import NotAvailableError, StudioError
from studio.engine.base.sentences import Said, say

KINDS = [kind for kind, one in SOURCES.items() if one.found]


def found(kinds: list[str] | None = None) -> dict[str, FoundKind]:
    told: list[FoundKind] = []
    Search(kinds).run(told.append)
    assert len(told) == len({one.kind for one in told})
    return {one.kind: one for one in told}


def wait(condition: Callable[[], bool]) -> None:
    while not condition():
        time.sleep(0.05)


def test_every_kind_answers_for_itself() -> None:
    told = found()
    assert list(told) == [*KINDS[1:], "simulated-depth"] and KINDS[0] == "simulated-depth"
    first, second = told["simulated-depth"].devices
    assert (first.source, second.source) == ("simulated-depth:0/2", "simulated-depth:1/2")
    assert isinstance(first.device, Said) and first.device.code == "device.simulated_depth"
    for kind, one in told.items():
        assert not (one.problem and one.devices), kind
    missing = told["azure-kinect"].problem  # no SDK of the system on the machines of the tests
    assert "uv sync --extra azure-kinect" in missing


def test_a_library_that_crashes_hides_only_its_own_devices(paper_sdks: Path) -> None:
    told = found(["openni", "realsense"])
    assert told["openni"].problem.startswith("source openni: its library broke off")
    (camera,) = told["realsense"].devices
    assert (camera.source, camera.device, camera.serial) == ("realsense:A1234567", "Paper D435", "A1234567")
    assert camera.name == "realsense_234567" and camera.needs == ""


def test_a_library_that_hangs_is_left_after_a_time(
    paper_sdks: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search, "_KIND_S", 3.0)
    assert "did not answer" in found(["orbbec"])["orbbec"].problem


def test_a_search_is_ended_from_outside(paper_sdks: Path) -> None:
    told: list[FoundKind] = []
    hanging = Search(["realsense", "orbbec", "webcam"])
    thread = threading.Thread(target=hanging.run, args=(told.append,))
    thread.start()
    wait(lambda: len(told) == 1)
    hanging.end()
    thread.join()
    assert [one.kind for one in told] == ["realsense"]


def test_a_picture_of_a_depth_camera() -> None:
    png = picture_by(ShortProcess("picture", "simulated-depth:0/2"))
    picture = Image.open(io.BytesIO(png))
    assert picture.format == "PNG" and max(picture.size) <= 480
    assert len(picture.getcolors(1 << 20)) > 20


@pytest.mark.parametrize(
    ("source", "code", "words"),
    [
        ("simulated:0/2", "picture.skeletons", "gives skeletons"),
        ("openni", "picture.broke_off", "broke off"),
        ("realsense", None, "gives no depth"),
        ("nonsense", None, "unknown source"),
    ],
)
def test_without_a_picture_it_is_said_why(
    paper_sdks: Path,
    source: str,
    code: str | None,
    words: str,
) -> None:
    with pytest.raises(StudioError, match=words) as error:
        picture_by(ShortProcess("picture", source))
    assert code is None or error.value.code == code


PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, "-P", "-m", *[one.replace("PARENT", str(os.getpid())) for one in sys.argv[1:]]])
sys.stdin.read()
"""


@pytest.mark.parametrize(
    "command",
    [
        ("studio.camera.finding.child", "PARENT", "list", "orbbec"),
        ("studio", "camera", "--source", "orbbec", "--parent", "PARENT"),
    ],
    ids=["a search", "a client"],
)
def test_what_hangs_in_a_library_ends_with_a_killed_program(
    paper_sdks: Path,
    command: tuple[str, ...],
) -> None:
    with subprocess.Popen([sys.executable, "-c", PARENT, *command], stdin=subprocess.PIPE) as parent:
        children: list[psutil.Process] = []
        wait(lambda: bool(children.extend(psutil.Process(parent.pid).children()) or children))
        wait((paper_sdks / "hangs").exists)
        parent.kill()
    gone, _ = psutil.wait_procs(children)
    assert gone == children


def usb(folder: Path, place: str, vendor: str, product: str, name: str = "", serial: str = "") -> None:
    entry = folder / place
    entry.mkdir(parents=True)
    for file, text in (("idVendor", vendor), ("idProduct", product), ("product", name), ("serial", serial)):
        if text:
            (entry / file).write_text(text + "\n")


def test_devices_without_their_library_are_seen_on_the_bus(tmp_path: Path) -> None:
    usb(tmp_path, "usb1", "1d6b", "0002", "xHCI Host Controller")
    usb(tmp_path, "1-1", "8086", "0b07", "Intel(R) RealSense(TM) Depth Camera 435", "0123456789")
    usb(tmp_path, "1-2", "8086", "0033", "Bluetooth")
    usb(tmp_path, "2-1", "045e", "097C", "Azure Kinect Depth Camera")
    usb(tmp_path, "2-2", "045e", "02c4")
    usb(tmp_path, "2-3", "2bc5", "0669", "Femto Bolt", "CL8")
    usb(tmp_path, "2-4", "2bc5", "0401", "Astra")
    (tmp_path / "3-1").mkdir()
    assert [one.kind() for one in usb_devices(tmp_path)] == [
        "realsense", "", "azure-kinect", "kinect-v2", "orbbec", "openni", "",
    ]  # fmt: skip
    missing = NotAvailableError(say("test.missing", "install it"))
    (seen,) = seen_without_library("realsense", missing, tmp_path)
    assert seen.device == "Intel(R) RealSense(TM) Depth Camera 435" and seen.needs == "install it"
    assert (seen.source, seen.name, seen.serial) == ("realsense", "realsense_456789", "0123456789")
    (seen,) = seen_without_library("kinect-v2", missing, tmp_path)
    assert (seen.device, seen.name) == ("kinect-v2", "kinect-v2_0")
    with pytest.raises(NotAvailableError, match="install it"):
        seen_without_library("realsense", missing, tmp_path / "nothing")


def test_webcams_are_listed_once_and_without_depth_cameras(tmp_path: Path) -> None:
    for number, name, index in (
        (0, "HD Webcam", 0),
        (1, "HD Webcam", 1),
        (2, "Intel RealSense 435", 0),
        (4, "", 0),
    ):
        entry = tmp_path / f"video{number}"
        entry.mkdir()
        (entry / "name").write_text(name + "\n")
        (entry / "index").write_text(f"{index}\n")
    assert video_devices(tmp_path) == [(0, "HD Webcam"), (4, "video4")]
    assert video_devices(tmp_path / "nothing") == []


@pytest.mark.parametrize(
    ("which", "name"), [("é/../x 12", "realsense_x12"), ("", "realsense"), ("7", "realsense_7")]
)
def test_names_of_cameras(which: str, name: str) -> None:
    assert camera_name("realsense", which) == name
