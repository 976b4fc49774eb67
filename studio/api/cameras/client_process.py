"""A camera client on the server's own machine, in a process of its own that ends with the server."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import Said

if TYPE_CHECKING:  # the simulated stage's clients are started before the server's code is loaded
    from studio.live import LiveStage

SPOOL = ".spool"
"""Folder in the sessions for the clients' spools and messages."""

STOP_S = 3.0
PROBLEM_BYTES = 2000
_SPEAKER = "studio camera: "


class ClientProcess:
    """`studio camera`, as a person would start it; methods may be called from any thread.

    Args:
        name: of the camera.
        source: argument of `--source`.
        url: the server's, as programs on its own machine reach it.
        token: for cameras, if the studio requires one.
        folder: for spools and the clients' messages.
        certificate: the server's own, if it has one.
    """

    def __init__(
        self, name: str, source: str, *, url: str, token: str, folder: Path, certificate: Path | None
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._log = folder / f"{name}.log"
        command = [sys.executable, "-P", "-m", "studio", "camera", "--source", source]
        command += ["--server", url, "--name", name, "--parent", str(os.getpid())]
        if certificate is not None:
            command += ["--certificate", str(certificate)]
        with self._log.open("wb") as words:
            self._process = subprocess.Popen(
                [*command, "--spool", str(folder / name)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=words,
                env={**os.environ, "STUDIO_CAMERA_TOKEN": token, "STUDIO_ERRORS": "json"},
                start_new_session=True,  # Ctrl-C is for the server, which stops them
            )

    @property
    def is_running(self) -> bool:
        return self._process.poll() is None

    @property
    def code(self) -> int | None:
        """Its exit code; None while it runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """The last line that it wrote, with its code if it has one."""
        try:
            text = self._log.read_bytes()[-PROBLEM_BYTES:].decode("utf-8", "replace")
        except OSError:
            return ""
        lines = [line for line in text.splitlines() if line.strip()]
        return words_of(lines[-1].strip()) if lines else ""

    def ask_to_end(self) -> None:
        """Ask it to end; does not wait."""
        self._process.terminate()

    def end(self) -> None:
        """End it, in order if it can; waits."""
        self._process.terminate()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def refuse_taken(stage: "LiveStage", names: Iterable[str], others: Iterable[str] = ()) -> None:
    """Refuse the names of connected cameras, and of `others`, which are about to connect.

    Raises:
        StudioError: a camera with one of the names is connected.
    """
    connected = {name for name, camera in stage.status().cameras.items() if camera.connected}
    taken = sorted((connected | set(others)) & set(names))
    if taken:
        raise StudioError(
            "camera.name_in_use",
            "a camera {name!r} is connected already; stop that one first: names are used once",
            name=taken[0],
        )


def words_of(line: str) -> str:
    """Return a client's line without the command's name, with its code if it has one."""
    text = line.removeprefix(_SPEAKER)
    try:
        return Said.from_json(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError):
        return text
