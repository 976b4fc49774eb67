"""A stage and its clients in one process on a clock of their own: real keepers, spools, recorder, late frames, files.

The link is a function call; everything else is real. A killed server leaves what it has handed to the system: its
folder is copied at that moment, and the next server works with the copy.
"""

import shutil
from collections import defaultdict, deque
from pathlib import Path

import numpy as np

from studio import wire
from studio.camera.client.keeper import Keeper
from studio.camera.client.link import QUEUE_FRAMES
from studio.camera.client.spool import Spool
from studio.engine.model.joints import JOINT_COUNT
from studio.live import LiveStage
from tests.api.camera import wait_until
from tests.live.performer import hello

PERIOD_NS = 33_333_333
MS = 1_000_000
NOBODY = np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT)

Frames = set[tuple[str, str, int]]
"""Camera, start of its client, sequence."""


class World:
    """Time, the server, and what is true of every take.

    Attributes:
        now_ns: the present on the server's clock.
        taken_ns: when each frame was taken.
        spans: beginning and end of each take by its id; spooled: what clients have kept for it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.now_ns = 10**15
        self.taken_ns: dict[tuple[str, str, int], int] = {}
        self.spans: dict[str, list[int]] = {}
        self.spooled: dict[str, Frames] = defaultdict(set)
        self.joined: dict[str, set[tuple[str, str]]] = defaultdict(set)
        self.paths: dict[str, str] = {}
        self.clients: list[Client] = []
        self.stage: LiveStage | None = None
        self.servers = 0
        self.sessions = folder / "sessions_0"
        self.start_server()

    def start_server(self) -> None:
        if self.stage is None:
            self.stage = LiveStage(self.sessions, clock_ns=lambda: self.now_ns)
            self.stage.start(prepare=False)

    def kill_server(self) -> None:
        """Go on with the folder as it is at this moment."""
        if self.stage is None:
            return
        self.servers += 1
        old, self.sessions = self.sessions, self.folder / f"sessions_{self.servers}"
        shutil.copytree(old, self.sessions, ignore=shutil.ignore_patterns(".*"))
        for client in self.clients:
            client.link = None
        self.stage.close()
        self.stage = None

    def end_server(self) -> None:
        """End it in order; a take under way is stopped and saved."""
        if self.stage is not None:
            for client in self.clients:
                client.disconnect()
            self.stage.close()
            self.stage = None

    @property
    def take_id(self) -> str | None:
        """Of the recording under way."""
        recording = None if self.stage is None else self.stage._engine.recording
        return None if recording is None else recording.recorder.take_id

    def record(self) -> None:
        if self.stage is None or self.take_id is not None:
            return
        self.now_ns += MS
        summary = self.stage.start_recording("day")
        assert self.take_id is not None
        self.paths[self.take_id] = summary.take
        self.spans[self.take_id] = [self.now_ns, 2**62]
        self.pump()

    def stop(self) -> None:
        if self.stage is None or (take_id := self.take_id) is None:
            return
        self.now_ns += MS
        self.stage.stop_recording()
        self.spans[take_id][1] = self.now_ns
        self.now_ns += MS
        self.pump()

    def run(self, frames: int) -> None:
        """Every client captures so many frames, and sends them if its link is up."""
        for _ in range(frames):
            self.now_ns += PERIOD_NS
            for client in self.clients:
                client.take_frame()
        self.pump()

    def pump(self) -> None:
        """Hand messages over until nobody has any; the stage has done what was handed to it."""
        while self.stage is not None:
            self.stage._engine.call(lambda: None)
            if not sum(client.listen() for client in self.clients):
                return

    def settle(self) -> None:
        """Wait until no connected client owes a frame."""

        def settled() -> bool:
            self.pump()
            return all(client.keeper.owed == 0 for client in self.clients if client.link is not None)

        wait_until(settled, "nothing is owed")


class Client:
    """A camera client: its program starts again and again, each time with another clock."""

    def __init__(self, world: World, name: str, spool: Path) -> None:
        self.world, self.name, self._folder = world, name, spool
        self.starts = 0
        self.spool: Spool | None = None
        self.link = None
        world.clients.append(self)
        self.start()

    def start(self, offset_ns: int = 0) -> None:
        """Begin anew, as after a kill, with the spool that was left; the clock is ahead by so much."""
        self.end()
        self.starts += 1
        self.hello = hello(self.name, boot_id=f"{self._folder.name}-{self.starts}")
        self.spool = Spool(self._folder)
        self.keeper = Keeper(self.spool, self.hello, lambda: None)
        self.sequence, self._offset_ns = 0, offset_ns
        self._queue: deque[tuple[int, bytes]] = deque()
        self._messages: list[wire.Message] = []

    def end(self) -> None:
        self.disconnect()
        if self.spool is not None:
            self.spool.close()
            self.spool = None

    def connect(self) -> None:
        """Connect, exchange clocks, say what is kept, send what waits."""
        stage = self.world.stage
        if stage is None or self.link is not None:
            return
        if any(other.link is not None and other.name == self.name for other in self.world.clients):
            return
        self.world.now_ns += MS
        self._messages = []
        self.link = stage.join(self.hello, send=self._messages.append)
        stage.recordings.welcomed(self.link)
        self._exchange()
        for kept in self.keeper.connected():
            stage.keeping.kept(self.link, kept)
        self._note()
        recording = stage._engine.recording
        if recording is not None:
            wait_until(lambda: any(isinstance(m, wire.Recording) for m in self._messages), "it is told")
        self._send_queue()
        self.world.pump()

    def _exchange(self) -> None:
        now = self.world.now_ns
        device = now + self._offset_ns
        sample = wire.ClockSample(device - 100_000, now, now, device + 100_000)
        self.world.stage.clock_sample(self.link, sample)

    def disconnect(self) -> None:
        """The link is cut: what the server says is lost from now on."""
        if self.link is not None and self.world.stage is not None:
            self.world.stage.leave(self.link, "cut")
        self.link, self._messages = None, []

    def take_frame(self) -> None:
        if self.spool is None:
            return
        self.sequence += 1
        message = wire.skeleton_frame(self.sequence, self.world.now_ns + self._offset_ns, *NOBODY)
        data = wire.encode(message)
        self.world.taken_ns[self.name, self.hello.boot_id, self.sequence] = self.world.now_ns
        self.keeper.frame(self.sequence, data)
        self._note()
        self._queue.append((self.sequence, data))
        if len(self._queue) > QUEUE_FRAMES:
            self.keeper.dropped(self._queue.popleft()[0])
        self._send_queue()

    def _send_queue(self) -> None:
        while self.link is not None and self._queue:
            sequence, data = self._queue.popleft()
            self.world.stage.frame(self.link, wire.decode(data), data, self.world.now_ns)
            self.keeper.sent(sequence)
        self._note()

    def _note(self) -> None:
        """What is kept now, for the truth; who was connected within which take."""
        for origin in self.spool.origins():
            owned = self.world.spooled[origin.take_id]
            owned |= {(self.name, origin.hello.boot_id, n) for n in self.spool.sequences(origin.key)}
        if self.link is not None and (take_id := self.world.take_id) is not None:
            self.world.joined[take_id].add((self.name, self.hello.boot_id))

    def listen(self) -> int:
        """Take in what the server says, send what that asks for; return how many messages went either way."""
        if self.link is None:
            return 0
        stage, count = self.world.stage, 0
        while self._messages:
            message = self._messages.pop(0)
            count += 1
            said = []
            if isinstance(message, wire.Recording):
                said = self.keeper.recording_changed(message)
            elif isinstance(message, wire.Ack):
                said = self.keeper.acknowledged(message)
            self._note()
            for kept in said:
                stage.keeping.kept(self.link, kept)
        while self.keeper.has_late and (late := self.keeper.next_late()) is not None:
            stage.keeping.late(self.link, late, self.world.now_ns)
            count += 1
        return count
