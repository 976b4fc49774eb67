"""The studio's own certificate: signed by itself, for the names and addresses of this machine.

It lies in the folder of the sessions. Browsers do not know it and say so once. It can sign nothing else, so
trusting it means trusting this studio alone.
"""

import datetime
import ipaddress
import os
import socket
from dataclasses import dataclass
from pathlib import Path

import ifaddr
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from studio.engine.base.errors import SettingsError, StudioError
from studio.engine.base.files import write_atomically
from studio.engine.base.sentences import say, system_says

CERTIFICATE, KEY = "certificate.pem", "certificate_key.pem"
DAYS = 397
"""Validity; several systems accept no more of a server's certificate."""
_ONE_HOUR = datetime.timedelta(hours=1)


@dataclass(frozen=True)
class OwnCertificate:
    """A certificate that the studio made.

    Attributes:
        certificate, key: PEM files.
        names: names and addresses that it is for, sorted.
        until: when it ends, in UTC.
    """

    certificate: Path
    key: Path
    names: tuple[str, ...]
    until: datetime.datetime

    def problem(self, addresses: list[str], now: datetime.datetime) -> str:
        """Return why other machines will not accept it now; empty if they will.

        Args:
            addresses: under which other machines reach the studio.
            now: the time, in UTC.
        """
        if now >= self.until:
            return say(
                "certificate.ended",
                "the certificate {path} ended on {day}; run `studio certificate` again",
                path=self.certificate,
                day=f"{self.until:%Y-%m-%d}",
            )
        missing = sorted(set(addresses) - set(self.names))
        if missing:
            return say(
                "certificate.other_address",
                "the certificate {path} is not for {address}, now this machine's; run `studio certificate` again",
                path=self.certificate,
                address=missing[0],
            )
        return ""


def own_names() -> list[str]:
    """Return the names and addresses of this machine under which others may reach it, and its loopback ones."""
    host = socket.gethostname()
    found = {"localhost", "127.0.0.1", "::1", host, f"{host.partition('.')[0]}.local"}
    for adapter in ifaddr.get_adapters():
        for one in adapter.ips:
            found.add(one.ip if isinstance(one.ip, str) else one.ip[0].partition("%")[0])
    return sorted(name for name in found if name)


def make_certificate(folder: Path, names: list[str], now: datetime.datetime) -> OwnCertificate:
    """Write a new key and a certificate for these names into a folder; the key is readable by its owner only.

    Args:
        folder: made if missing.
        names: host names and IP addresses.
        now: the time, in UTC, from which on it is valid for `DAYS`.

    Raises:
        SettingsError: a name that is no host name or address.
        StudioError: the files cannot be written.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Capture Studio")])
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _ONE_HOUR)
        .not_valid_after(now + datetime.timedelta(days=DAYS))
        .add_extension(x509.SubjectAlternativeName([_general_name(one) for one in names]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / KEY).unlink(missing_ok=True)
        with open(os.open(folder / KEY, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(private)
        with write_atomically(folder / CERTIFICATE) as file:
            file.write(made.public_bytes(serialization.Encoding.PEM))
    except OSError as error:
        raise StudioError(
            "certificate.not_written",
            "the certificate cannot be written to {folder}: {error}; choose another --sessions",
            folder=folder,
            error=system_says(error),
        ) from error
    found = own_certificate(folder)
    assert found is not None
    return found


def own_certificate(folder: Path) -> OwnCertificate | None:
    """Return the certificate that `make_certificate` wrote into a folder, or None.

    Raises:
        StudioError: the file is no certificate.
    """
    path = folder / CERTIFICATE
    if not (path.is_file() and (folder / KEY).is_file()):
        return None
    try:
        read = x509.load_pem_x509_certificate(path.read_bytes())
        names = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, x509.ExtensionNotFound) as error:
        raise StudioError(
            "certificate.unreadable",
            "{path} is no certificate of this studio ({error}); run `studio certificate` again",
            path=path,
            error=error,
        ) from error
    return OwnCertificate(
        path, folder / KEY, tuple(sorted(str(one.value) for one in names)), read.not_valid_after_utc
    )


def _general_name(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        pass
    try:
        return x509.DNSName(name.encode("idna").decode("ascii"))
    except UnicodeError as error:
        raise SettingsError(
            "certificate.name",
            "{name!r} is no host name or address; give one such as studio.local or 192.168.1.5",
            name=name,
        ) from error
