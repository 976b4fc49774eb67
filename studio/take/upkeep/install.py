"""Checks the program itself: Python, packages, disk, and a small solve."""

import importlib
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

PACKAGES: tuple[str, ...] = (
    "numpy", "scipy", "mujoco", "mink", "daqp", "fastapi", "uvicorn", "websockets", "jinja2", "viser", "mcap",
    "zstandard", "msgspec", "tqdm",
)  # fmt: skip
"""Packages that the program needs, by import name (the same as the distribution's)."""

LEAST_FREE_BYTES = 2 * 1024**3
_OLDEST, _NEWEST = (3, 11), (3, 13)

_ARM = """
<mujoco><option gravity="0 0 0"/><worldbody>
 <body name="upper"><joint type="hinge" axis="0 0 1"/>
  <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
  <body name="lower" pos="0.3 0 0"><joint type="hinge" axis="0 0 1"/>
   <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/><site name="hand" pos="0.3 0 0"/></body></body>
</worldbody></mujoco>
"""


@dataclass(frozen=True)
class InstallCheck:
    """One check of the install: its name, whether it passed, the finding, the advice after a failure."""

    name: str
    ok: bool
    detail: str
    action: str = ""


def check_install(sessions_dir: str | Path) -> list[InstallCheck]:
    """Return the result of every check; none raises."""
    checks = [_python(), *(_package(name) for name in PACKAGES), *_disk(Path(sessions_dir))]
    return [*checks, _guarded("solve", _smoke_solve, "install again: `uv sync`")]


def _python() -> InstallCheck:
    ok = _OLDEST <= sys.version_info[:2] <= _NEWEST
    return InstallCheck(
        "python", ok, platform.python_version(), "" if ok else "install Python 3.11, 3.12 or 3.13"
    )


def _package(name: str) -> InstallCheck:
    def look() -> str:
        importlib.import_module(name)
        try:
            return version(name)
        except PackageNotFoundError:
            return "imported, version unknown"

    return _guarded(name, look, "install again: `uv sync`")


def _guarded(name: str, look: Callable[[], str], action: str) -> InstallCheck:
    """Run a check that may raise any error, because a broken package can raise anything on import."""
    try:
        return InstallCheck(name, True, look())
    except Exception as error:
        return InstallCheck(name, False, f"{type(error).__name__}: {error}", action)


def _disk(folder: Path) -> list[InstallCheck]:
    """Check the space and rights of the sessions folder, or of its parent if it does not exist."""
    existing = next((f for f in [folder, *folder.resolve().parents] if f.exists()), Path("/"))
    free = shutil.disk_usage(existing).free
    enough = free >= LEAST_FREE_BYTES
    space = InstallCheck(
        "disk",
        enough,
        f"{free / 1e9:.1f} GB free at {existing}",
        "" if enough else "free 2 GB at least",
    )

    def write() -> str:
        handle, name = tempfile.mkstemp(prefix=".doctor-", dir=existing)
        os.close(handle)
        os.unlink(name)
        return f"{folder} can be written"

    return [space, _guarded("sessions", write, f"make {folder} writable, or choose another with --sessions")]


def _smoke_solve() -> str:
    """Move a two-bone arm's hand to a point with mink on MuJoCo; return the remaining distance.

    Raises:
        RuntimeError: it exceeds 1 mm.
    """
    import mink
    import mujoco

    model = mujoco.MjModel.from_xml_string(_ARM)
    configuration = mink.Configuration(model, q=np.array([0.3, 0.5]))
    target = np.array([0.3, 0.3, 0.0])
    task = mink.FrameTask("hand", "site", position_cost=1.0, orientation_cost=0.0)
    task.set_target(mink.SE3.from_translation(target))
    for _ in range(50):
        velocity = mink.solve_ik(configuration, [task], 0.1, "daqp", damping=1e-6)
        configuration.integrate_inplace(velocity, 0.1)
    reached = configuration.get_transform_frame_to_world("hand", "site").translation()
    distance_mm = 1e3 * float(np.linalg.norm(reached - target))
    if distance_mm > 1.0:
        raise RuntimeError(f"the solve ended {distance_mm:.1f} mm from its target")
    return f"MuJoCo and mink reach a target within {distance_mm:.3f} mm"
