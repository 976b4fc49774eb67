"""Network addresses: their form, and the error where one cannot be listened to."""

from studio.engine.base.sentences import Said, say, system_says

LONGEST_HOST = 253


def is_host(text: str) -> bool:
    """Whether a text may be a machine's name or IPv4 address, without a port."""
    return 1 <= len(text) <= LONGEST_HOST and not any(sign.isspace() or sign in "/?#@:" for sign in text)


def not_listening(address: str, error: Exception) -> Said:
    """Return the error for an address or a device that cannot be listened to, with the reason."""
    return say(
        "trigger.not_listening",
        "cannot listen on {address}: {error}",
        address=address,
        error=system_says(error) if isinstance(error, OSError) else error,
    )
