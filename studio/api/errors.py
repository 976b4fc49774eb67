"""Every failure as one JSON shape, `{"error": {"code": ..., "message": ...}}`, with a fitting HTTP status.

StudioError                             500 failed
├── SettingsError                       422 settings
├── FormatError                         422 format
├── CalibrationError                    409 calibration
├── TakeError                           409 take
├── NotAvailableError                   501 not_available
├── NotFoundError, NoSuchTest, NoSuchShare  404 not_found
├── TooMany                             429 too_many
└── VotingClosed                        410 closed
a request that does not fit its route   422 invalid_request
a body over the limit                   413 too_large
anything else                           500 internal (the traceback is in the server's log)
"""

import logging
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from studio.engine.base.errors import (
    CalibrationError,
    FormatError,
    NotAvailableError,
    SettingsError,
    StudioError,
    TakeError,
)
from studio.engine.base.sentences import codes_of, say
from studio.review.blind.desk import NoSuchTest, TooMany, VotingClosed
from studio.review.share.store import NoSuchShare

_log = logging.getLogger(__name__)


class NotFoundError(StudioError):
    """A take, solve or job that does not exist."""


class ErrorDetail(BaseModel):
    """A failure: `code` and `said` for programs, `message` for people.

    `said` has the message as a sentence with a code of its own, and with the values that it was made of.
    """

    code: str
    message: str
    said: list[dict[str, Any]] = []


class ErrorBody(BaseModel):
    """The body of every answer other than success."""

    error: ErrorDetail


KINDS: tuple[tuple[type[StudioError], int, str], ...] = (
    (NotFoundError, 404, "not_found"),
    (NoSuchTest, 404, "not_found"),
    (NoSuchShare, 404, "not_found"),
    (TooMany, 429, "too_many"),
    (VotingClosed, 410, "closed"),
    (SettingsError, 422, "settings"),
    (FormatError, 422, "format"),
    (CalibrationError, 409, "calibration"),
    (TakeError, 409, "take"),
    (NotAvailableError, 501, "not_available"),
    (StudioError, 500, "failed"),
)

_SCHEMA = {"$ref": f"#/components/schemas/{ErrorBody.__name__}"}

RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {"description": text, "content": {"application/json": {"schema": _SCHEMA}}}
    for status, text in (
        (404, "No such take, solve or job."),
        (409, "Not possible in the present state of the stage or the take."),
        (422, "A value that is not allowed; the message lists what is."),
        (501, "Not available in this version."),
    )
}
"""The documented failures of routes, by their schema: FastAPI would build a `model` again for each route."""


def error_response(status: int, code: str, message: str) -> JSONResponse:
    """Return an answer in the one error shape."""
    error: dict[str, Any] = {"code": code, "message": message}
    if said := codes_of([message]):
        error["said"] = said
    return JSONResponse({"error": error}, status)


async def studio_error(_: Request, error: Exception) -> JSONResponse:
    """Answer a request that failed with a `StudioError`."""
    assert isinstance(error, StudioError)
    status, code = next((s, c) for kind, s, c in KINDS if isinstance(error, kind))
    return error_response(status, code, error.sentence)


async def _invalid(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    parts = [f"{'.'.join(str(place) for place in item['loc'])}: {item['msg']}" for item in error.errors()]
    return error_response(422, "invalid_request", "; ".join(parts))


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    codes = {404: "not_found", 405: "method_not_allowed", 413: "too_large"}
    message = {404: f"there is nothing at {request.url.path}"}.get(error.status_code, error.detail)
    return error_response(error.status_code, codes.get(error.status_code, "http"), message)


async def _internal(request: Request, error: Exception) -> JSONResponse:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return error_response(
        500,
        "internal",
        say("server.failed", "the server failed: {error!r}; the server's log has the details", error=error),
    )


def add_error_handlers(app: FastAPI) -> None:
    """Make the app answer every failure in the one shape."""
    app.add_exception_handler(StudioError, studio_error)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _internal)
