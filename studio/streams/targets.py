"""Receivers of live output: `sessions/outputs.json`, a list of targets that survives a restart."""

from pathlib import Path
from typing import Any

from msgspec import Struct, structs

from studio.engine.base.choices import load_choices, save_choices
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_setting
from studio.engine.base.versions import OUTPUTS
from studio.engine.robots.files import FOLDER, robot_table
from studio.streams import joint_targets, rokoko, vmc
from studio.take.folder.names import check_name

FILE = "outputs.json"
ROBOT = "robot"
KINDS: dict[str, int] = {"vmc": vmc.PORT, "rokoko": rokoko.PORT, ROBOT: joint_targets.PORT}
"""The formats, and the default ports of their receivers."""

RATES_HZ = (1.0, 120.0)
SCALES = (0.01, 100.0)
MAX_TARGETS = 32
MAX_HOST = 253


class Target(Struct, frozen=True):
    """One receiver of the live motion.

    Attributes:
        id: name of the target in the API.
        kind: a key of `KINDS`.
        host: name or address of the receiving machine; port: its UDP port.
        rate_hz: maximum frame rate; for joint targets the rate itself.
        scale: factor of positions, for a character of another size.
        actor: name of the character, if the format has one.
        performer: name of the performer whose motion is sent; "" = of all where the format has room for several, else
            of the first.
        robot: name of the stored robot whose joint targets are sent, for the kind `robot`.
        enabled: whether it receives frames.
    """

    id: str
    kind: str
    host: str = "127.0.0.1"
    port: int = 0
    rate_hz: float = 60.0
    scale: float = 1.0
    actor: str = "Performer"
    performer: str = ""
    robot: str = ""
    enabled: bool = True

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise SettingsError(bad_setting("kind", self.kind, KINDS))
        if self.port == 0:
            structs.force_setattr(self, "port", KINDS[self.kind])
        if not 1 <= self.port <= 65535:
            raise SettingsError(
                "output.port",
                "port={port} is not allowed; allowed: 1 to 65535, usual {usual}",
                port=self.port,
                usual=KINDS[self.kind],
            )
        if not self.host or len(self.host) > MAX_HOST or any(c.isspace() or c in "/?#@" for c in self.host):
            raise SettingsError(
                "output.host",
                "host={host!r} is not a machine's name or address; such as 192.168.1.20",
                host=self.host,
            )
        _within("rate_hz", self.rate_hz, joint_targets.RATES_HZ if self.kind == ROBOT else RATES_HZ)
        _within("scale", self.scale, SCALES)
        if (self.kind == ROBOT) != bool(self.robot):
            raise SettingsError(
                "output.robot",
                "robot={robot!r} with kind={kind}: joint targets need the name of a kept robot, others none",
                robot=self.robot,
                kind=self.kind,
            )
        if self.robot:
            robot_table(Path(FOLDER), self.robot)  # raises for a name that is not allowed
        if self.performer:
            check_name("performer", self.performer)
        if not 1 <= len(self.actor) <= 60:
            raise SettingsError(
                "blind.text_length",
                "{name} has {n} characters; allowed: 1 to {most}",
                name="actor",
                n=len(self.actor),
                most=60,
            )


class OutputStatus(Target, frozen=True, kw_only=True):
    """A target, the frames sent and dropped, the bytes sent, and the last error, or empty."""

    sent: int = 0
    dropped: int = 0
    bytes: int = 0
    problem: str = ""


def _within(name: str, value: float, limits: tuple[float, float]) -> None:
    if not limits[0] <= value <= limits[1]:  # NaN fails too
        raise SettingsError(
            "output.between",
            "{name}={value:g} is not allowed; allowed: {low:g} to {high:g}",
            name=name,
            value=value,
            low=limits[0],
            high=limits[1],
        )


def load_targets(sessions: Path) -> list[Target]:
    """Return the stored targets, none without a file.

    Raises:
        SettingsError: the file cannot be read.
    """

    def read(value: dict[str, Any]) -> list[Target]:
        return [Target(**_with_allowed_rate(item)) for item in value["targets"]]

    return load_choices(sessions / FILE, OUTPUTS, read, [])


def _with_allowed_rate(item: dict[str, Any]) -> dict[str, Any]:
    """Limit the rate of joint targets, since earlier versions stored rates that are no longer allowed."""
    rate_hz = item.get("rate_hz")
    if item.get("kind") != ROBOT or not isinstance(rate_hz, int | float):
        return item
    low, high = joint_targets.RATES_HZ
    return {**item, "rate_hz": min(max(float(rate_hz), low), high)}


def save_targets(sessions: Path, targets: list[Target]) -> None:
    """Store the targets.

    Raises:
        StudioError: the file cannot be written.
    """
    save_choices(sessions / FILE, OUTPUTS, {"targets": [structs.asdict(target) for target in targets]})
