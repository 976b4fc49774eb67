"""How a test expects an error: by its class, its code, and those of its values that matter; not by its wording."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import Said


@contextmanager
def refused(
    error: type[StudioError], /, *codes: str, **values: object
) -> Iterator[pytest.ExceptionInfo[StudioError]]:
    """Expect an error with one of these codes, its own or that of a sentence in it, and these among its values.

    A sentence among the values stands as its code.
    """
    with pytest.raises(error) as caught:
        yield caught
    told = caught.value
    found = {name: value.code if isinstance(value, Said) else value for name, value in told.values.items()}
    inner = [value.code for value in told.values.values() if isinstance(value, Said)]
    assert {told.code, *inner} & {*codes} and found | values == found, told.sentence
