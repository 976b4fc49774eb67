"""The real program's sockets, and where the code opens connections."""

import ast
import socket
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import WebSocketException

import studio
from tests.patient import connect

PACKAGE = Path(studio.__file__).parent
LOOPBACK = {"127.0.0.1", "::1"}

MAY_CONNECT = {
    "api/cameras/announced.py": "a camera that announced itself, once an operator typed its code; hears mDNS",
    "camera/waiting/wait.py": "announces a camera by mDNS, where its operator asked for it",
    "server/certificate.py": "asks the system for this machine's own name; nothing is sent",
    "api/address.py": "asks the system for this machine's own address; nothing is sent",
    "camera/client/link.py": "a camera's link to the server that its operator named",
    "camera/client/video_sender.py": "brings the camera's videos to the same server; follows no redirect",
    "web/proxy.py": "viser, on the loopback",
    "web/view.py": "a free port on the loopback",
    "server/listening.py": "the server's own socket",
    "server/run.py": "answers on that socket",
    "streams/channel.py": "live output by UDP, to the machines that an operator named",
    "timecode/sources.py": "hears timecode by UDP where an operator chose it; sends nothing",
    "rigid_bodies/sources.py": "hears rigid bodies by UDP once switched on; asks the NatNet server that was named",
    "triggers/listeners.py": "hears triggers by UDP once an operator switched them on; OSC's are answered",
    "triggers/tellers.py": "tells the machines and addresses that an operator named of recordings",
    "offline/batch/run.py": "the Dask scheduler that the command line names",
}
CONNECTING = {
    "socket", "urllib.request", "http.client", "httpx", "requests", "aiohttp", "ftplib", "smtplib",
    "websockets.sync.client", "websockets.asyncio.client", "distributed", "pythonosc.udp_client", "zeroconf",
}  # fmt: skip


WORDS = {name.rpartition(".")[2] for name in CONNECTING}
"""A file that imports one of `CONNECTING` has one of these in its text."""


def connecting(path: Path) -> set[str]:
    """Which of `CONNECTING` a file imports, inside functions too."""
    text = path.read_text(encoding="utf-8")
    return imported(text) & CONNECTING if any(word in text for word in WORDS) else set()


def imported(text: str) -> set[str]:
    """Full names of the modules that a text imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_nothing_else_opens_connections():
    """No request can make the server fetch an address (SSRF): few modules could, and none takes one from a file."""
    found = {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py") if connecting(path)}
    assert found == set(MAY_CONNECT)


def test_the_guard_notices(tmp_path):
    file = tmp_path / "x.py"
    file.write_text("def f():\n    from urllib import request\n    request.urlopen('http://x')\n")
    assert connecting(file)


@pytest.mark.parametrize(
    ("host", "open_"), [("127.0.0.1", 0), ("0.0.0.0", 1)], ids=["loopback", "open to the network"]
)
def test_one_socket_is_open_to_the_network_and_viser_s_is_not(tmp_path, host, open_):
    command = [sys.executable, "-m", "studio", "serve", "--host", host, "--port", "0", "--demo"]
    with subprocess.Popen(
        [*command, "--sessions", str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as program:
        try:
            port = int(program.stdout.readline().split(" (")[0].rsplit(":", 1)[1])
            listening = sockets_of(program.pid)
            assert (host, port) in listening
            outside = [(address, number) for address, number in listening if address not in LOOPBACK]
            assert outside == [(host, port)] * open_
            inside = [number for address, number in listening if address in LOOPBACK and number != port]
            assert len(inside) == 1, "viser's own"
            for address in addresses():
                with pytest.raises(OSError), socket.create_connection((address, inside[0]), timeout=2):
                    pass
            if open_:  # nor through the proxy without signing in
                with (
                    pytest.raises(WebSocketException),
                    connect(f"ws://127.0.0.1:{port}/viewer", origin=f"http://127.0.0.1:{port}") as viewer,
                ):
                    viewer.recv(timeout=60)
        finally:
            program.terminate()
            program.wait(timeout=60)


HANDLERS = (
    "on_click",
    "on_update",
    "on_pointer_event",
    "on_scene_click",
    "on_rect_select",
    "add_button",
    "on_drag",
)


def test_the_3d_view_listens_to_nobody():
    """Whoever reaches viser sees the stage and controls nothing: no handler of its messages changes any state.

    The gizmo counts how often it was dragged. Its edit is made by the operator's page over the API, and viewers'
    messages of it are not passed on (`tests/web/test_proxy.py`).
    """
    for path in (PACKAGE / "web").rglob("*.py"):
        if path.name == "gizmo.py":
            continue
        used = {
            node.attr
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Attribute)
        }
        assert not used & set(HANDLERS), path.name


def sockets_of(pid: int) -> list[tuple[str, int]]:
    """Address and port of all TCP sockets on which a program and those it started listen.

    A program that is being started still holds the sockets of the one that starts it: each counts once.
    """
    program = psutil.Process(pid)
    found = [one for each in [program, *program.children(recursive=True)] for one in listening_on(each)]
    return list(dict.fromkeys(found))


def listening_on(program: psutil.Process) -> list[tuple[str, int]]:
    """Address and port of the TCP sockets on which one program listens; none once it has ended."""
    try:
        connections = program.net_connections("tcp")
    except psutil.NoSuchProcess:  # it was a helper of a moment, such as one that looks for a library
        return []
    return [(one.laddr.ip, one.laddr.port) for one in connections if one.status == psutil.CONN_LISTEN]


def test_a_program_that_has_ended_listens_on_nothing():
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        program = psutil.Process(ended.pid)
        ended.wait()
    assert listening_on(program) == []


def addresses() -> list[str]:
    """This machine's own addresses on networks."""
    found = [
        one.address for many in psutil.net_if_addrs().values() for one in many if one.family == socket.AF_INET
    ]
    return [address for address in found if address not in LOOPBACK]
