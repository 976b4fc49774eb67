"""The fingerprint of the studio's certificate, by which people recognise it."""

import hashlib
import ssl
from pathlib import Path

_END = "-----END CERTIFICATE-----"


def fingerprint(certificate: Path) -> str:
    """Return the SHA-256 of the first certificate of a PEM file as browsers show it: pairs of digits with colons."""
    first, end, _ = certificate.read_text(encoding="ascii").partition(_END)
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(first.strip() + end)).hexdigest().upper()
    return ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))
