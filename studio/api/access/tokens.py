"""Tokens of operators, viewers and cameras, and signed-in browsers.

Only hashes are stored, in `access.json` in the folder of sessions, readable by its owner only. A token is shown
once, when it is made. Every start of the server makes a new operator's token; a viewer's is made on
request; a camera's is valid until it is revoked.
"""

import hmac
import json
import secrets
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from studio.api.access.invitations import Invitations, hash_of, new_token
from studio.api.errors import NotFoundError
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import write_atomically
from studio.engine.base.versions import ACCESS
from studio.take.folder.take import utc_now

FILE_NAME = "access.json"
MAX_FAILURES, FAILURES_OVER_S = 10, 60.0
"""Maximum number of wrong tokens from an address within this time [s]; after more, the address must wait."""

Role = Literal["operator", "viewer"]
"""Operators may do everything, viewers may only read."""

_MAX_SIGNED_IN = 100


@dataclass
class CameraToken:
    """A token for camera clients: its label, its time of creation, and its hash."""

    id: str
    label: str
    created: str
    hash: str


class Access:
    """The tokens of one server. All methods may be called from any thread.

    Attributes:
        required: whether tokens are required; False on a loopback address.
        operator_token: signs operators in.
        viewer_token: signs viewers in; empty before `renew_viewer`.
        own_camera_token: for the cameras that the server starts itself; never stored.
        phone_invitations: each lets a phone make a camera's token for itself.
    """

    def __init__(
        self,
        sessions: Path,
        *,
        required: bool,
        now_s: Callable[[], float],
        operator_token: str = "",
        camera_token: str = "",
    ) -> None:
        """Read the cameras' tokens, and make a new one for operators.

        Args:
            sessions: folder of the file.
            now_s: a monotonic clock [s].
            operator_token: the first operator's token; empty = a new one.
            camera_token: a further token for cameras, managed elsewhere.

        Raises:
            StudioError: the file cannot be read.
        """
        self.required = required
        self._file = sessions / FILE_NAME
        self._now_s = now_s
        self._lock = threading.Lock()
        self._signed_in: dict[str, Role] = {}
        self._failures: dict[str, list[float]] = {}
        self._invitations = Invitations(now_s)
        self.phone_invitations = Invitations(now_s)
        self._let_go: set[str] = set()
        self._cameras = _read(self._file)
        self.own_camera_token = new_token()
        self.operator_token = self.viewer_token = ""
        self.renew_operator()
        self.operator_token = operator_token or self.operator_token
        self._camera_token = camera_token

    def renew_operator(self) -> str:
        """Return a new operator's token; everybody is signed out, viewers too."""
        with self._lock:
            self.operator_token, self.viewer_token = new_token(), ""
            self._signed_in.clear()
            self._invitations.clear()
            self.phone_invitations.clear()
            return self.operator_token

    def renew_viewer(self) -> str:
        """Return a new viewer's token; the old one becomes invalid and its viewers are signed out."""
        with self._lock:
            self.viewer_token = new_token()
            self._signed_in = {key: role for key, role in self._signed_in.items() if role != "viewer"}
            return self.viewer_token

    def invite(self) -> str:
        """Return a token that signs in one operator's browser, once, within `INVITATION_S`."""
        return self._invitations.make()

    def may_try(self, address: str) -> bool:
        """Whether an address may try a token; not after too many wrong ones."""
        with self._lock:
            return len(self._recent(address)) < MAX_FAILURES

    def check_token(self, token: str, address: str) -> Role | None:
        """Return the role of a token; None for a wrong one, which counts against the address."""
        role = self.role_of_token(token)
        if role is None:
            self.count_failure(address)
        return role

    def count_failure(self, address: str) -> None:
        """Count a wrong token against an address."""
        with self._lock:
            self._failures[address] = [*self._recent(address), self._now_s()]

    def role_of_token(self, token: str) -> Role | None:
        """Return the role of a token, None for a wrong one."""
        with self._lock:
            if _same(token, self.operator_token):
                return "operator"
            return "viewer" if self.viewer_token and _same(token, self.viewer_token) else None

    def sign_in(self, token: str, address: str) -> str | None:
        """Return the key of a signed-in browser, or None if the token is wrong."""
        role: Role | None = "operator" if self._invitations.use(token) else self.check_token(token, address)
        if role is None:
            return None
        with self._lock:
            key = new_token()
            self._signed_in[key] = role
            while len(self._signed_in) > _MAX_SIGNED_IN:
                del self._signed_in[next(iter(self._signed_in))]
            return key

    def sign_out(self, key: str) -> None:
        """Sign one browser out."""
        with self._lock:
            self._signed_in.pop(key, None)

    def role_of_key(self, key: str) -> Role | None:
        """Return the role of a browser's key, None for a wrong one."""
        with self._lock:
            return self._signed_in.get(key)

    def _recent(self, address: str) -> list[float]:
        since = self._now_s() - FAILURES_OVER_S
        self._failures = {
            name: kept for name, times in self._failures.items() if (kept := [t for t in times if t > since])
        }
        return self._failures.get(address, [])

    def add_camera(self, label: str, token: str = "") -> tuple[str, str]:
        """Make a token for cameras, or register the given one; return its id and the token, which is not stored.

        Raises:
            StudioError: the file cannot be written.
        """
        token = token or new_token()
        with self._lock:
            made = CameraToken(secrets.token_hex(4), label, utc_now(), hash_of(token))
            self._write([*self._cameras, made])
        return made.id, token

    def remove_camera(self, token_id: str) -> None:
        """Revoke a camera's token.

        Raises:
            NotFoundError: no such token.
        """
        with self._lock:
            kept = [camera for camera in self._cameras if camera.id != token_id]
            if len(kept) == len(self._cameras):
                raise NotFoundError(
                    "access.no_token",
                    "there is no camera token {id!r}; GET /api/v1/access lists them",
                    id=token_id,
                )
            self._write(kept)

    def let_go(self, token: str) -> None:
        """Refuse a camera's token from now on, even if no token is required."""
        with self._lock:
            self._let_go.add(hash_of(token))

    def is_let_go(self, token: str) -> bool:
        """Whether a camera's token is refused."""
        with self._lock:
            return bool(self._let_go) and hash_of(token) in self._let_go

    def camera_tokens(self) -> list[dict[str, str]]:
        """Return the cameras' tokens without their hashes: `id`, `label`, `created`."""
        with self._lock:
            return [{"id": c.id, "label": c.label, "created": c.created} for c in self._cameras]

    def camera_token_id(self, token: str) -> str | None:
        """Return the id of a camera's token, or None if it is wrong or revoked."""
        if _same(token, self.own_camera_token):
            return "own"
        if _same(token, self._camera_token):
            return "given"
        given = hash_of(token)
        with self._lock:
            return next((c.id for c in self._cameras if hmac.compare_digest(c.hash, given)), None)

    def _write(self, cameras: list[CameraToken]) -> None:
        value = ACCESS.stamped({"cameras": [asdict(camera) for camera in cameras]})
        with write_atomically(self._file) as file:
            file.write(json.dumps(value, indent=2).encode())
        self._file.chmod(0o600)
        self._cameras = cameras


def _read(file: Path) -> list[CameraToken]:
    if not file.exists():
        return []
    try:
        value: dict[str, Any] = ACCESS.current(json.loads(file.read_text(encoding="utf-8")), file.name)
        return [
            CameraToken(**{key: str(camera[key]) for key in CameraToken.__annotations__})
            for camera in value["cameras"]
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, FormatError) as error:
        raise StudioError(
            "access.tokens_unreadable",
            "{path} cannot be read ({error!r}); mend it, or delete it and pair the cameras again",
            path=file,
            error=error,
        ) from error


def _same(given: str, right: str) -> bool:
    return bool(given) and hmac.compare_digest(given.encode(), right.encode())
