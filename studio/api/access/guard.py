"""Check of every request: without signing in, only the sign-in page and the camera link are available."""

from http.cookies import CookieError, SimpleCookie
from urllib.parse import quote

from starlette.datastructures import Headers
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from studio.api.access.tokens import Access, Role
from studio.api.errors import error_response
from studio.engine.base.sentences import say
from studio.wire import LINK_PATH, VIDEO_PATH

COOKIE = "studio_operator"
SIGN_IN_PATH = "/signin"
SIGN_IN_API = "/api/v1/access/signin"
_OPEN = {SIGN_IN_PATH, SIGN_IN_API, LINK_PATH, "/static/access/signin.js", "/static/icon.svg", "/health"}
_OPEN |= {f"/static/cameras/{name}" for name in ("camera_page.js", "camera_command.js", "cameras.css")} | {
    "/camera"
}
_OPEN |= {"/phone", "/api/v1/phones", VIDEO_PATH}
_OPEN_BELOW = (
    "/vote/",
    "/share/",
    "/api/v1/vote/",
    "/static/vendor/",
    "/static/vote/",
    "/static/base/",
    "/static/phone/",
    "/models/",
    f"{VIDEO_PATH}/",
)
"""Paths for voters of blind tests, readers of replays, and cameras; the routes behind them check the token."""

_LOOKS = {"GET", "HEAD", "OPTIONS"}
_SIGN_OUT_API = "/api/v1/access/signout"
_NOT_FOR_VIEWERS = (
    "/api/v1/access/",
    "/api/v1/blind",
    "/api/v1/devices",
    "/api/v1/exports",
    "/api/v1/phones/",
    "/api/v1/recordings",
    "/api/v1/reference-files",
    "/api/v1/remote",
    "/api/v1/shares",
    "/blind",
    "/remote",
)
_NOT_FOR_VIEWERS_AT_ALL = ("/export", "/file", "/report")
"""Beginnings and ends of paths that viewers may not read: data of takes, names of other files, links, keys of blind
tests.
"""

_CLOSE = {"type": "websocket.close", "code": 4401, "reason": say("access.sign_in", "sign in first")}


def is_open(path: str) -> bool:
    """Whether a path is available without signing in."""
    return path in _OPEN or (path.startswith(_OPEN_BELOW) and ".." not in path)


def may_look(scope: Scope) -> bool:
    """Whether a request or a WebSocket only reads, and only what viewers may see."""
    path = scope["path"]
    if path == _SIGN_OUT_API:
        return True
    if path.startswith(_NOT_FOR_VIEWERS) or path.endswith(_NOT_FOR_VIEWERS_AT_ALL):
        return False
    return scope["type"] == "websocket" or scope["method"] in _LOOKS


class AccessGuard:
    """ASGI middleware: passes operators, viewers for reading, and everybody on open paths.

    A browser has its key in a cookie, a program sends the token as `Authorization: Bearer <token>`.
    `scope["state"]["role"]` is the role of the client.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self._access.required or scope["type"] not in ("http", "websocket") or is_open(scope["path"]):
            await self._app(scope, receive, send)
            return
        role = self._role(scope)
        if role == "operator" or (role == "viewer" and may_look(scope)):
            scope.setdefault("state", {})["role"] = role
            await self._app(
                scope, receive, self._watched(scope, send) if scope["type"] == "websocket" else send
            )
        elif scope["type"] == "websocket":
            await send(_CLOSE)
        elif role == "viewer":
            message = say(
                "access.viewer",
                "you are a viewer, who may look but not change or download; sign in as the operator",
            )
            await error_response(403, "viewer", message)(scope, receive, send)
        elif _is_page(scope):
            await RedirectResponse(f"{SIGN_IN_PATH}?next={quote(scope['path'])}", 303)(scope, receive, send)
        else:
            message = "sign in first, or send the operator's token as `Authorization: Bearer TOKEN`"
            await error_response(401, "signed_out", message)(scope, receive, send)

    def _role(self, scope: Scope) -> Role | None:
        headers = Headers(scope=scope)
        role = self._access.role_of_key(cookie_key(headers))
        token = _bearer(headers)
        if role is not None or not token:
            return role
        address = scope["client"][0] if scope.get("client") else ""
        return self._access.check_token(token, address) if self._access.may_try(address) else None

    def _watched(self, scope: Scope, send: Send) -> Send:
        """Return `send` of a WebSocket that is closed once its user is signed out."""
        headers = Headers(scope=scope)
        key, token = cookie_key(headers), _bearer(headers)
        open_ = True

        async def checked(message: Message) -> None:
            nonlocal open_
            if open_ and not (self._access.role_of_key(key) or self._access.role_of_token(token)):
                open_ = False
                await send(_CLOSE)
            if open_:
                await send(message)

        return checked


def _bearer(headers: Headers) -> str:
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else ""


def cookie_key(headers: Headers) -> str:
    """Return the key in a request's cookie; may be empty."""
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value


def _is_page(scope: Scope) -> bool:
    """Whether a browser requests a page."""
    accept = Headers(scope=scope).get("accept", "")
    return (
        scope["method"] in ("GET", "HEAD")
        and not scope["path"].startswith("/api/v1/")
        and "text/html" in accept
    )
