"""The pages (Jinja2): `/`, `/signin`, `/blind`, `/remote`, `/camera`, `/phone`, `/vote/TOKEN`; the files.

Browsers of phones also get the models that find bodies in pictures.
"""

import secrets
from importlib import metadata
from pathlib import Path
from typing import Any

from anyio import to_thread
from fastapi import APIRouter, FastAPI, HTTPException, Request
from fastapi.responses import HTMLResponse, Response
from fastapi.staticfiles import StaticFiles
from fastapi.templating import Jinja2Templates
from starlette.datastructures import Headers
from starlette.staticfiles import NotModifiedResponse
from starlette.types import Scope

from studio.api.add_routes import add_routes
from studio.engine.seeing.pictures.bundle import MODELS
from studio.web.program import Program, is_vendor, program_of

_HERE = Path(__file__).parent
STATIC = _HERE / "static"
_POLICY = (
    "default-src 'self'; connect-src 'self' ws: wss:; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "frame-ancestors 'self'"
)

_PHONE_POLICY = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; "
    "frame-ancestors 'none'"
)
"""Policy of a phone's page and of its thread, which has its own: no other host, WebAssembly allowed."""


class _FreshFiles(StaticFiles):
    """Static files that a browser checks at every request, so that new and old versions are never mixed."""

    def file_response(self, *args, **kwargs):
        response = super().file_response(*args, **kwargs)
        response.headers["Cache-Control"] = "no-cache"
        return response


class _PageFiles(_FreshFiles):
    """The files of the pages; a module requested with `?bundle` is sent as the program that begins with it."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        asked = scope["query_string"].split(b"=")[0]
        name = path.replace("\\", "/")
        if asked in (b"bundle", b"map") and name.endswith(".js") and not is_vendor(name):
            program = await to_thread.run_sync(program_of, STATIC, name)
            response = self._fresh(program, asked, Headers(scope=scope))
        if name.startswith("phone/"):
            response.headers["Content-Security-Policy"] = _PHONE_POLICY
        return response

    def _fresh(self, program: Program, asked: bytes, headers: Headers) -> Response:
        content, kind = (program.text, "javascript") if asked == b"bundle" else (program.source_map, "json")
        fresh = {"ETag": f'"{program.tag}"', "Cache-Control": "no-cache"}
        if self.is_not_modified(Headers(fresh), headers):
            return NotModifiedResponse(Headers(fresh))
        return Response(content, media_type=f"text/{kind}", headers=fresh)


class _Models(_FreshFiles):
    """The models of a folder, and nothing else in it."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        if not path.endswith(".task"):
            raise HTTPException(404)
        return await super().get_response(path, scope)


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

    @router.get("/phone")
    async def phone_page(request: Request) -> HTMLResponse:
        response = page(request, "phone.html", {})
        response.headers["Content-Security-Policy"] = _PHONE_POLICY
        return response

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
    app.mount("/models", _Models(directory=MODELS), name="models")
    app.mount("/static", _PageFiles(directory=STATIC), name="static")
