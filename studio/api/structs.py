"""Structs as answers: routes return them, msgspec encodes them, and the API's description has their schemas."""

import inspect
import threading
from collections.abc import Callable, Iterator
from functools import cache, wraps
from types import UnionType
from typing import Any, get_args, is_typeddict

import msgspec
from fastapi import FastAPI
from fastapi.responses import Response
from fastapi.routing import APIRoute
from pydantic import BaseModel

from studio.engine.base.sentences import Said

_REFERENCE = "#/components/schemas/{name}"


_told = threading.local()
"""`sentences`: those found by the present encoding on this thread, by text."""


def _plain(value: Any) -> Any:
    """Return a JSON value for a sentence or a NumPy number."""
    if isinstance(value, Said):
        _told.sentences[str(value)] = value
        return str(value)
    return str(value) if isinstance(value, str) else value.item()


_encoder = msgspec.json.Encoder(enc_hook=_plain)


def encode(value: Any) -> bytes:
    """Return structs, dicts and lists, also nested ones, as JSON in UTF-8.

    An object with sentences that have a code gets one more field, `said`: these sentences, each with its `text`,
    `code` and `values`. In a list, each object with such sentences gets it.
    """
    _told.sentences = sentences = {}
    data = _encoder.encode(value)
    if not sentences:
        return data
    if isinstance(value, list | tuple):
        return b"[" + b",".join(encode(one) for one in value) + b"]"
    said = _encoder.encode([one.to_json() for one in sentences.values()])
    return data[:-1] + b',"said":' + said + b"}" if data.endswith(b"}") else data


class StructRoute(APIRoute):
    """A route whose function may return structs, also as a union, or in a list or object. A `TypedDict` counts as a
    struct.

    Attributes:
        answers: the types that it returns, if they are of structs; else none.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        returned = inspect.signature(endpoint).return_annotation
        self.answers: tuple[Any, ...] = ()
        if any(_structs(returned)):
            status = options.get("status_code") or 200
            self.answers = get_args(returned) if isinstance(returned, UnionType) else (returned,)
            body = {"content": {"application/json": {"schema": _schema(self.answers)}}}
            options["responses"] = {**(options.get("responses") or {}), status: body}
            options["response_model"] = None
            endpoint = _encoded(endpoint, status)
        super().__init__(path, endpoint, **options)


@cache
def _schema(answers: tuple[Any, ...]) -> dict[str, Any]:
    schemas, _ = msgspec.json.schema_components(answers, ref_template=_REFERENCE)
    return schemas[0] if len(schemas) == 1 else {"anyOf": list(schemas)}


def _structs(kind: Any) -> Iterator[type]:
    """Yield the structs in an annotation."""
    if is_typeddict(kind) or (isinstance(kind, type) and issubclass(kind, msgspec.Struct)):
        yield kind
    for part in get_args(kind):
        yield from _structs(part)


def _encoded(endpoint: Callable[..., Any], status: int) -> Callable[..., Any]:
    def answer(value: Any, given: dict[str, Any]) -> Response:
        made = Response(encode(value), status, media_type="application/json")
        for one in given.values():
            if isinstance(one, Response):  # on which the function has put headers
                made.headers.update(one.headers)
        return made

    if inspect.iscoroutinefunction(endpoint):

        @wraps(endpoint)
        async def waits(*args: Any, **kwargs: Any) -> Response:
            return answer(await endpoint(*args, **kwargs), kwargs)

        return waits

    @wraps(endpoint)
    def works(*args: Any, **kwargs: Any) -> Response:
        return answer(endpoint(*args, **kwargs), kwargs)

    return works


class StructApi(FastAPI):
    """An app whose description has the schemas of structs: those of `StructRoute`s, and further ones.

    Attributes:
        events: messages of its WebSockets, which have no other place in the description.
        failure: body of answers other than success.
    """

    events: tuple[type, ...] = ()
    failure: type[BaseModel] | None = None

    def openapi(self) -> dict[str, Any]:
        """Return the description."""
        if self.openapi_schema is None:
            told = [one for route in self.routes if isinstance(route, StructRoute) for one in route.answers]
            _, schemas = msgspec.json.schema_components((*told, *self.events), ref_template=_REFERENCE)
            if self.failure is not None:
                failure = self.failure.model_json_schema(ref_template=_REFERENCE.replace("name", "model"))
                schemas |= failure.pop("$defs", {}) | {self.failure.__name__: failure}
            super().openapi()["components"]["schemas"].update(schemas)
        return super().openapi()
