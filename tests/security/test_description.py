"""Requests made up from the server's own OpenAPI description: whatever is sent, no answer is a server's failure."""

from collections.abc import Callable
from contextlib import suppress

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import Case, GenerationMode

REAL = {"session": "tests", "take": "one", "solve": "live"}
NOT_THERE_YET = 501


MODES = (GenerationMode.POSITIVE, GenerationMode.NEGATIVE)


def modes_of(operation) -> tuple[GenerationMode, ...]:
    """The kinds of requests that there are: nothing can be wrong about one that has only texts in its path."""
    texts = all(one.definition["schema"]["type"] == "string" for one in operation.path_parameters)
    more = any((operation.query, operation.headers, operation.cookies, operation.body))
    return MODES if more or not texts else MODES[:1]


def no_failure_among(operation, modes, examples: int, change: Callable[[Case], None]) -> int:
    """Call an operation with made-up requests of these kinds; return how many were sent."""
    sent = 0

    def call(case: Case) -> None:
        nonlocal sent
        change(case)
        answer = case.call(timeout=120)
        sent += 1
        failed = answer.status_code >= 500 and answer.status_code != NOT_THERE_YET
        assert not failed, f"{case.as_curl_command()} -> {answer.status_code} {answer.text[:500]}"

    for mode in modes:
        made_up = given(operation.as_strategy(generation_mode=mode))(call)
        limited = settings(
            max_examples=examples,
            deadline=None,
            database=None,
            derandomize=True,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        with suppress(Unsatisfiable):  # what is sent beside the path may be anything as well
            limited(made_up)()
    return sent


def try_all(studio, examples: int, change: Callable[[Case], None], *, in_turn: bool = False) -> int:
    """Try every operation that the description has; return how many requests were sent.

    `in_turn`: one operation with requests that are allowed, the next one with others if there are any; else each
    with both.
    """
    schema = schemathesis.openapi.from_url(f"{studio.http.base_url}openapi.json")
    sent = 0
    for index, found in enumerate(schema.get_all_operations()):
        operation = found.ok()
        modes = modes_of(operation)
        if in_turn:
            modes = (modes[index % len(modes)],)
        sent += no_failure_among(operation, modes, examples, change)
    assert studio.http.get("/status").status_code == 200
    return sent


def test_no_request_makes_the_server_fail(recorded):
    assert try_all(recorded, 2, lambda case: None, in_turn=True) > 60


def of_a_real_take(case: Case) -> None:
    """Name a take and a solve that are there, so that the work is done."""
    if case.path_parameters:
        case.path_parameters.update({k: v for k, v in REAL.items() if k in case.path_parameters})


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("change", [lambda case: None, of_a_real_take], ids=["any", "a real take"])
def test_no_request_makes_the_server_fail_long(recorded, change):
    assert try_all(recorded, 12, change) > 1000
