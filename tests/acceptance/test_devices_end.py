"""Camera clients that a click started end with a server that is killed; `test_preview.py` has its ordinary end."""

from pathlib import Path

import psutil

from tests.acceptance.processes import ServerProcess, server_process, wait_until


def connect(server: ServerProcess) -> list[psutil.Process]:
    """Connect a device; return its client's process and that process's children."""

    def found() -> str:
        devices = server.http.get("/devices").json()["devices"]
        return next((one["id"] for one in devices if one["source"] == "simulated-depth:0/2"), "")

    server.http.post("/devices/search").raise_for_status()
    device = wait_until(found, "the device is found")
    server.http.post(f"/devices/{device}/connect", json={"name": "left"}).raise_for_status()
    assert server.process is not None
    program = psutil.Process(server.process.pid)

    def is_client(process: psutil.Process) -> bool:
        try:
            return "left" in process.cmdline()
        except psutil.NoSuchProcess:  # another process ended meanwhile
            return False

    def running() -> list[psutil.Process]:
        clients = [one for one in program.children() if is_client(one)]
        return [each for one in clients if (parts := one.children()) for each in (one, *parts)]

    return wait_until(running, "the client and its tracker run")


def test_no_client_outlives_a_killed_server(tmp_path: Path) -> None:
    with server_process(tmp_path / "sessions") as server:
        processes = connect(server)
        assert len(processes) >= 2
        server.kill()
        check_ended(processes)


def check_ended(processes: list[psutil.Process]) -> None:
    """Wait until the client and its tracker have ended."""
    psutil.wait_procs(processes)
    assert not any(one.is_running() for one in processes)
