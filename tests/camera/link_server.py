"""A tiny server that speaks the camera protocol, for tests of the client's side."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from studio import wire

Answer = Callable[[wire.Hello], wire.Message]


def welcome(hello: wire.Hello) -> wire.Message:
    return wire.Welcome(name=hello.name, reference=True)


@dataclass
class LinkServer:
    """What arrived, in order, and the links that are open."""

    port: int = 0
    path: str = ""
    messages: list[wire.Message] = field(default_factory=list)
    arrival_ns: list[int] = field(default_factory=list)
    sockets: list[ServerConnection] = field(default_factory=list)
    answer: Answer = welcome
    reading: asyncio.Event = field(default_factory=asyncio.Event)

    def of(self, kind: type) -> list:
        return [message for message in self.messages if isinstance(message, kind)]

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    async def until(self, done: Callable[[], bool], timeout_s: float = 60.0) -> None:
        async with asyncio.timeout(timeout_s):
            while not done():
                await asyncio.sleep(0.01)

    async def serve(self, socket: ServerConnection) -> None:
        self.path = socket.request.path
        self.sockets.append(socket)
        # As in the studio's server, reading does not wait for replies.
        async with asyncio.TaskGroup() as replies:
            async for data in socket:
                await self.reading.wait()
                message = wire.decode(data)
                self.messages.append(message)
                self.arrival_ns.append(time.time_ns())
                replies.create_task(self._reply(socket, message))

    async def _reply(self, socket: ServerConnection, message: wire.Message) -> None:
        with contextlib.suppress(ConnectionClosed):  # the client has left; what it sent before is still read
            if isinstance(message, wire.Hello):
                await socket.send(wire.encode(self.answer(message)))
            elif isinstance(message, wire.ClockRequest):
                now = time.time_ns()
                reply = wire.ClockReply(
                    client_send_ns=message.client_send_ns,
                    server_receive_ns=now,
                    server_send_ns=time.time_ns(),
                )
                await socket.send(wire.encode(reply))


@asynccontextmanager
async def link_server(answer: Answer = welcome, port: int = 0) -> AsyncIterator[LinkServer]:
    """Yield a server on a free port (or `port`)."""
    server = LinkServer(answer=answer)
    server.reading.set()
    async with serve(server.serve, "127.0.0.1", port, compression=None) as listener:
        server.port = listener.sockets[0].getsockname()[1]
        yield server


@asynccontextmanager
async def running(work) -> AsyncIterator[asyncio.Task]:
    """Run a coroutine beside the block, and cancel it at the end."""
    task = asyncio.create_task(work)
    try:
        yield task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
