"""Limits on request bodies, and headers that prevent browsers from guessing the type of an answer.

A body is kept in memory until it is read; routes that accept files count the bytes themselves.
"""

import re

from fastapi import HTTPException
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from studio.api.errors import error_response
from studio.engine.base.sentences import say

MAX_BODY_BYTES = 4 << 20
"""Largest body; a blind test of a hundred pairs with all its texts has 0.1 MB."""

_TAKES_FILES = re.compile(r"/api/v1/(rigs/[^/]+|imports/[^/]+|takes/[^/]+/[^/]+/(file|references/[^/]+))")
_TOO_LARGE = say("request.too_large", "a request may have {mb} MB at most", mb=MAX_BODY_BYTES >> 20)


class BodyGuard:
    """ASGI middleware that answers 413 to bodies over `MAX_BODY_BYTES`, announced or not."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or _TAKES_FILES.fullmatch(scope["path"]):
            await self._app(scope, receive, send)
            return
        size, announced = 0, Headers(scope=scope).get("content-length", "0")

        async def counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > MAX_BODY_BYTES:
                raise HTTPException(413, _TOO_LARGE)
            return message

        async def hanging_up(message: Message) -> None:
            """Ignore the rest of a body that is too large."""
            if message["type"] == "http.response.start" and message["status"] == 413:
                MutableHeaders(scope=message)["Connection"] = "close"
            await send(message)

        if not announced.isdigit() or int(announced) > MAX_BODY_BYTES:
            await error_response(413, "too_large", _TOO_LARGE)(scope, receive, hanging_up)
        else:
            await self._app(scope, counted, hanging_up)


class PlainAnswers:
    """ASGI middleware: browsers must use every answer's declared type, and must not show it in other sites'
    frames."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def plain(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers["X-Content-Type-Options"] = "nosniff"
                headers.setdefault("X-Frame-Options", "SAMEORIGIN")
                headers.setdefault("Referrer-Policy", "no-referrer")
            await send(message)

        await self._app(scope, receive, plain if scope["type"] == "http" else send)
