"""All live outputs of a stage: the targets and their senders."""

import logging
import secrets
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from studio.engine.base.errors import SettingsError
from studio.engine.model.frames import StepResult
from studio.engine.robots.files import FOLDER, find_robot, load_robot
from studio.streams.cast import Cast
from studio.streams.robot_sender import RobotSender
from studio.streams.sender import Sender
from studio.streams.targets import MAX_TARGETS, ROBOT, OutputStatus, Target, load_targets, save_targets

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

_log = logging.getLogger(__name__)


class Outputs:
    """The targets of a sessions folder; enabled ones receive every frame given to `add`."""

    def __init__(self, sessions: Path, cast: Cast) -> None:
        """Load the stored targets; a damaged file is not changed, and reported in `problem`."""
        self._sessions = sessions
        self.cast = cast
        self._lock = threading.Lock()
        self._targets: dict[str, Target] = {}
        self._senders: dict[str, Sender | RobotSender] = {}
        self.problem = ""
        try:
            self._targets = {target.id: target for target in load_targets(sessions)}
        except SettingsError as error:
            self.problem = error.sentence
            _log.warning("%s", error)
        for target in self._targets.values():
            self._start(target)

    def add(self, result: StepResult) -> None:
        """Give every enabled target a frame; returns at once."""
        for sender in tuple(self._senders.values()):
            sender.add(result)

    def robot(self, name: str) -> "Robot":
        """Return a stored robot.

        Raises:
            FormatError: as `load_robot`.
        """
        return load_robot(self._sessions / FOLDER, name)

    def list(self) -> list[OutputStatus]:
        """Return every target with its statistics."""
        with self._lock:
            return [
                self._senders[name].status()
                if name in self._senders
                else OutputStatus(**structs.asdict(target))
                for name, target in self._targets.items()
            ]

    def create(self, **values: Any) -> Target:
        """Add a target with these attributes and return it.

        Raises:
            SettingsError: a value that is not allowed, or too many targets.
            FormatError: no such robot.
            StudioError: the disk refuses.
        """
        with self._lock:
            if len(self._targets) >= MAX_TARGETS:
                raise SettingsError(
                    "output.too_many",
                    "there are {most} live outputs already; remove one first",
                    most=MAX_TARGETS,
                )
            target = Target(id=secrets.token_hex(4), **values)
            if target.robot:
                find_robot(self._sessions / FOLDER, target.robot)
            return self._put(target)

    def change(self, name: str, **values: Any) -> Target:
        """Change attributes of a target and return it.

        Raises:
            SettingsError: no such target, or a value that is not allowed. StudioError: the disk refuses.
        """
        with self._lock:
            return self._put(structs.replace(self._get(name), **values))

    def remove(self, name: str) -> None:
        """Remove a target.

        Raises:
            SettingsError: no such target.
            StudioError: the disk refuses.
        """
        with self._lock:
            self._get(name)
            save_targets(self._sessions, [other for other in self._targets.values() if other.id != name])
            self._stop(name)
            del self._targets[name]

    def close(self) -> None:
        """End all senders."""
        with self._lock:
            for name in tuple(self._senders):
                self._stop(name)

    def _get(self, name: str) -> Target:
        if name not in self._targets:
            raise SettingsError(
                "output.no_such",
                "there is no live output {name!r}; there are: {names}",
                name=name,
                names=", ".join(self._targets) or "none",
            )
        return self._targets[name]

    def _put(self, target: Target) -> Target:
        save_targets(self._sessions, list({**self._targets, target.id: target}.values()))
        self.problem = ""
        self._stop(target.id)
        self._targets[target.id] = target
        self._start(target)
        return target

    def _start(self, target: Target) -> None:
        if target.enabled:
            robots = target.kind == ROBOT
            sender = RobotSender(target, self.cast, self.robot) if robots else Sender(target, self.cast)
            self._senders = {**self._senders, target.id: sender}

    def _stop(self, name: str) -> None:
        senders = dict(self._senders)
        sender = senders.pop(name, None)
        self._senders = senders
        if sender is not None:
            sender.close()
