"""The certificate that a server uses: a given one, or the studio's own where it is open to the network."""

import datetime
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.api.access.fingerprint import fingerprint
from studio.engine.base.errors import StudioError
from studio.server.config import Config

if TYPE_CHECKING:
    from studio.server.certificate import OwnCertificate


@dataclass(frozen=True)
class Tls:
    """Files of a certificate chain and its private key, PEM; `own`: the studio made them itself."""

    certificate: Path
    key: Path
    own: "OwnCertificate | None" = None

    def check(self) -> None:
        """Raise StudioError if the files cannot be used together."""
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key)
        except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
            raise StudioError(
                "server.certificate",
                "cannot use certificate {certificate} with key {key}: {error}; give the PEM files of "
                "a certificate and its own key, without a password",
                certificate=self.certificate,
                key=self.key,
                error=error,
            ) from error


def chosen_tls(config: Config, *, open_to_others: bool) -> Tls | None:
    """Return the certificate to use: the configuration's, or on the network the one of `studio certificate`.

    Raises:
        StudioError: it cannot be used.
    """
    if config.tls_cert is not None and config.tls_key is not None:
        tls = Tls(config.tls_cert, config.tls_key)
    elif open_to_others:
        from studio.server.certificate import own_certificate  # its cryptography is slow to load

        own = own_certificate(config.sessions)
        if own is None:
            return None
        tls = Tls(own.certificate, own.key, own)
    else:
        return None
    tls.check()
    return tls


def tls_lines(tls: Tls, address: str) -> list[str]:
    """Return the lines of a terminal about the studio's own certificate; none for a given one.

    Args:
        tls: the certificate in use.
        address: under which other machines reach the studio.
    """
    if tls.own is None:
        return []
    problem = tls.own.problem([address], datetime.datetime.now(datetime.UTC))
    lines = [
        "browsers do not know the studio's own certificate and warn once: compare its fingerprint, then go on",
        f"fingerprint (SHA-256): {fingerprint(tls.certificate)}",
        f"cameras of other machines need it as a file: --certificate {tls.certificate.name}",
    ]
    return [*lines, f"warning: {problem}"] if problem else lines
