"""A client in another language, written from docs/protocol.md: its link is lost, and kept frames come late."""

import json
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from studio.take.raw.frames import RawFrame, inspect_raw, read_raw
from tests.acceptance.processes import check_nothing_lost, server_process, wait_until

SECONDS = 12


def test_a_client_in_another_language(tmp_path: Path) -> None:
    if shutil.which("node") is None:
        pytest.skip("no Node on this machine")
    client = Path(__file__).with_name("client.mjs")
    with server_process(tmp_path / "sessions") as server:
        command = ["node", str(client), "127.0.0.1", str(server.port), "other", str(SECONDS)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            wait_until(lambda: server.live_cameras() == 1, "it sends")
            camera = server.status()["cameras"]["other"]
            assert camera["device"] == "Node" and camera["connected"]
            path = server.record("other")
            time.sleep(4.0)
            wait_until(
                lambda: server.status()["cameras"]["other"]["clock"]["source"] == "exchange",
                "clocks are exchanged",
            )
            server.stop()
            out, _ = process.communicate(timeout=60)
        assert process.returncode == 0
        said = json.loads(out)
        wait_until(lambda: inspect_raw(path / "raw.mcap").complete, "the take is whole")
    frames = [r for r in read_raw(path / "raw.mcap") if isinstance(r, RawFrame)]
    assert check_nothing_lost(path / "raw.mcap") >= 60
    assert (
        sum(frame.late for frame in frames) >= 6
        and said["kept"] == 0
        and said["late"] >= 20
        and said["links"] == 2
    )
