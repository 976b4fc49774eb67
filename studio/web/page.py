"""The page at `/` (Jinja2) and its static files: plain ES modules, one style sheet, nothing built."""

from importlib import metadata
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles
from fastapi.templating import Jinja2Templates

_HERE = Path(__file__).parent
_POLICY = (
    "default-src 'self'; connect-src 'self' ws: wss:; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "frame-ancestors 'self'"
)


class _FreshFiles(StaticFiles):
    """Static files that a browser asks about every time: a new version is never mixed with an old one."""

    def file_response(self, *args, **kwargs):  # type: ignore[no-untyped-def]
        response = super().file_response(*args, **kwargs)
        response.headers["Cache-Control"] = "no-cache"
        return response


def add_page(app: FastAPI, *, sessions: Path) -> None:
    """Serve the page at `/` and its files at `/static`; the page says that takes lie in `sessions`."""
    templates = Jinja2Templates(directory=_HERE / "templates")
    router = APIRouter(include_in_schema=False)

    @router.get("/")
    async def stage_page(request: Request) -> HTMLResponse:
        context = {"version": metadata.version("capture-studio"), "sessions": sessions.resolve()}
        headers = {"Content-Security-Policy": _POLICY, "Cache-Control": "no-cache"}
        return templates.TemplateResponse(request, "stage.html", context, headers=headers)

    app.include_router(router)
    app.mount("/static", _FreshFiles(directory=_HERE / "static"), name="static")
