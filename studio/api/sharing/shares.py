"""Routes of share links: a solve as one HTML file with its replay, and a link to that file only."""

import html
import re
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import HTMLResponse, Response
from msgspec import structs
from pydantic import Field

from studio.api.address import address_for_others
from studio.api.cameras.qr import qr_picture
from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.review.share.store import MAX_TITLE, NoSuchShare, ShareLink, Shares
from studio.worker import run_in_process

SHARE_PATH = "/share"
_POLICY = re.compile(rb'http-equiv="Content-Security-Policy" content="([^"]*)"')
_SANDBOX = "sandbox allow-scripts; frame-ancestors 'none'"
"""The page behind a link has its own origin, without the studio's cookies, storage and routes."""

_GONE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>No replay</title>
<body style="font: 16px system-ui, sans-serif; display: grid; place-content: center; height: 100vh; margin: 0">
<p>This link leads to no replay. It may have been taken back.</p></body></html>"""


class ShareRequest(Request):
    """Title of a replay, and the part of the solve."""

    title: str = Field(default="", max_length=MAX_TITLE, description="the take's name where left out")
    start_s: Annotated[float | None, Field(ge=0, description="begin so far into the solve [s]")] = None
    end_s: Annotated[float | None, Field(gt=0, description="end so far into the solve [s]")] = None


class ListedShare(ShareLink, frozen=True, kw_only=True):
    """A link as shown to the operator, with its path."""

    path: str


def shares_router(finder: Finder, shares: Shares) -> APIRouter:
    """Return the routes of share links."""
    router = APIRouter(tags=["shares"], responses=RESPONSES, route_class=StructRoute)

    @router.post("/api/v1/takes/{session}/{take}/solves/{solve}/share", status_code=201)
    def add_share(session: str, take: str, solve: str, request: ShareRequest | None = None) -> ListedShare:
        """Make a replay of a solve as one HTML file, and a link to it; answers the link. It is the earlier link if
        there is one to the same replay.
        """
        request = request or ShareRequest()
        opened = finder.take(session, take)
        poses = finder.solve(opened, solve)
        what = {
            "title": request.title.strip() or take,
            "take": f"{session}/{take}",
            "solve": solve,
            "start_s": request.start_s,
            "end_s": request.end_s,
        }
        known = shares.same(**what, since=datetime.fromtimestamp(poses.stat().st_mtime, UTC))
        if known is not None:
            return _line(known)
        day = datetime.fromisoformat(opened.meta["created"]).astimezone().strftime("%Y-%m-%d")
        page = run_in_process(
            "studio.review.share.page:solve_page", opened, solve, title=what["title"], subtitle=f"{solve} · {day}",
            start_s=request.start_s, end_s=request.end_s,
        )  # fmt: skip
        return _line(shares.add(page, **what))

    @router.get("/api/v1/shares")
    def get_shares() -> list[ListedShare]:
        """All links, the newest first."""
        return [_line(share) for share in shares.list()]

    @router.delete("/api/v1/shares/{share}")
    def remove_share(share: str) -> ListedShare:
        """Revoke a link. It can be restored for a day."""
        return _line(shares.remove(share))

    @router.post("/api/v1/shares/{share}/restore")
    def restore_share(share: str) -> ListedShare:
        """Restore a revoked link."""
        return _line(shares.restore(share))

    @router.get("/api/v1/shares/{share}/file", response_class=HTMLResponse)
    def get_file(share: str) -> HTMLResponse:
        """Download the replay: one HTML file that opens in any browser, without a network."""
        found = shares.get(share)
        name = re.sub(r"[^\w.-]+", "_", found.title, flags=re.ASCII).strip("._") or "replay"
        headers = {"Content-Disposition": f'attachment; filename="{name}.html"', "Cache-Control": "no-store"}
        return HTMLResponse(shares.page(found), headers=headers)

    @router.get("/api/v1/shares/{share}/qr", response_class=Response)
    def get_qr(share: str, http: HttpRequest) -> Response:
        """The link as a QR code, an SVG picture; at the address that other machines reach."""
        return qr_picture(address_for_others(http).url + _path(shares.get(share)))

    @router.get(SHARE_PATH + "/{token}", response_class=HTMLResponse, include_in_schema=False)
    def open_share(token: str) -> HTMLResponse:
        """The replay page of a link; it needs no signing in, and gives access to nothing else."""
        headers = {
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Robots-Tag": "noindex",
            "X-Content-Type-Options": "nosniff",
        }
        try:
            page = shares.page(shares.by_token(token))
        except NoSuchShare:
            policy = f"default-src 'none'; style-src 'unsafe-inline'; {_SANDBOX}"
            return HTMLResponse(_GONE, 404, headers | {"Content-Security-Policy": policy})
        return HTMLResponse(page, headers=headers | {"Content-Security-Policy": _policy(page)})

    return router


def _policy(page: bytes) -> str:
    """The file's own policy, and a sandbox."""
    own = _POLICY.search(page)
    rules = "default-src 'none'" if own is None else html.unescape(own[1].decode())
    return f"{rules}; {_SANDBOX}"


def _path(share: ShareLink) -> str:
    return f"{SHARE_PATH}/{share.token}"


def _line(share: ShareLink) -> ListedShare:
    return ListedShare(**structs.asdict(share), path=_path(share))
