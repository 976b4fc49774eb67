"""docs/api.md names every route that the server has."""

import json
import re
from pathlib import Path

from jsonschema_rs import Draft202012Validator

from studio.api.app import create_app
from studio.api.structs import encode
from studio.live import LiveStage
from studio.live.states import StageStatus

DOCUMENT = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")


def plain(path: str) -> str:
    """A path without the names of its parameters."""
    return re.sub(r"\{[^}]*\}", "{}", path.removeprefix("/api/v1"))


def documented() -> set[tuple[str, str]]:
    """Method and path of all that the document names; `...` stands for the path before it in the same row."""
    found = set()
    for row in DOCUMENT.splitlines():
        last = ""
        for method, path in re.findall(r"`(GET|POST|PUT|PATCH|DELETE) ([^`\s?]+)", row):
            whole = last.rsplit("/", 1)[0] + path.removeprefix("...") if path.startswith("...") else path
            last = last or whole
            found.add((method, plain(whole)))
    return found


def test_every_route_is_documented(tmp_path: Path) -> None:
    app = create_app(LiveStage(tmp_path), tmp_path)
    routes = {
        (method.upper(), plain(path))
        for path, methods in app.openapi()["paths"].items()
        for method in methods
    }
    assert sorted(routes - documented()) == []


def test_structs_are_described(tmp_path: Path) -> None:
    stage = LiveStage(tmp_path)
    described = create_app(stage, tmp_path).openapi()
    schemas = described["components"]["schemas"]
    answer = described["paths"]["/api/v1/status"]["get"]["responses"]["200"]
    assert answer["content"]["application/json"]["schema"] == {"$ref": "#/components/schemas/StageStatus"}
    assert schemas["CameraStatus"]["properties"]["clock"] == {"$ref": "#/components/schemas/ClockStatus"}
    assert schemas["StageStatus"]["description"] == (StageStatus.__doc__ or "").strip()
    assert schemas["StatusEvent"]["properties"]["type"] == {"enum": ["status"]}
    check = Draft202012Validator(
        {"$ref": "#/components/schemas/StageStatus", "components": described["components"]}
    )
    told = json.loads(encode(stage.status()))
    check.validate(told)
    assert not check.is_valid({**told, "recording": {**told["recording"], "seconds": "none"}})
    found = re.findall(r'"#/components/schemas/(\w+)"', json.dumps(described))
    assert set(found) <= set(schemas)
