"""Everything that differs between operating systems, with a fallback where a system lacks a feature.

No other module calls functions that only POSIX or Linux have; `tests/test_systems.py` checks this.
"""

import contextlib
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
    import resource
except ImportError:  # Windows
    fcntl = resource = None  # pyright: ignore[reportAssignmentType]  # two modules, or none

USB_DEVICES = Path("/sys/bus/usb/devices")
"""Where Linux lists USB devices; missing on other systems."""

VIDEO_DEVICES = Path("/sys/class/video4linux")
"""Where Linux lists video devices; missing on other systems."""

VIDEO_NODE = "/dev/video{number}"
"""Linux's address of a video device."""

_STATUS = Path("/proc/self/status")
_SCHEDULED = Path("/proc/self/schedstat")
_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def hold(path: Path) -> int | None:
    """Mark a file or folder as in use by an advisory lock. The lock ends with the process.

    Returns:
        A handle to close, or None where another process holds the lock. Windows has no such lock.
    """
    if fcntl is None:
        return os.open(os.devnull, os.O_RDONLY)
    handle = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def leave_out_windows() -> None:
    """Import MuJoCo without its libraries for windows and pictures: they start one more process at each import.

    It must be called before MuJoCo is imported. A `MUJOCO_GL` that is set already stays.
    """
    os.environ.setdefault("MUJOCO_GL", "disable")


def lower_priority(niceness: int) -> None:
    """Lower the priority of this process where the system can; in a process with threads, that of the main thread."""
    if hasattr(os, "setpriority"):
        own = os.getpid()
        os.setpriority(os.PRIO_PROCESS, own, os.getpriority(os.PRIO_PROCESS, own) + niceness)


def lower_thread_priority(niceness: int) -> None:
    """Lower the priority of this thread where the system can do so for one thread alone."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), niceness)


def limit_memory(most_bytes: int) -> None:
    """Limit the memory of this process where the system can."""
    if resource is None:
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    soft = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
    with contextlib.suppress(ValueError, OSError):  # macOS has the limit but refuses to set it
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def peak_memory_bytes() -> int:
    """Return the peak memory of this process; 0 where the system does not report it.

    On Linux, `ru_maxrss` of a new process starts at the peak of its parent, so another source is read.
    """
    if resource is None:
        return 0
    try:
        lines = _STATUS.read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        pass
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def queued_ns() -> int:
    """Return how long the main thread has waited for a processor [ns]; 0 where the system does not report it."""
    try:
        return int(_SCHEDULED.read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0


def boot_id() -> str:
    """Return the identifier of this boot of the machine; empty where the system has none."""
    try:
        return _BOOT_ID.read_text(encoding="ascii").strip()
    except OSError:
        return ""


def core_count() -> int:
    """Return on how many cores this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process on one core within the block, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
