"""Frames of recordings that a client keeps until they are on the server's disk.

During a recording, every frame goes into the spool as well as to the network. Frames sent on a connection
that broke count as not sent. On each connection the client says which frames it keeps (`Kept`), the server answers
which it has (`Ack`), and the others are sent again, oldest first (`Late`).
"""

import logging
from collections import deque
from collections.abc import Callable

from studio import wire
from studio.camera.client.spool import Origin, Spool

log = logging.getLogger(__name__)

RECENT = 60
"""Frames kept before this client hears of a take, because the take may have begun with them."""

UNKNOWN_DAYS = 30
"""Retention of frames of a take that the server lacks [days]; another server or a restored take may need them."""

Key = tuple[str, str]
"""Take id and boot id."""


class Keeper:
    """Keeps the frames of recordings in a spool; all methods belong to the client's event loop.

    Args:
        spool: storage of the frames; None keeps nothing.
        hello: of this start of the client.
        wake: called when there may be something to send.
        drop_unknown: delete frames of takes that the server lacks, however new they are.
    """

    def __init__(
        self,
        spool: Spool | None,
        hello: wire.Hello,
        wake: Callable[[], None],
        *,
        drop_unknown: bool = False,
    ) -> None:
        self._drop_unknown = drop_unknown
        self._spool = spool
        self._hello = hello
        self._wake = wake
        self._active: Origin | None = None
        self._confirmed = False  # whether the server has named the take on this connection
        self._answered: set[Key] = set()
        self._unsent: dict[Key, dict[int, None]] = {}  # ordered sets
        self._newest = -1
        self._recent: deque[tuple[int, bytes]] = deque(maxlen=RECENT)

    @property
    def recording(self) -> bool:
        """Whether frames are being kept, as far as this client knows."""
        return self._active is not None

    @property
    def newest(self) -> int:
        """Number of the newest frame; -1 = none yet."""
        return self._newest

    @property
    def owed(self) -> int:
        """Number of kept frames that are not acknowledged and that the server may need."""
        return 0 if self._spool is None else self._spool.frames - self._spool.unknown_frames

    @property
    def unknown(self) -> int:
        """Number of kept frames of takes that the server lacks."""
        return 0 if self._spool is None else self._spool.unknown_frames

    @property
    def refused(self) -> int:
        """Number of frames of recordings that did not fit."""
        return 0 if self._spool is None else self._spool.refused

    @property
    def problem(self) -> str:
        """Why frames are not kept, for people; "" = no problem."""
        return "" if self._spool is None or not self._spool.problem else self._spool.problem

    def frame(self, sequence: int, data: bytes) -> None:
        """Register a frame of the source, before it is sent."""
        self._newest = sequence
        self._recent.append((sequence, data))
        if self._active is not None and self._spool is not None:
            self._spool.append(self._active, sequence, data)

    def dropped(self, sequence: int) -> None:
        """Register a frame that a slow network did not take; send it later, if it is kept."""
        if self._active is not None:
            self._unsent.setdefault(self._active.key, {})[sequence] = None
        elif self._recent and self._recent[0][0] <= sequence:
            self._recent = deque((one for one in self._recent if one[0] != sequence), maxlen=RECENT)

    def connected(self) -> list[wire.Kept]:
        """Handle a new connection; return the messages to send on it."""
        self._confirmed = False
        self._recent.clear()  # the server does not have the frames that come now
        self._answered = set()
        self._unsent = {}
        if self._spool is None:
            return []
        out: list[wire.Kept] = []
        for origin in self._spool.origins():
            if origin.hello.name == self._hello.name:
                out += self._offer(origin.key)
            elif (
                origin.key not in self._spool.unknown
            ):  # of a camera of another name that used this spool before
                self._spool.unknown.add(origin.key)
                log.warning(
                    "frames of camera %s are in the spool of %s and stay there; start a client of that name with "
                    "this --spool to deliver them",
                    origin.hello.name, self._hello.name,
                )  # fmt: skip
        if self._active is not None and self._active.key not in self._unsent:
            out.append(self._begin(self._active))
        return out

    def _begin(self, origin: Origin) -> wire.Kept:
        """Start to keep frames, with those sent just before this client heard of the take."""
        self._answered.add(origin.key)
        first = self._newest + 1
        if self._spool is not None:
            for sequence, data in self._recent:
                if self._spool.append(origin, sequence, data):
                    first = min(first, sequence)
        return self._kept(origin, first, self._newest)

    def recording_changed(self, message: wire.Recording) -> list[wire.Kept]:
        """Handle the server's report whether it records; return the messages to send."""
        before, confirmed = self._active, self._confirmed
        if message.active and before is not None and before.take_id == message.take_id:
            self._confirmed = True
            return []
        self._active, out = None, []
        if (
            before is not None and not confirmed
        ):  # it ended while the link was down; else the last `Ack` is on its way
            self._answered.discard(before.key)
            out += self._offer(before.key)
        if message.active and message.take_id:
            self._active, self._confirmed = Origin(message.take, message.take_id, self._hello), True
            if self._spool is not None and self._active.key not in self._unsent:
                out.append(self._begin(self._active))
        return out

    def acknowledged(self, message: wire.Ack) -> list[wire.Kept]:
        """Handle the server's report of the frames on its disk; return the messages to send.

        If a take has ended, frames still missing were in transit and are offered again.
        """
        key = (message.take_id, message.boot_id)
        if self._spool is None:
            return []
        if not message.known:
            self._not_known(key)
            return []
        self._spool.unknown.discard(key)
        for sequence in self._spool.acknowledge(key, message.up_to, message.missing):
            self._unsent.get(key, {}).pop(sequence, None)
        if message.up_to == wire.ENDED:
            self._answered.discard(key)
            return self._offer(key)
        if key not in self._answered:
            self._answered.add(key)
            self._wake()
        return []

    def _not_known(self, key: Key) -> None:
        """Handle a take that the server lacks: keep its frames for a while, and inform the operator."""
        assert self._spool is not None
        self._unsent.pop(key, None)
        frames, days = len(self._spool.sequences(key)), self._spool.age_s(key) / 86400.0
        if self._drop_unknown or days > UNKNOWN_DAYS:
            self._spool.forget(key)
            log.warning(
                "%d frames of a take that the server does not have (%.0f days old) are deleted", frames, days
            )
        elif frames:
            self._spool.unknown.add(key)
            log.warning(
                "the server does not have a take that %d frames are kept for; they stay for %d days, or until "
                "--drop-unknown is given",
                frames, UNKNOWN_DAYS,
            )  # fmt: skip

    def _offer(self, key: Key) -> list[wire.Kept]:
        """Offer a take's kept frames, and send them after the answer."""
        if self._spool is None:
            return []
        kept = self._spool.sequences(key)
        origin = next((origin for origin in self._spool.origins() if origin.key == key), None)
        if not kept or origin is None:
            return []
        self._unsent[key] = dict.fromkeys(kept)
        return [self._kept(origin, kept[0], kept[-1])]

    def sent(self, sequence: int) -> None:
        """Register a frame of this start that was passed to the network."""
        for (_, boot_id), waiting in self._unsent.items():
            if boot_id == self._hello.boot_id:
                waiting.pop(sequence, None)

    @property
    def has_late(self) -> bool:
        """Whether a kept frame should be sent now."""
        return any(waiting for key, waiting in self._unsent.items() if key in self._answered)

    def next_late(self) -> wire.Late | None:
        """Return the oldest kept frame to send again, None if there is none."""
        assert self._spool is not None
        for key in self._answered:
            waiting = self._unsent.get(key)
            while waiting:
                sequence = next(iter(waiting))
                del waiting[sequence]
                data = self._spool.read(key, sequence)
                if data is not None:
                    return wire.Late(*key, data)
        return None

    def _kept(self, origin: Origin, first: int, last: int) -> wire.Kept:
        earlier = origin.hello.boot_id != self._hello.boot_id
        return wire.Kept(origin.take_id, origin.hello.boot_id, first, last, origin.hello if earlier else None)
