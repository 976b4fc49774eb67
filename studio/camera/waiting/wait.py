"""The client's side: it announces itself, shows a code, and waits until a studio that knows the code calls."""

import asyncio
import contextlib
import ipaddress
import logging
import signal
import socket
import uuid
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass

import ifaddr
from zeroconf import IPVersion, ServiceInfo
from zeroconf.asyncio import AsyncZeroconf

from studio.camera.client.link import link_url
from studio.camera.waiting.pairing import (
    MAX_LINE,
    SERVICE,
    TALK_S,
    Pairing,
    line_of,
    new_code,
    new_nonce,
    read_line,
    text_in,
)
from studio.engine.base.errors import SettingsError, StudioError

TTL_S = 60
"""Time until the announcement of a killed client expires [s]."""

_MOST_CALLS = 4
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StudioCall:
    """A studio's call: its address, and the token for its link."""

    server: str
    token: str


def wait_for_call(name: str, kind: str, host: str, show: Callable[[str], None]) -> StudioCall | None:
    """Announce a camera and wait for a studio's call; return None if the client is stopped.

    Args:
        name: of the camera.
        kind: of its source, for people.
        host: address to wait on: of one network, 127.0.0.1 for this machine alone, 0.0.0.0 for all.
        show: shows the code to the camera's operator.

    Raises:
        SettingsError: the host is no address of this machine.
        StudioError: it cannot be announced.
    """
    try:
        return asyncio.run(_wait(name, kind, host, show))
    except (asyncio.CancelledError, KeyboardInterrupt):
        return None


async def _wait(name: str, kind: str, host: str, show: Callable[[str], None]) -> StudioCall:
    task, loop = asyncio.current_task(), asyncio.get_running_loop()
    assert task is not None
    with contextlib.suppress(NotImplementedError, ValueError):  # Windows; a thread, which hears no signal
        loop.add_signal_handler(signal.SIGTERM, task.cancel)
    code, called = new_code(), loop.create_future()
    talks = asyncio.Semaphore(_MOST_CALLS)

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with talks:
                call = await asyncio.wait_for(_talk(reader, writer, code), TALK_S)
            if call is not None and not called.done():
                called.set_result(call)
        except (OSError, StudioError, ValueError, TimeoutError, asyncio.IncompleteReadError):
            _log.debug("a caller that is no studio")
        finally:
            writer.close()

    try:
        server = await asyncio.start_server(answer, str(ipaddress.IPv4Address(host)), 0, limit=MAX_LINE)
    except (OSError, ValueError) as error:
        raise SettingsError(
            "waiting.host",
            "cannot wait on {host!r}: {error}; give an address of this machine, or 0.0.0.0 for all",
            host=host,
            error=getattr(error, "strerror", None) or str(error),
        ) from error
    async with server, _announced(name, kind, host, server.sockets[0].getsockname()[1]):
        show(code)
        return await called


async def _talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, code: str) -> StudioCall | None:
    """Return the call of a studio that knows the code; None if it does not."""
    nonce = new_nonce()
    writer.write(line_of(nonce=nonce))
    await writer.drain()
    said = read_line(await reader.readuntil(b"\n"))
    server = text_in(said, "server")
    link_url(server)  # raises if it is no address
    pairing = await asyncio.to_thread(Pairing.of, code, nonce, text_in(said, "nonce"), server)
    knows = pairing.proves("studio", said.get("proof"))
    writer.write(line_of(proof=pairing.proof("client")) if knows else line_of(refused="code"))
    await writer.drain()
    if not knows:
        _log.warning("a studio at %s called with a wrong code", server)
        return None
    return StudioCall(server, pairing.token)


@contextlib.asynccontextmanager
async def _announced(name: str, kind: str, host: str, port: int) -> AsyncIterator[None]:
    """Announce a camera during the block: its name, the kind of its source, address and port; nothing secret."""
    everywhere = ipaddress.ip_address(host).is_unspecified
    addresses = own_addresses() if everywhere else [host]
    info = ServiceInfo(
        SERVICE,
        f"{name}.{SERVICE}",
        port=port,
        addresses=[socket.inet_aton(one) for one in addresses],
        properties={"name": name, "kind": kind},
        server=f"capture-camera-{uuid.uuid4().hex[:12]}.local.",
        host_ttl=TTL_S,
        other_ttl=TTL_S,
    )
    try:
        zeroconf = (
            AsyncZeroconf(ip_version=IPVersion.V4Only)
            if everywhere
            else AsyncZeroconf(interfaces=[host], ip_version=IPVersion.V4Only)
        )
    except OSError as error:
        raise StudioError(
            "waiting.no_mdns",
            "the camera cannot be announced ({error}); give the studio's address with --server instead",
            error=error.strerror or str(error),
        ) from error
    try:
        await zeroconf.async_register_service(info, allow_name_change=True)
        yield
    finally:
        await zeroconf.async_unregister_all_services()
        await zeroconf.async_close()


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses in networks; the loopback's if there is no other."""
    found = [str(ip.ip) for adapter in ifaddr.get_adapters() for ip in adapter.ips if ip.is_IPv4]
    outside = [one for one in found if not ipaddress.ip_address(one).is_loopback]
    return outside or ["127.0.0.1"]
