"""Sentences with codes: their English, their values, and the ways in which they are passed on."""

import copy
import errno
import json
import os
import pickle

import msgspec
import numpy as np
import pytest

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import Said, codes_of, say, system_says, with_codes


def test_the_text_is_that_of_the_format() -> None:
    said = say("a.b", "{take!r} is {m:.2f} m {{tall}}, {off:+.1f} off", take="it's", m=1.8, off=2)
    assert said == '"it\'s" is 1.80 m {tall}, +2.0 off'
    assert said.code == "a.b"
    assert said.values == {"take": "it's", "m": 1.8, "off": 2.0}


@pytest.mark.parametrize(
    ("spec", "value", "kept"),
    [
        ("", 3, 3),
        ("", 0.1 + 0.2, 0.1 + 0.2),
        (":.0f", np.float64(12.345), 12),
        (":.1f", 12.345, 12.3),
        (":g", 5.0, 5),
        ("", np.int64(7), 7),
        ("", float("inf"), "inf"),
        ("", True, "True"),
        ("", (2, 3), "(2, 3)"),
        ("!r", KeyError("x"), "KeyError('x')"),
    ],
)
def test_values_are_kept_as_they_stand_in_the_text(spec: str, value: object, kept: object) -> None:
    said = say("a.b", f"{{value{spec}}}", value=value)
    assert said == f"{{value{spec}}}".format(value=value)
    assert said.values["value"] == kept and type(said.values["value"]) is type(kept)
    json.dumps(said.to_json(), allow_nan=False)


def test_lists_are_joined_by_what_is_in_them() -> None:
    assert say("a.b", "{names}", names=["left", "right"]) == "left, right"
    reasons = [say("a.c", "it moved"), say("a.d", "it is dark")]
    said = say("a.b", "refused: {reasons}", reasons=reasons)
    assert said == "refused: it moved; it is dark"
    assert [one["code"] for one in said.to_json()["values"]["reasons"]] == ["a.c", "a.d"]


def test_an_error_in_a_sentence_is_what_it_says() -> None:
    cause = TakeError(say("take.gone", "take {take} is gone", take="one"))
    said = say("a.b", "cannot do it: {error}", error=cause)
    assert said == "cannot do it: take one is gone"
    assert said.to_json()["values"]["error"]["code"] == "take.gone"
    assert say("a.b", "{error}", error=ValueError("bad")).values == {"error": "bad"}


def test_the_systems_words_have_the_code_of_its_error() -> None:
    error = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert system_says(error) == os.strerror(errno.ENOSPC)
    assert system_says(error).code == "os.enospc"
    assert system_says(OSError()).code == "os.unknown"


def test_sentences_and_errors_go_to_other_processes() -> None:
    said = say("a.b", "of {inner}", inner=say("a.c", "{n} takes", n=2))
    for other in (pickle.loads(pickle.dumps(said)), copy.deepcopy(said)):
        assert other == said and isinstance(other, Said)
        assert other.to_json() == said.to_json()
    error = pickle.loads(pickle.dumps(TakeError(said)))
    assert (str(error), error.code, error.values) == (str(said), "a.b", said.values)


def test_an_error_with_a_bare_text_has_the_name_of_its_class() -> None:
    error = TakeError("something else")
    assert (error.code, error.values, error.sentence) == ("TakeError", {}, "something else")
    assert StudioError().code == "StudioError"


def test_codes_lie_beside_texts_on_disk() -> None:
    texts = ["plain", say("a.b", "of {inner}", inner=[say("a.c", "{n} takes", n=2), "x"])]
    kept = json.loads(json.dumps({"texts": texts, "said": codes_of(texts)}))
    back = with_codes(kept["texts"], kept["said"])
    assert back == texts
    assert isinstance(back[1], Said) and back[1].to_json() == texts[1].to_json()
    assert codes_of(["plain"]) == []
    assert with_codes(["plain"], [{"text": "plain"}, {"text": "plain", "code": "a", "values": 3}]) == [
        "plain"
    ]


def test_a_sentence_is_a_text_for_msgspec_only_with_a_hook() -> None:
    with pytest.raises(TypeError):
        msgspec.json.encode(say("a.b", "text"))
    assert json.dumps(say("a.b", "text")) == '"text"'
