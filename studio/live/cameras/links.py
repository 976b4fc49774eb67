"""The connections of the camera clients: the holder of each name, and the messages to each."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from studio import wire
from studio.engine.base.sentences import say
from studio.live.cameras.camera import CameraRefused

LINK_TIMEOUT_NS = 5_000_000_000
"""A client that sent nothing for this long may be replaced by another of its name."""

Send = Callable[[wire.Message], None]


@dataclass
class CameraLink:
    """One connection of a camera; frames of a replaced connection are refused.

    Attributes:
        hello: the client's hello.
        reference: its clock was the stage clock when it joined.
        heard_ns: time of its last message, on the server's clock.
        send: sends the client a message; safe from any thread, never waits.
        kept: the first frame that the client keeps, by take id and boot id.
        hellos: of earlier starts of the client, by boot id.
    """

    hello: wire.Hello
    reference: bool
    heard_ns: int
    send: Send = lambda message: None
    kept: dict[tuple[str, str], int] = field(default_factory=dict)
    hellos: dict[str, wire.Hello] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.hello.name

    def hello_of(self, boot_id: str) -> wire.Hello | None:
        """The hello of a start of the client, this one or an earlier one that it has sent."""
        return self.hello if boot_id == self.hello.boot_id else self.hellos.get(boot_id)


class Links:
    """All connections; methods may be called from any thread."""

    def __init__(self) -> None:
        self._links: dict[str, CameraLink] = {}
        self._lock = threading.Lock()

    def add(self, link: CameraLink, now_ns: int) -> None:
        """Add a connection; the same start of a client that connects again replaces its own connection.

        Raises:
            CameraRefused: another client of that name is connected.
        """
        with self._lock:
            other = self._links.get(link.name)
            if other is not None and other.hello.boot_id != link.hello.boot_id:
                if now_ns - other.heard_ns < LINK_TIMEOUT_NS:
                    raise CameraRefused(
                        "name_taken",
                        say(
                            "camera.name_taken",
                            "a camera named {name!r} is connected already; give this one another --name",
                            name=link.name,
                        ),
                    )
            self._links[link.name] = link

    def remove(self, link: CameraLink) -> bool:
        """Remove a connection; return False if another has its name by now."""
        with self._lock:
            if self._links.get(link.name) is not link:
                return False
            del self._links[link.name]
            return True

    def check(self, link: CameraLink, now_ns: int) -> None:
        """Register that the client sent something.

        Raises:
            CameraRefused: another connection has its name.
        """
        if self._links.get(link.name) is not link:
            raise CameraRefused(
                "replaced",
                say("camera.taken_over", "another client took over the name {name!r}", name=link.name),
            )
        link.heard_ns = now_ns

    def all(self) -> list[CameraLink]:
        """All present connections."""
        with self._lock:
            return list(self._links.values())
