"""The pages (Jinja2): `/`, `/signin`, `/blind`, `/remote`, `/camera`, `/vote/TOKEN`; their files: ES modules."""

import secrets
from importlib import metadata
from pathlib import Path
from typing import Any

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles
from fastapi.templating import Jinja2Templates

from studio.api.add_routes import add_routes

_HERE = Path(__file__).parent
_POLICY = (
    "default-src 'self'; connect-src 'self' ws: wss:; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "frame-ancestors 'self'"
)


class _FreshFiles(StaticFiles):
    """Static files that a browser checks at every request, so that new and old versions are never mixed."""

    def file_response(self, *args, **kwargs):
        response = super().file_response(*args, **kwargs)
        response.headers["Cache-Control"] = "no-cache"
        return response


def add_page(app: FastAPI, *, sessions: Path) -> None:
    """Serve the pages and their files at `/static`; the page at `/` shows `sessions` as the folder of takes."""
    templates = Jinja2Templates(directory=_HERE / "templates")
    router = APIRouter(include_in_schema=False)

    @router.get("/")
    async def stage_page(request: Request) -> HTMLResponse:
        return page(request, "stage.html", {"sessions": sessions.resolve()})

    @router.get("/signin")
    async def sign_in_page(request: Request) -> HTMLResponse:
        return page(request, "signin.html", {})

    @router.get("/camera")
    async def camera_page(request: Request) -> HTMLResponse:
        return page(request, "camera.html", {})

    @router.get("/blind")
    async def blind_page(request: Request) -> HTMLResponse:
        return page(request, "blind.html", {})

    @router.get("/remote")
    async def remote_page(request: Request) -> HTMLResponse:
        return page(request, "remote.html", {})

    @router.get("/vote/{token}")
    async def voting_page(request: Request) -> HTMLResponse:
        return page(request, "vote.html", {})  # the same for every link; its content comes from the API

    def page(request: Request, template: str, context: dict[str, Any]) -> HTMLResponse:
        nonce = secrets.token_urlsafe(12)
        context = {"version": metadata.version("capture-studio"), "nonce": nonce, **context}
        policy = f"{_POLICY}; script-src 'self' 'nonce-{nonce}'"
        headers = {
            "Content-Security-Policy": policy,
            "Cache-Control": "no-cache",
            "Referrer-Policy": "no-referrer",
        }
        return templates.TemplateResponse(request, template, context, headers=headers)

    add_routes(app, router)
    app.mount("/static", _FreshFiles(directory=_HERE / "static"), name="static")
