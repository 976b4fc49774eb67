"""`python -m tests.web.view_cost [SECONDS]`: what the 3D view costs the real server: no browser, 1 and 4 browsers.

Starts the real program with its simulated stage, waits for its calibration, and connects programs that take the
view's messages as fast as they come, as a browser on a fast machine does. Prints shares of a core, and how old poses
are when their message comes: the server stamps them on its monotonic clock, which is this program's too.
"""

import asyncio
import sys
import tempfile
import time
from pathlib import Path

import msgspec
import numpy as np
import viser
import zstandard
from websockets.asyncio.client import connect

from studio.web.scene.drawing import CLOCK_NODE
from tests import patient
from tests.acceptance.program import studio_program

CALIBRATED_S = 180.0
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [0.0, -5.0, 1.0], "fov": 0.6,
    "near": 0.1, "far": 100.0, "image_height": 720, "image_width": 1280, "look_at": [0.0, 0.0, 1.0],
    "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip


async def browser(host: str, received: list[int], ages_ms: list[float], until_s: float) -> None:
    """Take the view's messages until a time; add to their count and bytes, and to the ages of poses [ms]."""
    address = f"ws://{host}/viewer"
    protocol = f"viser-v{viser.__version__}"
    async with connect(
        address, subprotocols=[protocol], origin=f"http://{host}", max_size=None, compression=None
    ) as socket:
        await socket.send(msgspec.msgpack.encode(CAMERA))
        while time.monotonic() < until_s:
            message = await asyncio.wait_for(socket.recv(), 5.0)
            came_s = time.monotonic()
            captured_s = captured(message)
            if captured_s is not None:
                ages_ms.append(1e3 * (came_s - captured_s))
            received[0] += 1
            received[1] += len(message)


def captured(message: bytes) -> float | None:
    """When the newest pose of one of viser's messages was captured, on the server's clock [s]."""
    size = int.from_bytes(message[8:16], "little")
    content = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(message[16 : 16 + size]))
    times = [one["position"][0] for one in content["messages"]
             if one["type"] == "SetPositionMessage" and one["name"] == CLOCK_NODE]  # fmt: skip
    return times[-1] if times else None


def cpu_s(pid: int) -> float:
    """CPU time that a process has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


async def measure(host: str, pid: int, browsers: int, seconds: float) -> tuple[float, str]:
    """Return the server's share of a core, and in words what each browser got."""
    received, ages_ms = [0, 0], list[float]()
    settle_s = 3.0
    end_s = time.monotonic() + settle_s + seconds
    tasks = [asyncio.create_task(browser(host, received, ages_ms, end_s + 0.5)) for _ in range(browsers)]
    await asyncio.sleep(settle_s)
    received[:] = [0, 0]
    ages_ms.clear()
    begin_s, begin_cpu_s = time.monotonic(), cpu_s(pid)
    await asyncio.sleep(seconds)
    passed_s = time.monotonic() - begin_s
    share = (cpu_s(pid) - begin_cpu_s) / passed_s
    count, size = (number / passed_s / max(browsers, 1) for number in received)
    await asyncio.gather(*tasks)
    if not ages_ms:
        return share, "nothing is sent"
    median, p95 = np.percentile(ages_ms, [50, 95])
    return (
        share,
        f"{count:.0f} messages, {size / 1e3:.0f} kB a second; latency {median:.0f} ms, p95 {p95:.0f} ms",
    )


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        sessions = Path(folder) / "sessions"
        sessions.mkdir()
        with studio_program(sessions) as host:
            end_s = time.monotonic() + CALIBRATED_S
            while patient.get(f"http://{host}/api/v1/status").json()["calibration"]["state"] != "good":
                assert time.monotonic() < end_s, "the simulated stage was not calibrated in time"
                time.sleep(1.0)
            pid = server_pid(host)
            for browsers in (0, 1, 4, 0):
                share, words = asyncio.run(measure(host, pid, browsers, seconds))
                print(f"{browsers} browsers: {100 * share:.1f} % of a core; {words}", flush=True)


def server_pid(host: str) -> int:
    """The process that listens on the host's port."""
    port = int(host.rsplit(":")[-1])
    lines = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    inode = next(line[9] for line in lines if int(line[1].split(":")[1], 16) == port and line[3] == "0A")
    for process in Path("/proc").glob("[0-9]*"):
        for file in process.glob("fd/*"):
            try:
                if file.readlink() == Path(f"socket:[{inode}]"):
                    return int(process.name)
            except OSError:
                continue
    raise RuntimeError(f"no process listens on port {port}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 15.0)
