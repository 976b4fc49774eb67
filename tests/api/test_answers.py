"""Answers are as the API's description says."""

import re
from collections.abc import Iterator

import pytest
from jsonschema_rs import Draft202012Validator

from studio.api.app import create_app
from studio.live import LiveStage
from tests.api.test_measure import reference_of

TAKE = "/takes/{session}/{take}"
REFERENCE = TAKE + "/references/{name}"
ASKED = [
    ("get", "/takes", {}),
    ("get", TAKE, {}),
    ("get", TAKE + "/calibrations", {}),
    ("patch", TAKE, {"json": {"tags": ["best"], "markers": [{"time_s": 1.0, "name": "kick"}]}}),
    ("get", TAKE, {}),
    ("get", REFERENCE, {}),
    ("post", REFERENCE + "/align", {"json": {"solve": "live", "align_time": False}}),
    ("get", REFERENCE, {}),
    ("post", TAKE + "/evaluate", {"json": {"reference": "truth.csv"}}),
    ("get", TAKE + "/solves/{solve}/figures", {"params": {"reference": "truth.csv"}}),
    ("get", TAKE + "/solves/{solve}/cleanup", {}),
    ("get", TAKE + "/compare", {"params": {"a": "live", "b": "live"}}),
    ("post", "/compare", {"json": {"a": {"take": "tests/one", "solve": "live"}, "b": {"reference": "truth.csv"}}}),
    ("post", TAKE + "/calibrations", {"json": {"borrow": "tests/one"}}),
    ("post", TAKE + "/calibrations", {}),
    ("get", "/calibration", {}),
    ("get", "/switches", {}),
    ("get", "/settings", {}),
    ("put", "/presets/{preset}", {"json": {"set": {"smoothing": "none"}}}),
    ("get", "/presets", {}),
    ("post", "/outputs", {"json": {"kind": "vmc", "enabled": False}}),
    ("get", "/outputs", {}),
    ("post", TAKE + "/solves/{solve}/share", {}),
    ("get", "/shares", {}),
    ("get", "/blind", {}),
]  # fmt: skip
NAMES = {"session": "tests", "take": "one", "name": "truth.csv", "solve": "live", "preset": "mine"}


@pytest.fixture
def described(tmp_path) -> dict:
    return create_app(LiveStage(tmp_path / "none"), tmp_path / "none").openapi()


def answers(described: dict) -> Iterator[tuple[str, dict]]:
    """The schema of each JSON answer of a route, by method and path."""
    for path, methods in described["paths"].items():
        for method, operation in methods.items():
            for status, answer in operation["responses"].items():
                if status.startswith("2") and "application/json" in answer.get("content", {}):
                    yield f"{method} {path}", answer["content"]["application/json"]["schema"]


def _open(path: str) -> str:
    """A path without the names of its parameters."""
    return re.sub(r"\{[^}]*\}", "{}", path)


def test_no_answer_is_a_bare_object(described):
    bare = [
        where
        for where, schema in answers(described)
        if schema == {} or schema.get("additionalProperties") is True
    ]
    assert bare == []
    assert [
        name for name, one in described["components"]["schemas"].items() if one.get("description") == ""
    ] == []


def test_answers_are_as_described(recorded, described):
    put = recorded.http.put("/takes/tests/one/references/truth.csv", content=reference_of(recorded))
    put.raise_for_status()
    schemas = {_open(where): one for where, one in answers(described)}
    for method, path, options in ASKED:
        answer = recorded.http.request(method, path.format(**NAMES), **options)
        assert answer.is_success, answer.text
        schema = {**schemas[_open(f"{method} /api/v1{path}")], "components": described["components"]}
        Draft202012Validator(schema).validate(answer.json())
