"""Uploads recorded videos to the server between takes, at a part of the link's speed."""

import asyncio
import hashlib
import http.client
import json
import logging
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from typing import Any

from studio.camera.client.keeper import UNKNOWN_DAYS
from studio.camera.client.video_spool import SpooledPart, VideoSpool

PIECE_BYTES = 256 << 10
RETRY_S = 5.0
_REST = 3.0
"""Pause after a piece, as a multiple of the time that the piece took."""
_TIMEOUT_S = 30.0

log = logging.getLogger(__name__)


class _StaysHere(urllib.request.HTTPRedirectHandler):
    """Follows no redirect: the token is for one server."""

    def redirect_request(self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str) -> None:
        return None


class VideoSender:
    """Uploads the parts in a spool.

    Args:
        spool: of this client.
        url: of the server's route for videos.
        token: of the camera; may be empty.
        tls: settings for a server that the system does not trust.
        may_send: returns whether sending is allowed now.
    """

    def __init__(
        self,
        spool: VideoSpool,
        url: str,
        token: str,
        tls: ssl.SSLContext | None,
        may_send: Callable[[], bool],
    ) -> None:
        self._spool, self._url, self._may_send = spool, url, may_send
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        proxies = urllib.request.ProxyHandler({})
        self._opener = urllib.request.build_opener(
            proxies, urllib.request.HTTPSHandler(context=tls), _StaysHere()
        )

    async def run(self) -> None:
        """Send until cancelled."""
        while True:
            await asyncio.sleep(RETRY_S)
            if not self._may_send():
                continue
            try:
                await self.send_all()
            except (OSError, http.client.HTTPException, ValueError) as error:
                log.info("videos are not sent yet: %s", error)

    async def send_all(self) -> None:
        """Send every part that the server wants now; returns early once sending is no longer allowed.

        Raises:
            OSError, HTTPException, ValueError: the server does not answer, or not as a studio.
        """
        for part in self._spool.parts():
            if self._may_send():
                await self._send(part)

    async def _send(self, part: SpooledPart) -> None:
        times_ns = part.times_ns()
        if not times_ns or not part.path.is_file() or not part.path.stat().st_size:
            part.delete()
            return
        data, described = await asyncio.to_thread(_described, part, times_ns)
        answer = await asyncio.to_thread(self._ask, "POST", self._url, described)
        while answer["state"] == "wanted" and self._may_send():
            at, began_s = int(answer["received"]), time.monotonic()
            piece = data[at : at + PIECE_BYTES]
            answer = await asyncio.to_thread(self._ask, "PUT", f"{self._url}/{answer['id']}?at={at}", piece)
            await asyncio.sleep(min(_REST * (time.monotonic() - began_s), RETRY_S))
        forgotten = answer["state"] == "unknown" and part.age_s > UNKNOWN_DAYS * 86_400
        if forgotten or answer["state"] in ("kept", "unwanted"):
            part.delete()
        if answer["state"] == "unwanted":
            log.warning("a video of take %s is not wanted: %s", part.origin.take_id, answer["reason"])

    def _ask(self, method: str, url: str, data: bytes) -> dict[str, Any]:
        kind = "application/json" if method == "POST" else "application/octet-stream"
        headers = {**self._headers, "Content-Type": kind}
        request = urllib.request.Request(url, data, headers, method=method)
        with self._opener.open(request, timeout=_TIMEOUT_S) as answer:
            value = json.loads(answer.read(1 << 20))
        if not isinstance(value, dict) or not {"state", "received", "id"} <= value.keys():
            raise ValueError(f"{url} does not answer as a studio")
        return value


def _described(part: SpooledPart, times_ns: list[int]) -> tuple[bytes, bytes]:
    """Return the bytes of a part, and its description."""
    data, origin = part.path.read_bytes(), part.origin
    described = {
        "take_id": origin.take_id, "name": origin.name, "boot_id": origin.boot_id,
        "from_sequence": origin.from_sequence, "size": len(data), "sha256": hashlib.sha256(data).hexdigest(),
        "ending": part.path.suffix, "times_ns": times_ns,
    }  # fmt: skip
    return data, json.dumps(described).encode()
