"""`studio certificate`: what it writes, and what a server does with it."""

import datetime
import ssl
import stat

import pytest
from cryptography import x509

from studio.__main__ import main
from studio.engine.base.errors import SettingsError, StudioError
from studio.server.certificate import CERTIFICATE, DAYS, KEY, make_certificate, own_certificate, own_names
from studio.server.config import Config
from studio.server.tls import chosen_tls, tls_lines
from tests.refused import refused

NOW = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)


def test_it_is_for_this_machine_and_can_sign_nothing(tmp_path, capsys):
    assert main(["certificate", "--sessions", str(tmp_path), "--name", "stage.example"]) == 0
    made = own_certificate(tmp_path)
    assert {"127.0.0.1", "::1", "localhost", "stage.example"} <= set(made.names)
    assert stat.S_IMODE((tmp_path / KEY).stat().st_mode) == 0o600
    said = capsys.readouterr().out
    assert "stage.example" in said and "studio serve --host 0.0.0.0" in said
    read = x509.load_pem_x509_certificate((tmp_path / CERTIFICATE).read_bytes())
    assert not read.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    ssl.create_default_context(cafile=tmp_path / CERTIFICATE)


def test_it_is_used_on_the_network_alone_and_after_a_given_one(tmp_path):
    config = Config(sessions=tmp_path)
    assert chosen_tls(config, open_to_others=True) is None
    own = make_certificate(tmp_path, ["192.0.2.7"], NOW)
    assert chosen_tls(config, open_to_others=False) is None
    assert chosen_tls(config, open_to_others=True).own == own
    given = Config(sessions=tmp_path, tls_cert=own.certificate, tls_key=own.key)
    tls = chosen_tls(given, open_to_others=True)
    assert tls.own is None and tls_lines(tls, "192.0.2.7") == []


def test_it_says_when_it_no_longer_fits(tmp_path):
    own = make_certificate(tmp_path, ["192.0.2.7"], NOW)
    assert own.problem(["192.0.2.7"], NOW) == ""
    assert "not for 192.0.2.8" in own.problem(["192.0.2.8"], NOW)
    later = NOW + datetime.timedelta(days=DAYS, hours=1)
    assert "ended on" in own.problem(["192.0.2.7"], later)
    lines = tls_lines(chosen_tls(Config(sessions=tmp_path), open_to_others=True), "192.0.2.8")
    assert any("fingerprint" in line for line in lines) and lines[-1].startswith("warning: ")


def test_bad_names_and_files_are_refused(tmp_path):
    with refused(SettingsError, "certificate.name"):
        make_certificate(tmp_path, ["a" * 70 + ".example"], NOW)
    make_certificate(tmp_path, own_names(), NOW)
    (tmp_path / CERTIFICATE).write_text("nonsense")
    with refused(StudioError, "certificate.unreadable"):
        own_certificate(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(StudioError):
        make_certificate(tmp_path / "file", own_names(), NOW)
