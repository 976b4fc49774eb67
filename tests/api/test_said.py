"""Answers, events and failures tell the codes of their sentences."""

import json

import msgspec

from studio.api.structs import encode
from studio.engine.base.sentences import say
from tests.api.conftest import Studio


class Part(msgspec.Struct):
    text: str
    more: list[str] = []


ONE, TWO = say("a.one", "one"), say("a.two", "two of {names}", names=["left", "right"])


def test_an_object_tells_its_sentences_once() -> None:
    answer = json.loads(encode({"part": Part(ONE, [TWO, ONE, "plain"])}))
    assert answer["part"] == {"text": "one", "more": ["two of left, right", "one", "plain"]}
    assert answer["said"] == [
        {"text": "one", "code": "a.one", "values": {}},
        {"text": "two of left, right", "code": "a.two", "values": {"names": ["left", "right"]}},
    ]


def test_objects_of_a_list_tell_their_own() -> None:
    first, second = json.loads(encode([Part(ONE), Part("plain")]))
    assert [one["code"] for one in first["said"]] == ["a.one"]
    assert second == {"text": "plain", "more": []}


def test_what_has_no_sentence_is_as_it_was() -> None:
    assert encode(Part("plain")) == msgspec.json.encode(Part("plain"))
    assert encode([]) == b"[]"


def test_a_failure_tells_its_sentence(studio: Studio) -> None:
    answer = studio.http.get("/takes/monday/.hidden")
    assert answer.status_code == 409
    error = answer.json()["error"]
    (said,) = error["said"]
    assert (error["code"], said["text"], said["code"]) == ("take", error["message"], "name.not_allowed")
    assert said["values"]["name"] == ".hidden"
    assert said["values"]["kind"] == {"text": "take", "code": "name.take", "values": {}}


def test_headers_stay_on_answers_with_sentences(studio: Studio) -> None:
    assert studio.http.get("/takes").headers["X-Total-Count"] == "0"
