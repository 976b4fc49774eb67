"""Proof to a waiting client that a studio's operator knows the client's code; the code itself is never sent.

Both sides are on one TCP connection and send lines of JSON. The client begins: `{"nonce"}`. The studio answers
`{"nonce", "server", "proof"}`, the client `{"proof"}` or `{"refused"}`. scrypt makes the key from the code and both
nonces, HMAC the proofs. Both sides make the client's token for the studio's link from the same key: no secret is
sent.
"""

import hashlib
import hmac
import json
import secrets
from dataclasses import dataclass
from typing import Any

from studio.engine.base.errors import FormatError

SERVICE = "_capture-camera._tcp.local."
"""DNS-SD service type of the announcement."""

MAX_LINE = 2000
TALK_S = 20.0
"""Timeout of one connection [s]."""

_SIGNS = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"
"""Characters of codes, without those that look like others."""
_LENGTH, _GROUP = 12, 4
_NONCE_BYTES = 16


def new_code() -> str:
    """Return a code to be shown and typed: 12 characters (59 bits) in groups of four."""
    signs = "".join(secrets.choice(_SIGNS) for _ in range(_LENGTH))
    return "-".join(signs[k : k + _GROUP] for k in range(0, _LENGTH, _GROUP))


def new_nonce() -> str:
    """Return a number that is used once, in hexadecimal."""
    return secrets.token_hex(_NONCE_BYTES)


@dataclass(frozen=True)
class Pairing:
    """One try to connect: the key of the code and both nonces.

    Attributes:
        key: 32 bytes.
        server: the studio's address, as the studio said it.
    """

    key: bytes
    server: str

    @classmethod
    def of(cls, code: str, client_nonce: str, studio_nonce: str, server: str) -> "Pairing":
        """Return the pairing of a code as it was typed; capitals and hyphens do not matter. Takes a twentieth of a
        second by design."""
        plain = "".join(sign for sign in code.upper() if sign.isalnum())
        salt = f"{client_nonce} {studio_nonce}".encode()
        return cls(hashlib.scrypt(plain.encode(), salt=salt, n=1 << 14, r=8, p=1, dklen=32), server)

    def proof(self, side: str) -> str:
        """Return the proof that a side (`studio` or `client`) knows the code and means this server."""
        return self._made(f"{side} {self.server}")

    def proves(self, side: str, proof: object) -> bool:
        """Whether a proof is the right one for a side."""
        return isinstance(proof, str) and hmac.compare_digest(proof.encode(), self.proof(side).encode())

    @property
    def token(self) -> str:
        """The client's token for the studio's link."""
        return self._made("token")

    def _made(self, text: str) -> str:
        return hmac.new(self.key, text.encode(), hashlib.sha256).hexdigest()


def line_of(**values: str) -> bytes:
    """Return one message."""
    return json.dumps(values).encode() + b"\n"


def read_line(line: bytes) -> dict[str, Any]:
    """Return one message's values.

    Raises:
        FormatError: it is incomplete, too long, or not a JSON object.
    """
    try:
        value = json.loads(line) if line.endswith(b"\n") and len(line) <= MAX_LINE else None
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise FormatError("waiting.no_message", "no message of a waiting camera client")
    return value


def text_in(value: dict[str, Any], name: str, longest: int = 300) -> str:
    """Return a text of a message.

    Raises:
        FormatError: it has no such text.
    """
    text = value.get(name)
    if not isinstance(text, str) or not 0 < len(text) <= longest:
        raise FormatError("waiting.no_text", "no {name} in a message of a waiting camera client", name=name)
    return text
