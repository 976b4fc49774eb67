"""Search for devices, and pictures from them, by a supervised process that ends with its work."""

import base64
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from studio.camera.sources.config import FoundDevice
from studio.camera.sources.registry import SOURCES
from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import Said, say

_KIND_S = 60.0
"""Timeout for one kind of device [s], including the start of a process on a busy machine."""

_PICTURE_S = 60.0


@dataclass(frozen=True)
class FoundKind:
    """The devices of a kind of source; `problem`: why they are unknown, "" = they are known."""

    kind: str
    devices: tuple[FoundDevice, ...] = ()
    problem: str = ""


class ShortProcess:
    """A process with one task of `studio.camera.finding.child`, which may be ended at any time from any thread."""

    def __init__(self, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "studio.camera.finding.child", str(os.getpid()), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the program, which ends it
        )

    def ask_to_end(self) -> None:
        """Kill it; does not wait."""
        self._process.kill()

    def end(self) -> None:
        """Kill it and wait; its devices are free afterwards."""
        self._process.kill()
        self._process.wait()

    def lines(self, longest_s: float) -> Iterator[dict[str, Any]]:
        """Yield what it writes, until it ends or nothing came for `longest_s`; then kill it."""
        output = self._process.stdout
        assert output is not None
        try:
            while True:
                watch = threading.Timer(longest_s, self._process.kill)
                watch.daemon = True
                watch.start()
                line = output.readline()
                watch.cancel()
                if not line.endswith(b"\n"):  # its end, perhaps within a line
                    return
                yield json.loads(line)
        finally:
            self._process.kill()
            self._process.wait()
            output.close()


class Search:
    """One search for the devices of this machine; it may be ended from another thread."""

    def __init__(self, kinds: list[str] | None = None) -> None:
        """`kinds` of sources to look for; None: all that can be found, those that are only simulated last."""
        known = [kind for kind, one in SOURCES.items() if one.found]
        self._left = sorted(known, key=lambda kind: kind.startswith("simulated")) if kinds is None else kinds
        self._process: ShortProcess | None = None
        self._ended = False

    def run(self, on_found: Callable[[FoundKind], None]) -> None:
        """Report the devices of each kind as they are found; report a kind whose library crashes or hangs as such."""
        while self._left and not self._ended:
            self._process = ShortProcess("list", *self._left)
            if self._ended:
                self._process.ask_to_end()
            begun = ""
            for line in self._process.lines(_KIND_S):
                begun = line["kind"]
                if "devices" in line:
                    self._left.remove(begun)
                    on_found(_found(line))
            if self._left and not self._ended:
                broken = begun if begun in self._left else self._left[0]
                self._left.remove(broken)
                on_found(FoundKind(broken, problem=_broke_off(broken)))

    def end(self) -> None:
        """End the search with what was reported so far; does not wait."""
        self._ended = True
        if self._process is not None:
            self._process.ask_to_end()


def picture_by(process: ShortProcess) -> bytes:
    """Return the picture, as PNG, that a process takes: `ShortProcess("picture", source)`.

    Raises:
        StudioError: there is none; it says why.
    """
    for line in process.lines(_PICTURE_S):
        if "png" in line:
            return base64.b64decode(line["png"])
        raise StudioError(_heard(line["problem"]))
    raise StudioError(
        "picture.broke_off", "the device's library broke off or gave nothing; plug the device in again"
    )


def _found(line: dict[str, Any]) -> FoundKind:
    devices = [FoundDevice(**one) for one in line["devices"]]
    devices = [replace(one, device=_heard(one.device), needs=_heard(one.needs)) for one in devices]
    return FoundKind(line["kind"], tuple(devices), _heard(line["problem"]))


def _heard(text: Any) -> str:
    """Return a problem as the process reports it."""
    return text if isinstance(text, str) else Said.from_json(text)


def _broke_off(kind: str) -> str:
    return say(
        "device.search_broke_off",
        "source {kind}: its library broke off or did not answer; plug its devices in again, or start one by the "
        "command",
        kind=kind,
    )
