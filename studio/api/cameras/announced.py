"""Camera clients on other machines that wait for a studio (`studio camera --wait`): listed, and called by a click.

They announce themselves by mDNS. Announcements are only shown; a camera connects once it was called with its code.
"""

import hashlib
import ipaddress
import logging
import socket
import threading
from dataclasses import dataclass
from typing import Literal

from msgspec import Struct
from zeroconf import IPVersion, ServiceBrowser, ServiceListener, Zeroconf

from studio import wire
from studio.api.access import Access
from studio.api.cameras.client_process import refuse_taken
from studio.api.cameras.devices import ConnectedDevice
from studio.api.errors import NotFoundError
from studio.camera.waiting.pairing import (
    MAX_LINE,
    SERVICE,
    TALK_S,
    Pairing,
    line_of,
    new_nonce,
    read_line,
    text_in,
)
from studio.engine.base.errors import FormatError, SettingsError, StudioError
from studio.engine.base.sentences import say, system_says
from studio.live import LiveStage

_log = logging.getLogger(__name__)

_MOST = 50
_LOOPBACK = "127.0.0.1"


class AnnouncedCamera(Struct):
    """A client that waits at `address`, or was called; `state` is `free`, `starting` or `connected`."""

    id: str
    name: str
    kind: str
    address: str
    state: Literal["free", "starting", "connected"]


class AnnouncedList(Struct):
    """The clients that wait; `on`: whether the studio listens to announcements; `problem`: why it cannot."""

    on: bool
    problem: str
    cameras: list[AnnouncedCamera]


@dataclass(frozen=True)
class _Waiting:
    """An announcement."""

    id: str
    name: str
    kind: str
    address: str
    port: int


@dataclass(frozen=True)
class _Called:
    """A client that was called, its token, and the token's id where tokens are kept."""

    waiting: _Waiting
    token: str
    token_id: str


class Announced(ServiceListener):
    """The clients that wait for a studio; methods may be called from any thread, and only `call` waits."""

    def __init__(self, stage: LiveStage, access: Access, *, on: bool) -> None:
        """`on`: listen to announcements, on the loopback interface alone if the studio is open to nobody else."""
        self._stage, self._access, self._on = stage, access, on
        self._lock = threading.RLock()
        self._waiting: dict[str, _Waiting] = {}
        self._called: dict[str, _Called] = {}
        self._zeroconf: Zeroconf | None = None
        self._problem = ""

    def listen(self) -> None:
        """Begin to listen, if listening is on and has not begun."""
        with self._lock:
            if not self._on or self._zeroconf is not None:
                return
            self._problem = ""
            try:
                if self._access.required:
                    self._zeroconf = Zeroconf(ip_version=IPVersion.V4Only)
                else:
                    self._zeroconf = Zeroconf(interfaces=[_LOOPBACK], ip_version=IPVersion.V4Only)
            except OSError as error:
                self._problem = say(
                    "announced.no_mdns",
                    "announcements on the network cannot be heard: {error}; start those cameras by the command",
                    error=system_says(error),
                )
                return
            ServiceBrowser(self._zeroconf, SERVICE, self)

    def add_service(self, zc: Zeroconf, type_: str, name: str) -> None:
        """Take in an announcement; called by the browser on its thread."""
        info = zc.get_service_info(type_, name)
        if info is None:
            return
        said = {key.decode("utf-8", "replace"): value for key, value in info.properties.items()}
        camera, kind = ((said.get(key) or b"").decode("utf-8", "replace") for key in ("name", "kind"))
        address = next((one for one in info.parsed_addresses() if self._reached(one)), None)
        if address is None or not info.port or not wire.is_camera_name(camera) or not _is_plain(kind):
            _log.warning("an announcement that is none of a camera of the studio is ignored")
            return
        with self._lock:
            if len(self._waiting) < _MOST or name in self._waiting:
                key = hashlib.sha256(f"{name} {info.server} {info.port}".encode()).hexdigest()[:12]
                self._waiting[name] = _Waiting(key, camera, kind, address, info.port)

    def update_service(self, zc: Zeroconf, type_: str, name: str) -> None:
        """Take in a changed announcement."""
        self.add_service(zc, type_, name)

    def remove_service(self, zc: Zeroconf, type_: str, name: str) -> None:
        """Forget an announcement that was withdrawn or has expired."""
        with self._lock:
            self._waiting.pop(name, None)

    def _reached(self, address: str) -> bool:
        """Whether an announced address may be called; loopback ones only if the studio requires no tokens."""
        ip = ipaddress.ip_address(address)
        if ip.version != 4 or ip.is_multicast or ip.is_unspecified or ip.is_reserved:
            return False
        return not (ip.is_loopback and self._access.required)

    def status(self) -> AnnouncedList:
        """Return the clients that wait or were called, sorted by name."""
        with self._lock:
            connected = {name for name, one in self._stage.status().cameras.items() if one.connected}
            here = [self._status(one.waiting, connected) for one in self._called.values()]
            known = {one.id for one in here}
            here += [
                AnnouncedCamera(one.id, one.name, one.kind, one.address, "free")
                for one in self._waiting.values()
                if one.id not in known
            ]
            return AnnouncedList(self._on, self._problem, sorted(here, key=lambda one: (one.name, one.id)))

    def clicked(self) -> list[ConnectedDevice]:
        """Return the clients that were called."""
        with self._lock:
            called = {one.waiting.id for one in self._called.values()}
            here = [one for one in self.status().cameras if one.id in called]
        return [ConnectedDevice(one.id, one.name, one.state, "", network=True) for one in here]

    @staticmethod
    def _status(one: _Waiting, connected: set[str]) -> AnnouncedCamera:
        state = "connected" if one.name in connected else "starting"
        return AnnouncedCamera(one.id, one.name, one.kind, one.address, state)

    def call(self, camera_id: str, code: str, server: str) -> None:
        """Make a client connect to this studio; waits for its answer.

        Args:
            camera_id: of the list.
            code: shown by the client.
            server: the studio's address, as the client reaches it.

        Raises:
            NotFoundError: no such client waits.
            SettingsError: a wrong code.
            StudioError: another camera has its name, or it does not answer.
        """
        with self._lock:
            if camera_id in self._called:
                return
            waiting = next((one for one in self._waiting.values() if one.id == camera_id), None)
        if waiting is None:
            raise NotFoundError(
                "announced.none", "no camera {id!r} waits; GET /api/v1/devices lists them", id=camera_id
            )
        refuse_taken(self._stage, [waiting.name])
        try:
            called = self._talk(waiting, code, server)
        except (OSError, FormatError) as error:
            raise StudioError(
                "announced.no_answer",
                "the camera {name!r} at {address} does not answer ({error}); start it again",
                name=waiting.name,
                address=waiting.address,
                error=system_says(error) if isinstance(error, OSError) else error,
            ) from error
        with self._lock:
            self._called[camera_id] = called

    def _talk(self, waiting: _Waiting, code: str, server: str) -> _Called:
        nonce, token_id = new_nonce(), ""
        with socket.create_connection((waiting.address, waiting.port), timeout=TALK_S) as link:
            lines = link.makefile("rb")
            said = read_line(lines.readline(MAX_LINE + 1))
            pairing = Pairing.of(code, text_in(said, "nonce"), nonce, server)
            if self._access.required:  # before the client learns it, and connects at once
                token_id, _ = self._access.add_camera(waiting.name, pairing.token)
            try:
                link.sendall(line_of(nonce=nonce, server=server, proof=pairing.proof("studio")))
                answer = read_line(lines.readline(MAX_LINE + 1))
                if not pairing.proves("client", answer.get("proof")):
                    raise SettingsError(
                        "announced.wrong_code",
                        "this is not the code of the camera {name!r}; type the one that its terminal shows now",
                        name=waiting.name,
                    )
            except BaseException:
                if token_id:
                    self._access.remove_camera(token_id)
                raise
        return _Called(waiting, pairing.token, token_id)

    def let_go(self, camera_id: str) -> None:
        """End the link of a client that was called; it waits again.

        Raises:
            NotFoundError: no such client was called.
        """
        with self._lock:
            called = self._called.pop(camera_id, None)
        if called is None:
            raise NotFoundError(
                "announced.not_called", "no camera {id!r} was connected by a click", id=camera_id
            )
        self._access.let_go(called.token)
        if called.token_id in {one["id"] for one in self._access.camera_tokens()}:
            self._access.remove_camera(called.token_id)

    def close(self) -> None:
        """End listening."""
        with self._lock:
            zeroconf, self._zeroconf = self._zeroconf, None
        if zeroconf is not None:
            zeroconf.close()


def _is_plain(text: str) -> bool:
    """Whether a text may be shown as the kind of a source."""
    return len(text) <= 40 and text.isascii() and text.replace("-", "").replace("_", "").isalnum()
