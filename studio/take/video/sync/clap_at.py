"""The time of a clap, as people type it."""

import math
from collections.abc import Iterable

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value


def read_clap_at(texts: Iterable[str]) -> dict[str, float]:
    """Return seconds by camera, "" for all others, of texts such as `3.5` and `left=3.5`.

    Raises:
        SettingsError: a text without a time.
    """
    found: dict[str, float] = {}
    for text in texts:
        camera, _, second = text.strip().rpartition("=")
        try:
            found[camera] = float(second)
        except ValueError:
            found[camera] = math.nan
        if not 0.0 <= found[camera] < math.inf:
            raise SettingsError(
                bad_value("--clap-at", text, "SECOND or CAMERA=SECOND, such as 3.5 or left=3.5")
            )
    return found
