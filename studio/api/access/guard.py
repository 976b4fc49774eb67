"""Stands before every route: without signing in there is the page to sign in, and the camera link."""

from http.cookies import CookieError, SimpleCookie
from urllib.parse import quote

from starlette.datastructures import Headers
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from studio.api.access.tokens import Access
from studio.api.errors import error_response
from studio.wire import LINK_PATH

COOKIE = "studio_operator"
SIGN_IN_PATH = "/signin"
SIGN_IN_API = "/api/v1/access/signin"
_OPEN = {SIGN_IN_PATH, SIGN_IN_API, LINK_PATH, "/static/studio.css", "/static/signin.js", "/static/icon.svg"}
_OPEN |= {"/health", "/static/theme.js"}
_OPEN_BELOW = (
    "/vote/",
    "/share/",
    "/api/v1/vote/",
    "/static/vendor/",
    "/static/vote",
    "/static/players.js",
    "/static/dom.js",
    "/static/strings",
)
"""What voters of blind tests and whoever got a replay reach: their own link's token is asked for behind these."""

_CLOSE = {"type": "websocket.close", "code": 4401, "reason": "sign in first"}


def is_open(path: str) -> bool:
    """Whether nobody needs to sign in for a path."""
    return path in _OPEN or (path.startswith(_OPEN_BELOW) and ".." not in path)


class AccessGuard:
    """ASGI middleware: lets operators through, and everybody to what is open.

    A browser carries its key in a cookie, a program the token as `Authorization: Bearer <token>`.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self._access.required or scope["type"] not in ("http", "websocket") or is_open(scope["path"]):
            await self._app(scope, receive, send)
        elif self._is_operator(scope):
            await self._app(
                scope, receive, self._watched(scope, send) if scope["type"] == "websocket" else send
            )
        elif scope["type"] == "websocket":
            await send(_CLOSE)
        elif _is_page(scope):
            await RedirectResponse(f"{SIGN_IN_PATH}?next={quote(scope['path'])}", 303)(scope, receive, send)
        else:
            message = "sign in first, or send the operator's token as `Authorization: Bearer TOKEN`"
            await error_response(401, "signed_out", message)(scope, receive, send)

    def _is_operator(self, scope: Scope) -> bool:
        headers = Headers(scope=scope)
        if self._access.is_signed_in(cookie_key(headers)):
            return True
        token = _bearer(headers)
        address = scope["client"][0] if scope.get("client") else ""
        return bool(token) and self._access.may_try(address) and self._access.check_token(token, address)

    def _watched(self, scope: Scope, send: Send) -> Send:
        """Return `send` of a WebSocket that is closed once its operator is signed out."""
        headers = Headers(scope=scope)
        key, token = cookie_key(headers), _bearer(headers)
        open_ = True

        async def checked(message: Message) -> None:
            nonlocal open_
            if open_ and not (self._access.is_signed_in(key) or self._access.is_operator_token(token)):
                open_ = False
                await send(_CLOSE)
            if open_:
                await send(message)

        return checked


def _bearer(headers: Headers) -> str:
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else ""


def cookie_key(headers: Headers) -> str:
    """Return the key in a request's cookie, empty where there is none."""
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value


def _is_page(scope: Scope) -> bool:
    """Whether a person's browser asks for a page."""
    accept = Headers(scope=scope).get("accept", "")
    return (
        scope["method"] in ("GET", "HEAD")
        and not scope["path"].startswith("/api/v1/")
        and "text/html" in accept
    )
