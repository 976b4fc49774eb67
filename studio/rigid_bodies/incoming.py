"""Incoming rigid bodies and markers: listens to the systems that are on, and returns where each body is."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from msgspec import Struct, structs

from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import rotate
from studio.engine.model.rigid_body import PlacedBody, PlacedMarkers
from studio.engine.rigid_bodies.known import MOST_BODIES
from studio.engine.rigid_bodies.markers import MarkersReading, placed_markers
from studio.engine.rigid_bodies.reading import BodyAxes, BodyReading
from studio.engine.rigid_bodies.tracks import tracks_of
from studio.rigid_bodies.content import PacketContent
from studio.rigid_bodies.settings import RigidSettings, load_rigid_settings, save_rigid_settings
from studio.rigid_bodies.sources import NatNetSource, OscSource, RigidListener, RigidSourceStatus

_FRESH_NS, _SEEN_NS = 500_000_000, 150_000_000
_KEPT_NS = 2_000_000_000
_AROUND = 4
_log = logging.getLogger(__name__)

_Reading = tuple[int, BodyAxes, BodyReading]
"""Arrival on the server's clock [ns], axes, and the reading."""

_What = TypeVar("_What", BodyReading, MarkersReading)


class RigidBodyStatus(Struct, frozen=True):
    """A rigid body: its name, its use, whether it is seen now, and its position on the stage [m]."""

    name: str
    use: str = ""
    seen: bool = False
    position_m: tuple[float, float, float] | None = None


class RigidStatus(Struct, frozen=True):
    """The systems by name, the bodies, the numbers of markers with and without a name that are seen now, and why the
    stored settings cannot be read, or empty."""

    osc: RigidSourceStatus = RigidSourceStatus()
    natnet: RigidSourceStatus = RigidSourceStatus()
    bodies: list[RigidBodyStatus] = []
    markers: int = 0
    loose_markers: int = 0
    problem: str = ""


class IncomingBodies:
    """The rigid bodies of a sessions folder; thread-safe.

    Args:
        sessions: folder in which the settings are stored.
        clock_ns: the server's clock [ns].

    Attributes:
        on_heard: called on a source's thread with the time on the server's clock [ns], the axes, and the content.
    """

    def __init__(self, sessions: Path, clock_ns: Callable[[], int]) -> None:
        self._sessions, self._clock_ns = sessions, clock_ns
        self._lock = threading.Lock()
        self._changing = threading.Lock()
        self._recent: dict[str, deque[_Reading]] = {}
        self._markers: deque[tuple[int, BodyAxes, MarkersReading]] = deque()
        self._listeners: dict[str, RigidListener] = {}
        self.settings, self._problem = RigidSettings(), ""
        self.on_heard: Callable[[int, BodyAxes, PacketContent], object] = lambda *heard: None

    def start(self) -> None:
        """Listen to the systems that were on last; an unreadable file counts as none, and is reported."""
        try:
            self._use(load_rigid_settings(self._sessions))
        except SettingsError as error:
            self._problem = error.sentence
            _log.warning("%s", error)

    def change(self, settings: RigidSettings) -> None:
        """Use and store other settings.

        Raises:
            SettingsError: they are not allowed; the previous ones stay in use.
            StudioError: the disk refuses.
        """
        settings.check()
        with self._changing:
            save_rigid_settings(self._sessions, settings)
            self._problem = ""
            self._use(settings)

    def _use(self, settings: RigidSettings) -> None:
        before, self.settings = self.settings, settings
        meant = {key: getattr(before, key) for key in ("place", "bodies", "later_s", "ties")}
        if structs.replace(settings, **meant) == before:
            return  # the same listeners continue
        self.close()
        with self._lock:
            self._recent, self._markers = {}, deque()
        if settings.osc:
            self._listeners["osc"] = RigidListener(OscSource(settings), self._put)
        if settings.natnet:
            self._listeners["natnet"] = RigidListener(NatNetSource(settings), self._put)

    def close(self) -> None:
        """Stop listening."""
        listeners, self._listeners = self._listeners, {}
        for listener in listeners.values():
            listener.close()

    def _put(self, axes: BodyAxes, heard: PacketContent) -> None:
        now_ns = self._clock_ns()
        with self._lock:
            kept = [
                one for one in heard.bodies if one.name in self._recent or len(self._recent) < MOST_BODIES
            ]
            for one in kept:
                if one.tracked:
                    mine = self._recent.setdefault(one.name, deque())
                    mine.append((now_ns, axes, one))
                    _forget(mine, now_ns)
            if heard.markers is not None:
                self._markers.append((now_ns, axes, heard.markers))
                _forget(self._markers, now_ns)
        if kept or heard.markers is not None:
            self.on_heard(now_ns, axes, PacketContent(kept, heard.markers))

    def at(self, time_ns: int, fresh_ns: int = _FRESH_NS) -> tuple[PlacedBody, ...]:
        """Return the bodies seen within `fresh_ns` of a time on the server's clock [ns], up to 2 s ago, in the stage
        frame."""
        with self._lock:
            recent = {name: _around(mine, time_ns) for name, mine in self._recent.items()}
        settings = self.settings
        known = {one.name: one for one in settings.bodies}
        found = []
        for name, mine in recent.items():
            if min(abs(time_ns - at_ns) for at_ns, _, _ in mine) > fresh_ns:
                continue
            near: list[tuple[float, BodyAxes, BodyReading]] = [
                ((at_ns - time_ns) * 1e-9, axes, one) for at_ns, axes, one in mine
            ]
            track = tracks_of(near).placed(settings.place).tracks[name]
            positions, rotations = track.filled_at(np.zeros(1))
            one = known.get(name)
            said = ("", None) if one is None else (one.use, one.shape)
            found.append(PlacedBody(name, positions[0], rotations[0], *said))
        return tuple(found)

    def markers_at(self, time_ns: int) -> PlacedMarkers | None:
        """Return the markers nearest to a time on the server's clock [ns], up to 2 s ago, in the stage frame; None if
        none were seen within half a second of it."""
        with self._lock:
            near = _around(self._markers, time_ns)
        if not near:
            return None
        at_ns, axes, reading = min(near, key=lambda one: abs(one[0] - time_ns))
        known = abs(at_ns - time_ns) <= _FRESH_NS
        return placed_markers(reading, axes, self.settings.place) if known else None

    def evidence_at(self, time_ns: int) -> dict[str, dict[str, tuple[float, float, float]]]:
        """Return joint positions from bodies used as evidence, at a time on the server's clock [ns] near now: by
        performer and joint [m], stage frame."""
        settings = self.settings
        known = [one for one in settings.bodies if one.use == "evidence" and one.name in settings.ties]
        if not known:
            return {}
        here = {one.name: one for one in self.at(time_ns - round(settings.later_s * 1e9), _SEEN_NS)}
        found: dict[str, dict[str, tuple[float, float, float]]] = {}
        for one in known:
            body = here.get(one.name)
            if body is not None:
                offset = np.array(settings.ties[one.name].offset_m)
                x, y, z = (body.position_m + rotate(body.rotation_wxyz, offset)).round(5).tolist()
                found.setdefault(one.performer, {})[one.joint] = (x, y, z)
        return found

    def status(self) -> RigidStatus:
        """Return the current state."""
        now_ns = self._clock_ns()
        seen, markers = {one.name: one for one in self.at(now_ns)}, self.markers_at(now_ns)
        known = {one.name: one.use for one in self.settings.bodies}
        with self._lock:
            names = sorted({*self._recent, *known})
        bodies = []
        for name in names:
            here = seen.get(name)
            x, y, z = (0.0, 0.0, 0.0) if here is None else here.position_m.round(3).tolist()
            place = None if here is None else (x, y, z)
            bodies.append(RigidBodyStatus(name, known.get(name, ""), here is not None, place))
        told = {name: one.status() for name, one in self._listeners.items()}
        named, loose = (0, 0) if markers is None else (len(markers.named_m), len(markers.loose_m))
        return RigidStatus(**told, bodies=bodies, markers=named, loose_markers=loose, problem=self._problem)


def _forget(readings: deque[tuple[int, BodyAxes, _What]], now_ns: int) -> None:
    """Remove readings that are too old."""
    while readings[0][0] < now_ns - _KEPT_NS:
        readings.popleft()


def _around(readings: deque[tuple[int, BodyAxes, _What]], time_ns: int) -> list[tuple[int, BodyAxes, _What]]:
    """Return the readings around a time, in order; later ones may exist, because the engine may be late."""
    after: deque[tuple[int, BodyAxes, _What]] = deque(maxlen=_AROUND)
    before: list[tuple[int, BodyAxes, _What]] = []
    for one in reversed(readings):
        if one[0] > time_ns:
            after.appendleft(one)
        elif len(before) < _AROUND:
            before.append(one)
        else:
            break
    return [*reversed(before), *after]
