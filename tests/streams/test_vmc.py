"""VMC as a program not written here receives it: `oscdump` of liblo prints what it hears."""

import shutil
import socket
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.joints import OUTPUT_PARENTS
from studio.streams.sender import Sender
from studio.streams.targets import Target
from studio.streams.unity import UNITY_BONES, unity_pose
from studio.streams.vmc import MAX_DATAGRAM, VmcEncoder
from tests.streams.steps import step

FRAMES = 30


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def oscdump(tmp_path):
    """Port and output file of a running `oscdump`."""
    if shutil.which("oscdump") is None:
        pytest.skip("oscdump is not installed (Debian: apt install liblo-tools)")
    port, heard = free_udp_port(), tmp_path / "heard.txt"
    with heard.open("w") as file:
        program = subprocess.Popen(["oscdump", "-L", str(port)], stdout=file)
        yield port, heard
        program.terminate()
        program.wait()


def frames_of(text: str) -> list[list[list[str]]]:
    """The words of each complete line, by frame: a frame ends with its time."""
    frames: list[list[list[str]]] = [[]]
    for line in text.splitlines(keepends=True):
        if not line.endswith("\n"):
            break
        words = line.split()[1:]
        frames[-1].append(words)
        if words and words[0] == "/VMC/Ext/T":
            frames.append([])
    return frames[:-1]


def heard_frames(heard: Path, count: int, send_probe) -> list[list[list[str]]]:
    end = time.monotonic() + 60.0
    while len(frames := frames_of(heard.read_text())) < count:
        assert time.monotonic() < end, f"heard {len(frames)} of {count} frames"
        send_probe()
        time.sleep(0.05)
    return frames


def heard_until(heard: Path, time_s: float) -> list[list[list[str]]]:
    """All frames heard, once that of this time is the last."""
    end = time.monotonic() + 60.0
    while abs(float((frames := frames_of(heard.read_text()))[-1][-1][2]) - time_s) > 1e-3:
        assert time.monotonic() < end, f"heard {len(frames)} frames, not that of {time_s:.3f} s"
        time.sleep(0.005)
    return frames


def test_every_bone_of_every_frame_is_received_mirrored_and_in_metres(oscdump, motion):
    port, heard = oscdump
    sender = Sender(Target("a", "vmc", port=port), dict)
    heard_frames(heard, 1, lambda: sender.add(step(motion, 0)))  # until the receiver listens
    frames: list[list[list[str]]] = []
    for frame in range(1, FRAMES):
        sender.add(step(motion, frame))
        frames.append(heard_until(heard, motion.time_s[frame])[-1])
    assert frames_of(heard.read_text())[1 - FRAMES :] == frames  # each came once
    sender.close()
    assert (sender.status().dropped, sender.status().problem) == (0, "")
    for frame, messages in enumerate(frames, start=1):
        assert abs(float(messages[-1][2]) - motion.time_s[frame]) < 1e-4
        assert ["/VMC/Ext/OK", "i", "1"] in messages
        bones = {m[2].strip('"'): np.array(m[3:], float) for m in messages if m[0] == "/VMC/Ext/Bone/Pos"}
        assert set(bones) == set(UNITY_BONES)
        assert all(m[1] == "sfffffff" for m in messages if m[0] == "/VMC/Ext/Bone/Pos")
        positions, rotations = np.zeros((52, 3)), [Rotation.identity()] * 52
        for joint, parent in enumerate(OUTPUT_PARENTS):
            place, xyzw = np.split(bones[UNITY_BONES[joint]], [3])
            positions[joint], rotations[joint] = place, Rotation.from_quat(xyzw)
            if parent >= 0:
                positions[joint] = positions[parent] + rotations[parent].apply(place)
                rotations[joint] = rotations[parent] * rotations[joint]
        stage = motion.positions_m[frame]
        expected = np.column_stack([-stage[:, 0], stage[:, 2], -stage[:, 1]])
        np.testing.assert_allclose(positions, expected, atol=2e-5)  # it prints six decimals


def test_datagrams_stay_whole_on_ethernet(motion):
    pose = unity_pose(1.0, motion.positions_m[0], motion.rotations_wxyz[0])
    datagrams = VmcEncoder().encode(pose)
    assert max(map(len, datagrams)) <= MAX_DATAGRAM
    assert all(datagram.startswith(b"#bundle\0") for datagram in datagrams)
