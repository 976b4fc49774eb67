"""What the program needs installs on every Python and system that it is made for: by wheels, no compiler."""

import re
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
ASKED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
PYTHONS = ("311", "312", "313")
SYSTEMS = {  # name: what its wheels are called, and its markers
    "Linux": ("manylinux.*x86_64", {"sys_platform": "linux", "platform_machine": "x86_64"}),
    "Linux on ARM": ("manylinux.*aarch64", {"sys_platform": "linux", "platform_machine": "aarch64"}),
    "macOS": ("macosx.*(arm64|universal2)", {"sys_platform": "darwin", "platform_machine": "arm64"}),
    "Windows": ("win_amd64", {"sys_platform": "win32", "platform_machine": "AMD64"}),
}

LOCKED = defaultdict(list)
for _package in tomllib.loads((ROOT / "uv.lock").read_text(encoding="utf-8"))["package"]:
    LOCKED[_package["name"]].append(_package)


def needed(system: str) -> set[str]:
    """The names of all packages that come without an extra."""
    asked = [Requirement(line) for line in ASKED]
    left = [one.name for one in asked if one.marker is None or one.marker.evaluate(SYSTEMS[system][1])]
    found: set[str] = set()
    while left:
        name = canonicalize_name(left.pop())
        if name not in found:
            found.add(name)
            left += [one["name"] for package in LOCKED[name] for one in package.get("dependencies", ())]
    return found


def installs(name: str, python: str, system: str) -> bool:
    """Whether some version of a package has a wheel."""
    fits = rf"(cp{python}-cp{python}|cp3\d*-abi3|py3|py2.py3)-(none-)?.*{SYSTEMS[system][0]}|-none-any"
    files = [wheel["url"] for package in LOCKED[name] for wheel in package.get("wheels", ())]
    return any(re.search(fits, file.rpartition("/")[2]) for file in files)


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("python", PYTHONS)
def test_every_package_has_a_wheel(python, system):
    packages = needed(system)
    assert len(packages) > 30
    assert [name for name in sorted(packages) if not installs(name, python, system)] == []
