"""Shared by the device modules: import of an SDK, numbers in arguments, and reading of a blocking device."""

import asyncio
from collections.abc import AsyncIterator, Callable
from importlib import import_module
from types import ModuleType
from typing import TypeVar

from studio.camera.sources.depth_source import DeviceLostError
from studio.engine.base.errors import NotAvailableError, SettingsError

_Item = TypeVar("_Item")


def library(module: str, *, kind: str, install: str) -> ModuleType:
    """Return an SDK's module.

    Args:
        module: its name.
        kind: the kind of source that needs it.
        install: how to install it, for the error.

    Raises:
        NotAvailableError: it is not installed, or its own libraries are not.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise NotAvailableError(
            "source.needs_module",
            "source {kind} needs {module} ({error}); {install}",
            kind=kind,
            module=module,
            error=error,
            install=install,
        ) from error
    except (ImportError, OSError) as error:
        raise NotAvailableError(
            "source.module_broken",
            "source {kind} needs {module}, which is here but does not load ({error}); install "
            "the system's library that is named",
            kind=kind,
            module=module,
            error=error,
        ) from error


def split_argument(argument: str, kind: str, flags: tuple[str, ...] = ()) -> tuple[str, set[str]]:
    """Return the text before `?` and the flags after it.

    Raises:
        SettingsError: an unknown flag.
    """
    text, _, rest = argument.partition("?")
    found = set(filter(None, rest.split("&")))
    unknown = sorted(found - set(flags))
    if unknown:
        raise SettingsError(
            "source.flag",
            "source {kind}: {flag!r} is not allowed; allowed: {allowed}",
            kind=kind,
            flag=unknown[0],
            allowed=", ".join(flags) or "nothing",
        )
    return text, found


def device_number(text: str, kind: str) -> int:
    """Return the number of a device, 0 for an empty text.

    Raises:
        SettingsError: not a number.
    """
    if text and not (text.isascii() and text.isdigit() and len(text) < 3):
        raise _not_a_number(text, kind)
    return checked_number(int(text or 0), kind)


def checked_number(number: int, kind: str) -> int:
    """Return the number of a device.

    Raises:
        SettingsError: it is not from 0 to 99.
    """
    if not 0 <= number < 100:
        raise _not_a_number(str(number), kind)
    return number


def _not_a_number(text: str, kind: str) -> SettingsError:
    return SettingsError(
        "source.number",
        "source {kind}:{text} is not allowed; give the device's number, such as {kind}:0",
        kind=kind,
        text=text,
    )


def device_failed(error: Exception) -> DeviceLostError:
    """Return the error for a failure of a device's library."""
    return DeviceLostError("device.failed", "{error}", error=str(error) or type(error).__name__)


async def polled(
    wait: Callable[[], _Item | None],
    close: Callable[[], None],
    errors: tuple[type[Exception], ...] = (RuntimeError, OSError),
) -> AsyncIterator[_Item]:
    """Yield the results of a blocking function, called on a thread; None = no result in time.

    Args:
        wait: waits for about a second at most.
        close: called at the end.
        errors: the errors of the device's library.

    Raises:
        DeviceLostError: the function fails.
    """
    try:
        while True:
            try:
                item = await asyncio.to_thread(wait)
            except errors as error:
                raise device_failed(error) from error
            if item is not None:
                yield item
    finally:
        await asyncio.to_thread(close)
