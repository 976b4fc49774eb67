"""Devices that are plugged into the server's machine: found, pictured, connected as cameras by a click.

A connected device is a camera client in a process of its own. A client that ends is not restarted: its status gives
the reason, and the operator connects it again once that is mended. A client reopens a device that was unplugged.
"""

import hashlib
import logging
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from msgspec import Struct

from studio import wire
from studio.api.cameras.client_process import SPOOL, ClientProcess, refuse_taken
from studio.api.errors import NotFoundError
from studio.camera.client.machine import machine_id
from studio.camera.finding.search import FoundKind, Search, ShortProcess, picture_by
from studio.camera.sources.config import FoundDevice
from studio.engine.base.errors import NotAvailableError, SettingsError, StudioError, TakeError
from studio.engine.base.sentences import say
from studio.live import LiveStage

_log = logging.getLogger(__name__)

State = Literal["free", "lacks", "starting", "connected", "in_use", "ended"]


class DeviceStatus(Struct):
    """A device of the server's machine.

    `source` is what `studio camera --source` takes. `state`: `free`; `lacks` something, named in `needs`;
    `starting`, `connected` as `camera`; `in_use` by the camera `camera`, whose client was started otherwise; `ended`
    for the reason `problem`. `pictures` counts its pictures, `picture_problem` says why there is none.
    """

    id: str
    kind: str
    device: str
    serial: str
    source: str
    name: str
    state: State
    camera: str
    needs: str
    problem: str
    pictures: int
    picture_problem: str


class UnknownKind(Struct):
    """A kind of source whose devices are not known, and why."""

    kind: str
    problem: str


class DeviceList(Struct):
    """The devices found so far, and whether a search is under way."""

    searching: bool
    devices: list[DeviceStatus]
    unknown: list[UnknownKind]


class ConnectedDevice(Struct):
    """A device that a click has connected, for the events; see `DeviceStatus`.

    `network`: it is a client that waited on the network, see `AnnouncedCamera`.
    """

    id: str
    camera: str
    state: State
    problem: str
    network: bool = False


@dataclass
class _Device:
    """A device, its client's process, its newest picture, and the process that takes one."""

    id: str
    kind: str
    found: FoundDevice
    camera: str = ""
    client: ClientProcess | None = None
    problem: str = ""
    picture: bytes = b""
    pictures: int = 0
    picture_problem: str = ""
    taking: ShortProcess | None = None


class Devices:
    """The devices of this machine; methods may be called from any thread, and only `take_picture` waits."""

    def __init__(self, stage: LiveStage, token: str, certificate: Path | None = None) -> None:
        """`token`: the clients', if the studio requires one; `certificate`: the server's own, if it has one."""
        self._stage, self._token = stage, token
        self._spool, self._certificate = stage.sessions / SPOOL, certificate
        self._lock = threading.RLock()
        self._devices: dict[str, _Device] = {}
        self._unknown: dict[str, str] = {}
        self._search: Search | None = None
        self._thread: threading.Thread | None = None
        self._one_picture = threading.Lock()
        self._closed = False

    def search(self) -> DeviceList:
        """Begin to look for devices, unless a search is under way; return those found so far."""
        with self._lock:
            if self._search is None and not self._closed:
                self._search = Search()
                self._thread = threading.Thread(
                    target=self._look, args=(self._search,), name="devices", daemon=True
                )
                self._thread.start()
            return self.status()

    def _look(self, search: Search) -> None:
        try:
            search.run(self._take_in)
        except Exception:  # boundary of the thread; devices found so far stay
            _log.exception("the search for devices failed")
        with self._lock:
            self._search = None

    def _take_in(self, kind: FoundKind) -> None:
        """Register the devices found of a kind; missing ones that are not connected leave the list."""
        here = {_id_of(kind.kind, one): one for one in kind.devices}
        with self._lock:
            self._unknown.pop(kind.kind, None)
            if kind.problem:
                self._unknown[kind.kind] = kind.problem
            self._devices = {
                key: one
                for key, one in self._devices.items()
                if one.kind != kind.kind or key in here or one.client is not None
            }
            for key, found in here.items():
                self._devices.setdefault(key, _Device(key, kind.kind, found)).found = found

    def status(self) -> DeviceList:
        """Return the devices in the order of their kinds."""
        with self._lock:
            serials = self._stage.serials_of(machine_id())
            devices = [self._status(one, serials) for one in self._devices.values()]
            unknown = [UnknownKind(kind, problem) for kind, problem in self._unknown.items()]
            return DeviceList(self._search is not None, devices, unknown)

    def clicked(self) -> list[ConnectedDevice]:
        """Return the devices that a click has connected, also those whose clients have ended since."""
        with self._lock:
            serials: dict[str, str] = {}
            told = [self._status(one, serials) for one in self._devices.values() if one.camera]
            return [
                ConnectedDevice(one.id, one.camera, one.state, one.problem)
                for one in told
                if one.state != "free"
            ]

    def _status(self, device: _Device, serials: dict[str, str]) -> DeviceStatus:
        """Return a device's status; `serials`: cameras by the serial number of their devices."""
        found, camera, problem = device.found, device.camera, device.problem
        self._settle(device)
        state: State = "free"
        if device.client is not None:
            here = self._stage.status().cameras.get(camera)
            state = "connected" if here is not None and here.connected else "starting"
            problem = "" if state == "connected" else device.client.last_words()
        elif found.serial and found.serial in serials:
            state, camera, problem = "in_use", serials[found.serial], ""
        elif found.needs:
            state = "lacks"
        elif device.problem:
            state, problem = "ended", device.problem
        return DeviceStatus(
            device.id, device.kind, found.device, found.serial, found.source, device.camera or found.name, state,
            camera if state in ("starting", "connected", "in_use", "ended") else "", found.needs, problem,
            device.pictures, device.picture_problem,
        )  # fmt: skip

    @staticmethod
    def _settle(device: _Device) -> None:
        """Register that a device's client has ended."""
        client = device.client
        if client is not None and not client.is_running:
            device.client = None
            device.problem = client.last_words() or say(
                "device.client_ended",
                "its client has ended (code {code}); connect it again",
                code=client.code or 0,
            )
            _log.warning("%s ended with code %s: %s", device.camera, client.code, device.problem)

    def connect(self, device_id: str, name: str, url: str) -> DeviceStatus:
        """Start a device's client, unless it runs already.

        Args:
            device_id: of the list.
            name: the camera's; "" = that of the list.
            url: the server's, as programs on its own machine reach it.

        Raises:
            NotFoundError: no such device.
            NotAvailableError: it lacks something.
            SettingsError: a name that is not allowed.
            StudioError: another camera has the name or the device.
        """
        with self._lock:
            device = self._find(device_id)
            now = self._status(device, self._stage.serials_of(machine_id()))
            if device.client is not None:
                return now
            self._check(now)
            name = name or now.name
            if not wire.is_camera_name(name):
                raise SettingsError(
                    "device.name",
                    "camera name {name!r} is not allowed; allowed: 1 to 63 letters, digits, `_`, `.`, "
                    "`-`, the first a letter or digit",
                    name=name,
                )
            refuse_taken(self._stage, [name], {one.camera for one in self._devices.values() if one.client})
            if device.taking is not None:
                device.taking.end()
            device.camera, device.problem, device.picture_problem = name, "", ""
            device.client = ClientProcess(
                name,
                device.found.source,
                url=url,
                token=self._token,
                folder=self._spool,
                certificate=self._certificate,
            )
            return self._status(device, {})

    def disconnect(self, device_id: str) -> DeviceStatus:
        """Stop a device's client; forget why it ended.

        Raises:
            NotFoundError: no such device.
        """
        with self._lock:
            device = self._find(device_id)
            client, device.client, device.problem = device.client, None, ""
        if client is not None:
            client.end()
        with self._lock:
            return self._status(device, self._stage.serials_of(machine_id()))

    def take_picture(self, device_id: str) -> DeviceStatus:
        """Open a free device for one picture; waits. If that fails, the status says why.

        Raises:
            NotFoundError: no such device.
            NotAvailableError: it lacks something.
            StudioError: it is connected.
            TakeError: a take is being recorded, which opening a device might disturb.
        """
        with self._one_picture:
            with self._lock:
                device = self._find(device_id)
                now = self._status(device, self._stage.serials_of(machine_id()))
                self._check(now)
                if now.state in ("starting", "connected"):
                    raise _in_use(now)
                if self._stage.recording_name() is not None:
                    raise TakeError(
                        "picture.recording", "no picture is taken while a take is recorded; stop it first"
                    )
                process = device.taking = ShortProcess("picture", device.found.source)
                if self._closed:
                    process.ask_to_end()
            try:
                png, problem = picture_by(process), ""
            except StudioError as error:
                png, problem = b"", error.sentence
            with self._lock:
                device.taking = None
                if device.client is None:
                    device.picture, device.picture_problem = png or device.picture, problem
                    device.pictures += bool(png)
                return self._status(device, {})

    def picture(self, device_id: str) -> bytes:
        """Return the newest picture of a device, as PNG.

        Raises:
            NotFoundError: no such device, or no picture of it was taken.
        """
        with self._lock:
            picture = self._find(device_id).picture
        if not picture:
            raise NotFoundError("picture.not_taken", "no picture of this device was taken yet")
        return picture

    def end(self) -> None:
        """Ask the clients to end, abort a search and pictures; does not wait."""
        self._closed = True
        if (search := self._search) is not None:
            search.end()
        for device in list(self._devices.values()):
            if (taking := device.taking) is not None:
                taking.ask_to_end()
            if device.client is not None:
                device.client.ask_to_end()

    def close(self) -> None:
        """End all clients, a search and pictures under way."""
        self._closed = True
        search, thread = self._search, self._thread
        if search is not None:
            search.end()
        if thread is not None:
            thread.join()
        with self._lock:
            devices = list(self._devices.values())
        for device in devices:
            if device.taking is not None:
                device.taking.end()
            if device.client is not None:
                device.client.end()

    def _find(self, device_id: str) -> _Device:
        if device_id not in self._devices:
            raise NotFoundError(
                "device.none", "there is no device {id!r}; GET /api/v1/devices lists them", id=device_id
            )
        return self._devices[device_id]

    @staticmethod
    def _check(now: DeviceStatus) -> None:
        """Raise if a device cannot be opened."""
        if now.state == "in_use":
            raise _in_use(now)
        if now.needs:
            raise NotAvailableError(now.needs)


def _in_use(now: DeviceStatus) -> StudioError:
    return StudioError(
        "device.in_use", "the camera {name!r} uses this device; stop it first", name=now.camera
    )


def _id_of(kind: str, found: FoundDevice) -> str:
    return hashlib.sha256(f"{kind} {found.source} {found.name}".encode()).hexdigest()[:12]
