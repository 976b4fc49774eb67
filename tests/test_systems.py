"""The program is made for Linux, macOS and Windows: what only some systems have is called in one module."""

import ast
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import studio
from studio.camera.sources.config import DeviceConfig
from studio.camera.sources.registry import SOURCES

PACKAGE = Path(studio.__file__).parent
ONE_MODULE = "engine/base/system.py"
MODULES = {
    "fcntl",
    "resource",
    "termios",
    "tty",
    "pwd",
    "grp",
    "pty",
    "posix",
    "syslog",
    "crypt",
    "winreg",
    "msvcrt",
}
CALLS = {
    "os": {
        "fork", "forkpty", "getuid", "geteuid", "getgid", "setuid", "setgid", "setsid", "getpgid", "setpgid",
        "killpg", "nice", "sync", "uname", "chown", "fchown", "mkfifo", "getloadavg", "sysconf", "sched_setaffinity",
        "sched_getaffinity", "posix_fadvise", "posix_fallocate", "fdatasync", "pread", "pwrite", "wait", "waitpid",
        "statvfs", "O_DIRECTORY", "O_CLOEXEC", "O_NOFOLLOW", "umask", "getpriority", "setpriority",
    },
    "signal": {"SIGKILL", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGCHLD", "SIGPIPE", "alarm", "pause"},
    "socket": {"AF_UNIX", "SO_REUSEPORT", "socketpair"},
    "multiprocessing": {"get_start_method"},
}  # fmt: skip
PLACES = ("/proc/", "/dev/", "/sys/", "/tmp/", "/etc/", "/usr/", "/bin/", "/var/")


def nodes_of(source: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(source)))


@pytest.fixture(scope="module")
def sources() -> dict[Path, list[ast.AST]]:
    """The nodes of each file of the studio."""
    return {path: nodes_of(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py")}


def only_some_systems(nodes: list[ast.AST]) -> list[str]:
    """What a file uses that only some systems have: modules, calls, fixed places."""
    found = []
    documentation = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names if alias.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module] if node.module.split(".")[0] in MODULES else []
            found += [f"{node.module}.{a.name}" for a in node.names if a.name in CALLS.get(node.module, ())]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            found += [f"{node.value.id}.{node.attr}"] if node.attr in CALLS.get(node.value.id, ()) else []
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation:
            found += [node.value] if node.value.startswith(PLACES) else []
    return found


def test_nothing_else_is_of_some_systems_only(sources):
    found = {
        path.relative_to(PACKAGE).as_posix(): used
        for path, nodes in sources.items()
        if (used := only_some_systems(nodes))
    }
    assert set(found) == {ONE_MODULE}, found


@pytest.mark.parametrize(
    "line",
    ["import fcntl", "from os import fork", "import os; os.nice(1)", "def f():\n import resource",
     "import signal; signal.SIGKILL", "open('/proc/self/status')"],
)  # fmt: skip
def test_the_guard_notices(line):
    assert only_some_systems(nodes_of(line))


def test_files_are_read_and_written_as_utf_8(sources):
    """Windows has another encoding by default."""
    for path, nodes in sources.items():
        for node in nodes:
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                if node.func.attr in ("read_text", "write_text") and isinstance(
                    node.func.value, ast.Name | ast.BinOp
                ):
                    assert any(one.arg == "encoding" for one in node.keywords), f"{path}:{node.lineno}"


def test_it_is_imported_where_the_system_has_nothing(tmp_path):
    """As on Windows: without fcntl, resource, nice and affinity, everything is imported, and locks mark nothing."""
    code = """
        import os, sys
        sys.modules["fcntl"] = sys.modules["resource"] = None
        for name in ("nice", "sched_setaffinity", "sched_getaffinity"):
            delattr(os, name)
        from studio.engine.base import system
        with system.one_core():
            system.lower_priority(5), system.limit_memory(1)
        assert system.peak_memory_bytes() == 0
        handle = system.hold(".")
        assert handle is not None and system.hold(".") is not None
        import studio.server.run, studio.camera.client.run, studio.offline.replay, studio.take.upkeep.doctor
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True, timeout=120)


def test_devices_that_are_not_ready_are_said_in_one_line(tmp_path):
    """By the program's own `main`, as somebody without any SDK meets it."""
    code = """
        import sys
        for name in ("pyrealsense2", "pyorbbecsdk", "primesense", "pykinect_azure", "pykinect2"):
            sys.modules[name] = None
        from studio.__main__ import main
        for source in sys.argv[2:]:
            assert main(["camera", "--source", source, "--spool", sys.argv[1]]) == 1
    """
    sources = [
        name
        for name, kind in SOURCES.items()
        if issubclass(kind.config(), DeviceConfig) and name != "webcam"  # it needs no library of its own
    ]
    command = [sys.executable, "-c", textwrap.dedent(code), str(tmp_path), *sources]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) == len(sources) == 5
    for source, line in zip(sources, lines, strict=True):
        assert line.startswith(f"studio camera: source {source.partition(':')[0]}") and "install" in line, (
            line
        )


@pytest.mark.parametrize(
    ("source", "word"),
    [("webcam:99", "99"), ("webcam?model=missing.task", "missing.task"), ("video:no.mp4", "no.mp4")],
)
def test_a_camera_of_pictures_that_is_not_there_is_said(source, word, tmp_path):
    command = [sys.executable, "-m", "studio", "camera", "--source", source, "--spool", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode in (1, 2) and len(done.stderr.strip().splitlines()) == 1
    assert word in done.stderr
