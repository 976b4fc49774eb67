"""Sentences for people that programs can read too: English text, with a code and its values.

The English text is in the source, where it is used. Translations are elsewhere, by code: the page's French in
`studio/web/static/base/said/`. Processes, responses and files pass a sentence as its text, with its code next to it.
"""

import errno
import math
from collections.abc import Iterable, Mapping
from string import Formatter
from typing import Any, SupportsIndex, TypeAlias, TypedDict

Value: TypeAlias = "str | int | float | Said | list[Value]"
"""A value in a sentence; the items of a list are joined."""

_formatter = Formatter()


class Sentence(TypedDict):
    """A `Said` as JSON, in files and, as the list `said`, in responses.

    Attributes:
        text: the English text.
        code: identifies the sentence.
        values: its values: texts, numbers, sentences, or lists of these.
    """

    text: str
    code: str
    values: dict[str, Any]


class Said(str):
    """An English sentence with its code.

    Attributes:
        code: identifies the sentence, such as `take.in_use`.
        values: its values, by name. Numbers are rounded as in the text.
    """

    code: str
    values: dict[str, Value]

    def __new__(cls, text: str, code: str, values: Mapping[str, Value] | None = None) -> "Said":
        self = super().__new__(cls, text)
        self.code, self.values = code, dict(values or {})
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Said, (str(self), self.code, self.values)

    def __str__(self) -> str:
        """The bare text."""
        return str.__str__(self)

    def replace(self, old: str, new: str, /, count: SupportsIndex = -1) -> "Said":
        """Return the sentence with a part of its text and of its values replaced, such as a path by a name."""
        values = {name: _replaced(value, old, new, count) for name, value in self.values.items()}
        return Said(str.replace(self, old, new, count), self.code, values)

    def to_json(self) -> Sentence:
        """Return `text`, `code` and `values` as JSON; sentences among the values in the same form."""
        values = {name: _value_to_json(value) for name, value in self.values.items()}
        return {"text": str(self), "code": self.code, "values": values}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Said":
        """Return the sentence in JSON of `to_json`.

        Raises:
            KeyError, TypeError, AttributeError: it is not of that form.
        """
        values = {str(name): _value_from_json(one) for name, one in value["values"].items()}
        return cls(str(value["text"]), str(value["code"]), values)


def say(code: str, english: str, /, **values: object) -> Said:
    """Return a sentence.

    Args:
        code: identifies the sentence. A code stands for one English text.
        english: the text, with values as for `str.format`: `{take!r}`, `{error:.1f}`.
        values: the values in it. A sentence keeps its code, an error counts as its sentence, and the items of a list
            are joined: by "; " if there are sentences among them, else by ", ".
    """
    texts, kept = [], {}
    for text, name, spec, conversion in _formatter.parse(english):
        texts.append(text)
        if name is not None:
            shown, kept[name] = _told(values[name], conversion, spec or "")
            texts.append(shown)
    return Said("".join(texts), code, kept)


def about(name: str, text: str) -> Said:
    """Return a sentence about something: `name: text`."""
    return say("text.about", "{name}: {text}", name=name, text=text)


def system_says(error: OSError) -> Said:
    """Return the system's own reason for an error; the code is that of the error, such as `os.enospc`."""
    name = errno.errorcode.get(error.errno or 0, "unknown")
    return Said(error.strerror or str(error), f"os.{name.lower()}")


def codes_of(texts: Iterable[str]) -> list[Sentence]:
    """Return the JSON of those texts that have a code, to be kept with the texts."""
    return [text.to_json() for text in texts if isinstance(text, Said)]


def with_codes(texts: Iterable[str], codes: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return texts with the codes that `codes_of` gave; a text without a code stays as it is."""
    known = {}
    for one in codes:
        try:
            said = Said.from_json(one)
        except (KeyError, TypeError, AttributeError):
            continue  # from another program; the text itself is kept
        known[str(said)] = said
    return [known.get(text, text) for text in texts]


def _told(value: object, conversion: str | None, spec: str) -> tuple[str, Value]:
    """Return a value as written in the text, and as kept."""
    if isinstance(value, BaseException) and not conversion:
        value = getattr(value, "sentence", str(value))
    if isinstance(value, list):
        parts = [_told(part, conversion, spec) for part in value]
        between = "; " if any(isinstance(part, Said) for _, part in parts) else ", "
        return between.join(shown for shown, _ in parts), [part for _, part in parts]
    if conversion == "r":
        return repr(value), value if isinstance(value, str) else repr(value)
    shown = format(value, spec)
    if isinstance(value, str):
        return shown, value
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return shown, shown
    return shown, _number(value if not spec and isinstance(value, int) else shown)


def _number(value: int | str) -> Value:
    """Return a number for JSON; as text if JSON cannot represent it."""
    try:
        return int(value)
    except ValueError:
        number = float(value)
        return number if math.isfinite(number) else str(value)


def _replaced(value: Value, old: str, new: str, count: SupportsIndex) -> Value:
    if isinstance(value, list):
        return [_replaced(part, old, new, count) for part in value]
    return value.replace(old, new, count) if isinstance(value, str) else value


def _value_to_json(value: Value) -> Any:
    if isinstance(value, Said):
        return value.to_json()
    return [_value_to_json(part) for part in value] if isinstance(value, list) else value


def _value_from_json(value: Any) -> Value:
    if isinstance(value, Mapping):
        return Said.from_json(value)
    return [_value_from_json(part) for part in value] if isinstance(value, list) else value
