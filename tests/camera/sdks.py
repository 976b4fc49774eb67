"""Fake device libraries as files that other processes import: one finds a camera, one hangs, one crashes."""

from pathlib import Path

FINDS = """
class _Info:
    name, serial_number = "name", "serial_number"
camera_info = _Info

class _Device:
    def supports(self, what):
        return True
    def get_info(self, what):
        return {"name": "Paper D435", "serial_number": "A1234567"}[what]
    def query_sensors(self):
        return []

class context:
    def query_devices(self):
        return [_Device()]
"""
"""`pyrealsense2` with one camera, which gives no depth once it is opened."""

HANGS = """
import os, time
def Context():
    open(os.path.join(os.path.dirname(__file__), "hangs"), "w").close()
    while True:
        time.sleep(1)
"""
"""`pyorbbecsdk` that never answers; the file `hangs` beside it says that it was asked."""

CRASHES = """
import os
def is_initialized():
    os.abort()
"""
"""`primesense.openni2` that takes its process along."""


def write_sdks(folder: Path) -> None:
    """Write the libraries into a new folder."""
    (folder / "primesense").mkdir(parents=True)
    (folder / "pyrealsense2.py").write_text(FINDS)
    (folder / "pyorbbecsdk.py").write_text(HANGS)
    (folder / "primesense" / "__init__.py").touch()
    (folder / "primesense" / "openni2.py").write_text(CRASHES)
