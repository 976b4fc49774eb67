"""The receivers in `examples/receivers` read what the senders send; Blender and C# are run if they are installed."""

import importlib.util
import json
import shutil
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from websockets.sync.server import serve

from studio.engine.model.joints import OUTPUT_JOINTS
from studio.engine.timecode.timecode import RATES, Timecode
from studio.streams import Member
from studio.streams.frames import frame_message, head_message
from studio.streams.sender import Sender
from studio.streams.targets import Target
from tests.streams.steps import step

RECEIVERS = Path(__file__).parents[2] / "examples" / "receivers"
BLENDER = Path(__file__).parents[2] / ".tools" / "readers" / "blender" / "bin" / "python"
CODE = Timecode(90_001, RATES["25"])

CSHARP = """
using System; using System.Globalization; using System.Net; using System.Net.Sockets; using CaptureStudio;
class Program { static void Main() {
  var reader = new VmcReader(); var data = new byte[65536];
  var channel = new Socket(AddressFamily.InterNetwork, SocketType.Dgram, ProtocolType.Udp);
  channel.Bind(new IPEndPoint(IPAddress.Loopback, 0));
  Console.WriteLine(((IPEndPoint)channel.LocalEndPoint).Port); Console.Out.Flush();
  while (!reader.Feed(data, channel.Receive(data))) { }
  VmcBone arm = reader.Bones["LeftUpperArm"];
  Console.WriteLine(String.Format(CultureInfo.InvariantCulture, "{0} {1} {2} {3} {4} {5} {6} {7} {8}",
    reader.Bones.Count, reader.Timecode, reader.TimeS, reader.Refused, arm.X, arm.Qx, arm.Qy, arm.Qz, arm.Qw));
  for (int seed = 0; seed < 10000; seed++) {
    var random = new Random(seed); var bad = new byte[random.Next(0, 1400)]; random.NextBytes(bad);
    for (int k = 0; k < Math.Min(bad.Length, seed % 40); k++) bad[k] = data[k];
    reader.Feed(bad, bad.Length); }
  Console.WriteLine(reader.Bones.Count);
} }
"""


def module(name: str, monkeypatch) -> ModuleType:
    """An example as a module; it may import those beside it."""
    spec = importlib.util.spec_from_file_location(name, RECEIVERS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, made)
    spec.loader.exec_module(made)
    return made


def test_maya_s_and_motionbuilder_s_frames_are_the_stage_s(motion, monkeypatch):
    vmc = module("vmc", monkeypatch)
    reader = vmc.VmcReader()
    with vmc.listen(0) as channel:
        sender = Sender(Target("a", "vmc", port=channel.getsockname()[1]), dict)
        sender.add(replace(step(motion, 7), timecode=CODE))
        channel.settimeout(60.0)
        while (frame := reader.feed(channel.recv(65_536))) is None:
            pass
    sender.close()
    assert (frame.timecode, reader.refused) == (str(CODE), 0)
    assert frame.time_s == pytest.approx(motion.time_s[7], abs=1e-4)
    assert set(frame.bones) == set(OUTPUT_JOINTS)
    places, turns = {"": np.zeros(3)}, {"": Rotation.identity()}
    for name in vmc.NAMES.values():
        bone, parent = frame.bones[name], vmc.parent_of(name)
        turns[name] = turns[parent] * Rotation.from_euler(
            "xyz", vmc.euler_xyz_deg(bone.rotation_wxyz), degrees=True
        )
        places[name] = places[parent] + turns[parent].apply(bone.position_cm)
    stage = motion.positions_m[7]
    expected = np.column_stack([stage[:, 0], stage[:, 2], -stage[:, 1]]) * 100
    np.testing.assert_allclose([places[name] for name in OUTPUT_JOINTS], expected, atol=2e-3)


def test_a_hostile_datagram_is_counted_and_changes_nothing(motion, monkeypatch):
    vmc = module("vmc", monkeypatch)
    reader, random = vmc.VmcReader(), np.random.default_rng(3)
    for size in random.integers(0, 200, 5000):
        reader.feed(random.bytes(size))
        reader.feed(b"#bundle\0" + random.bytes(size))
    assert reader.refused > 7500 and not reader._bones


def test_unity_s_parsing_reads_the_sender(motion, tmp_path):
    if shutil.which("mcs") is None or shutil.which("mono") is None:
        pytest.skip("mono is not installed (Debian: apt install mono-mcs mono-runtime)")
    (tmp_path / "Program.cs").write_text(CSHARP, encoding="utf-8")
    program = tmp_path / "program.exe"
    files = [tmp_path / "Program.cs", RECEIVERS / "unity" / "Vmc.cs"]
    subprocess.run(["mcs", f"-out:{program}", *files], check=True, capture_output=True)
    with subprocess.Popen(["mono", program], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        sender = Sender(Target("a", "vmc", port=int(running.stdout.readline())), dict)
        sender.add(replace(step(motion, 7), timecode=CODE))
        count, timecode, time_s, refused, x, *turn = running.stdout.readline().split()
        sender.close()
        assert (count, timecode, refused) == ("52", str(CODE), "0")
        assert float(time_s) == pytest.approx(motion.time_s[7], abs=1e-4)
        assert float(x) == pytest.approx(-0.15, abs=1e-4)  # the left arm stands at -x of Unity
        assert sum(float(one) ** 2 for one in turn) == pytest.approx(1.0, abs=1e-4)
        assert int(running.stdout.readline()) <= 128


@pytest.fixture
def stream(motion):
    """The address of a WebSocket that sends the studio's own messages of 20 frames."""

    def send(connection) -> None:
        connection.send(head_message())
        for frame in range(20):
            connection.send(frame_message([(replace(step(motion, frame), timecode=CODE), Member("", None))]))

    with serve(send, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}/api/v1/stream?rate_hz=60"
        server.shutdown()


def test_the_websocket_is_read_with_python_alone(stream, motion, monkeypatch):
    reading = module("stream", monkeypatch)
    head, *frames = map(reading.read, reading.Stream(stream).texts())
    assert tuple(head.names) == OUTPUT_JOINTS and len(frames) == 20
    np.testing.assert_allclose(frames[7][0].positions_m, motion.positions_m[7], atol=1e-5)
    assert frames[7][0].timecode == str(CODE)


READ_BLEND = """
import bpy, json, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
scene, armature = bpy.context.scene, bpy.data.objects["capture_studio"]
at = 1 + float(sys.argv[2]) * scene.render.fps / scene.render.fps_base
scene.frame_set(int(at), subframe=at % 1)
print(json.dumps({bone.name: list(bone.head) for bone in armature.pose.bones}))
"""


def test_blender_without_a_window_keeps_the_stream_as_keys(stream, motion, tmp_path):
    if not BLENDER.is_file():
        pytest.skip("Blender is not installed (tests/fetch_readers.sh)")
    out = tmp_path / "live.blend"
    words = [BLENDER, RECEIVERS / "for_blender.py", "--", stream, "--frames", "20", "--out", out]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "20 frames" in done.stdout, done.stderr
    later_s = motion.time_s[12] - motion.time_s[0]
    told = subprocess.run(
        [BLENDER, "-c", READ_BLEND, out, str(later_s)], capture_output=True, text=True, check=True
    )
    heads = json.loads(next(line for line in told.stdout.splitlines() if line.startswith("{")))
    np.testing.assert_allclose(
        [heads[name] for name in OUTPUT_JOINTS], motion.positions_m[12], atol=2e-4
    )  # keys stand between whole frames, and are read there
