"""Invitations: tokens for a QR code, each valid once and for a short time. Only hashes are kept, in memory."""

import hashlib
import secrets
import threading
from collections.abc import Callable

INVITATION_S = 600.0
"""Validity of an invitation."""

_TOKEN_BYTES = 24


class Invitations:
    """Invitations to one thing. All methods may be called from any thread.

    Args:
        now_s: a monotonic clock [s].
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._until: dict[str, float] = {}

    def make(self) -> str:
        """Return a token that is valid once within `INVITATION_S`."""
        token = new_token()
        with self._lock:
            now = self._now_s()
            self._until = {key: until for key, until in self._until.items() if until > now}
            self._until[hash_of(token)] = now + INVITATION_S
        return token

    def use(self, token: str) -> bool:
        """Whether a token is an unused invitation; it is used up by this call."""
        with self._lock:
            return self._until.pop(hash_of(token), 0.0) > self._now_s()

    def clear(self) -> None:
        """Revoke all invitations."""
        with self._lock:
            self._until.clear()


def new_token() -> str:
    """Return a token of letters, digits, `_` and `-`. It never begins with `-`, which marks an option."""
    while (token := secrets.token_urlsafe(_TOKEN_BYTES)).startswith("-"):
        pass
    return token


def hash_of(token: str) -> str:
    """Return the hash of a token, which is all that is kept of it."""
    return hashlib.sha256(token.encode()).hexdigest()
