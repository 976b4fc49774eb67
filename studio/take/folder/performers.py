"""An operator's entries on a take's performers in `take.json`: their names, and where two were exchanged."""

import math
import re
from collections.abc import Mapping, Sequence

from studio.engine.base.errors import TakeError
from studio.engine.model.performers.exchange import Exchange
from studio.engine.model.solve_metrics import ExchangeJson
from studio.take.folder.meta import TakeMeta
from studio.take.folder.names import check_name

_PERFORMER = re.compile(r"performer_[1-9][0-9]{0,2}")
MAX_EXCHANGES = 200


def exchanges_of(meta: TakeMeta) -> tuple[Exchange, ...]:
    """Return the exchanges of a take, in the order in which they were made."""
    found = meta.get("exchanges", [])
    return tuple(Exchange(one["time_s"], (one["performers"][0], one["performers"][1])) for one in found)


def exchange_json(exchange: Exchange) -> ExchangeJson:
    """Return an exchange as `take.json` and `metrics.json` hold it."""
    return {"time_s": exchange.time_s, "performers": list(exchange.performers)}


def shown_name(meta: TakeMeta, performer: str) -> str:
    """Return the name that the operator gave to a performer, else the performer's own, `performer_1`, ..."""
    return meta.get("performer_names", {}).get(performer, performer)


def performer_by_name(meta: TakeMeta, name: str) -> str:
    """Return the performer, `performer_1`, ..., with a name; the name itself if nobody has it."""
    named = meta.get("performer_names", {})
    return next((performer for performer, own in named.items() if own == name), name)


def performer_number(performer: str) -> int:
    """Return the number of `performer_1`, ..., from 1."""
    return int(performer.rpartition("_")[2])


def checked_names(names: Mapping[str, str]) -> dict[str, str]:
    """Return names by performer without blanks around them; an empty one is left out.

    Raises:
        TakeError: no performer's key, a name that is not allowed, or two performers with one name.
    """
    kept: dict[str, str] = {}
    for performer, given in names.items():
        _check_performer(performer)
        name = given.strip()
        if name and name != performer:
            kept[performer] = check_name("performer", name)
    folded = [name.casefold() for name in kept.values()]
    for name in kept.values():
        if folded.count(name.casefold()) > 1 or _PERFORMER.fullmatch(name.casefold()):
            raise TakeError(
                "performers.same_name",
                "{name!r} would be the name of two performers; choose another",
                name=name,
            )
    return kept


def checked_exchanges(exchanges: Sequence[Exchange]) -> list[ExchangeJson]:
    """Return exchanges as `take.json` holds them.

    Raises:
        TakeError: not two performers, not a time, or too many.
    """
    for one in exchanges:
        for performer in one.performers:
            _check_performer(performer)
        if one.performers[0] == one.performers[1] or not math.isfinite(one.time_s):
            raise TakeError(
                "performers.exchange",
                "{first} and {second} at {time_s} s cannot be exchanged; allowed: two performers, at a time",
                first=one.performers[0],
                second=one.performers[1],
                time_s=one.time_s,
            )
    if len(exchanges) > MAX_EXCHANGES:
        raise TakeError(
            "performers.exchanges",
            "a take with {n} exchanges; at most {most} are allowed",
            n=len(exchanges),
            most=MAX_EXCHANGES,
        )
    return [exchange_json(one) for one in exchanges]


def _check_performer(performer: str) -> None:
    if not _PERFORMER.fullmatch(performer):
        raise TakeError(
            "performers.unknown",
            "{performer!r} is no performer; allowed: performer_1, performer_2, ...",
            performer=performer[:80],
        )
