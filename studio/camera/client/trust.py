"""Trust in one studio's own certificate, such as one that it signed itself."""

import ssl
from pathlib import Path

from studio.engine.base.errors import SettingsError

_END = "-----END CERTIFICATE-----"


def trusting(certificate: Path) -> ssl.SSLContext:
    """Return TLS settings that trust a server with exactly this certificate, whatever its address.

    Args:
        certificate: PEM file; of several certificates, the first one counts: the server's own.

    Raises:
        SettingsError: the file cannot be read, or has no certificate.
    """
    try:
        first, end, _ = certificate.read_text(encoding="ascii").partition(_END)
        context = ssl.create_default_context(cadata=first + end)
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise SettingsError(
            "camera.certificate",
            "{path} has no certificate ({error}); give the studio's as a PEM file",
            path=certificate,
            error=error,
        ) from error
    context.check_hostname = False  # the certificate itself is known
    context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    context.verify_flags &= ~ssl.VERIFY_X509_STRICT
    return context
