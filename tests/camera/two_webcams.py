"""Processor time of two webcams and their studio on one machine: `.venv/bin/python -m tests.camera.two_webcams`.

The real program and two real clients, each with a real video (720 x 1280, 30 Hz) as its webcam. What else the machine
does changes how many frames are read, but hardly what each of them costs.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path

import av

from tests.acceptance.processes import wait_until
from tests.acceptance.program import studio_program
from tests.patient import Client

SIZE = (720, 1280)
ASKED_HZ = 15.0
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


def as_webcam(video: Path, out: Path) -> Path:
    """Write every second picture of a video of 60 Hz, 720 x 1280."""
    with av.open(str(video)) as source, av.open(str(out), "w") as file:
        stream = file.add_stream("libx264", rate=Fraction(30), options={"preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for number, frame in enumerate(source.decode(video=0)):
            if number % 2 == 0:
                picture = frame.reformat(*SIZE, "yuv420p").to_ndarray()
                file.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "yuv420p")))
        file.mux(stream.encode(None))
    return out


def spent_s(pid: int) -> float:
    """Return the processor time of a process and all that it started [s]."""
    own = 0.0
    for task in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = task.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(task.parent.name) == pid:
            own += (int(fields[11]) + int(fields[12])) * _TICK_S
        elif int(fields[1]) == pid:
            own += spent_s(int(task.parent.name))
    return own


def main() -> None:
    """Print what a frame costs the client, what the studio takes, and what two webcams need at 15 Hz."""
    parser = argparse.ArgumentParser(prog="python -m tests.camera.two_webcams", description=__doc__)
    parser.add_argument(
        "--data", type=Path, default=Path(os.environ.get("STUDIO_TEST_DATA", "../shared/data"))
    )
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--options", default="", help="of the source, such as &no-hands or &model=lite")
    chosen = parser.parse_args()
    videos = chosen.data / "rgb" / "pose2sim_single"
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        host = stack.enter_context(studio_program(folder / "sessions", ("serve",)))
        api = stack.enter_context(Client(base_url=f"http://{host}/api/v1"))
        clients = []
        for name, camera in (("left", "cam01"), ("right", "cam03")):
            video = as_webcam(videos / f"{camera}.mp4", folder / f"{name}.mp4")
            source = f"video:{video}{('?' + chosen.options.lstrip('&')) if chosen.options else ''}"
            words = ["camera", "--source", source, "--name", name, "--server", f"http://{host}"]
            clients.append(subprocess.Popen([sys.executable, "-m", "studio", *words]))
            stack.callback(clients[-1].wait)
            stack.callback(clients[-1].terminate)
        (server,) = (int(p) for p in _children(os.getpid()) if int(p) not in {c.pid for c in clients})

        def received() -> list[int]:
            return [one["frames"] for one in api.get("/status").json()["cameras"].values()]

        wait_until(lambda: len(received()) == 2 and min(received()) > 30, "two webcams send")
        before, began = (received(), [spent_s(c.pid) for c in clients], spent_s(server)), time.monotonic()
        time.sleep(chosen.seconds)
        after, seconds = (
            (received(), [spent_s(c.pid) for c in clients], spent_s(server)),
            time.monotonic() - began,
        )
    frames = [b - a for a, b in zip(before[0], after[0], strict=True)]
    client_ms = [1e3 * (b - a) / n for a, b, n in zip(before[1], after[1], frames, strict=True)]
    server_s = (after[2] - before[2]) / seconds
    needed = 2 * ASKED_HZ * sum(client_ms) / 2e3 + server_s
    print(f"{seconds:.0f} s: {[round(n / seconds, 1) for n in frames]} frames a second")
    print(
        f"clients: {[round(ms, 1) for ms in client_ms]} ms of processor time a frame; studio: {server_s:.2f} cores"
    )
    print(f"two webcams at {ASKED_HZ:.0f} Hz and their studio need {needed:.2f} cores")


def _children(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


if __name__ == "__main__":
    main()
