"""Protects the studio from other sites' pages in a visitor's browser.

Browsers name the page's site in `Origin`. Every change, and every WebSocket, is refused if
that is not the host of the request. Programs other than browsers send no `Origin`.
"""

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from studio.api.errors import error_response

_SAFE = ("GET", "HEAD")


class OriginGuard:
    """ASGI middleware that answers 403 to requests from pages of another site."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] in ("http", "websocket") and not _allowed(scope):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": "another site's page"})
                return
            response = error_response(403, "origin", "a page of another site may not operate the studio")
            await response(scope, receive, send)
            return
        await self._app(scope, receive, send)


def _allowed(scope: Scope) -> bool:
    headers = Headers(scope=scope)
    origin = headers.get("origin")
    if origin is None or (scope["type"] == "http" and scope["method"] in _SAFE):
        return True
    return urlsplit(origin).netloc.lower() == headers.get("host", "").lower() != ""
