"""The real program opened to the network: an operator signs in with a browser, a camera pairs, all encrypted."""

import re
import shutil
import signal
import ssl
import subprocess
import sys
from contextlib import contextmanager

import pytest
from playwright.sync_api import expect

from studio.api.address import own_address
from tests import patient
from tests.acceptance.processes import wait_until
from tests.web.browser import quiet_page


@contextmanager
def open_program(sessions, *arguments):
    """`studio serve` on all addresses; yields address, operator token, camera token, warnings."""
    command = [sys.executable, "-m", "studio", "serve", "--host", "0.0.0.0", "--port", "0"]
    errors = sessions.parent / "serve.log"
    with (
        errors.open("w") as log,
        subprocess.Popen(
            [*command, "--sessions", str(sessions), *arguments], stdout=subprocess.PIPE, stderr=log, text=True
        ) as program,
    ):
        lines = [program.stdout.readline() for _ in range(3)]
        try:
            address = re.search(r"(https?://)0\.0\.0\.0(:\d+)", lines[0])
            assert address, (lines, errors.read_text())
            assert f" --server {address[1]}{own_address()}{address[2]} --token " in lines[2]
            yield f"{address[1]}127.0.0.1{address[2]}", lines[1].split()[-1], lines[2].split()[-1], errors
        finally:
            program.send_signal(signal.SIGINT)
            assert program.wait(timeout=60) == 0


def test_an_operator_signs_in_with_a_browser(tmp_path, chromium):
    with open_program(tmp_path / "sessions") as (url, operator, _, errors):
        with quiet_page(chromium) as page:
            page.goto(url)
            page.wait_for_url("**/signin?next=/")
            page.fill("#token", operator)
            page.click("button[type=submit]")
            page.wait_for_url(f"{url}/")
            page.wait_for_selector("body[data-connection=open]")
            assert "--tls-cert" in errors.read_text()  # the last that the server says at its start
            others = url.replace("127.0.0.1", own_address())  # what others reach, not where this browser is
            expect(page.locator(".no-camera code")).to_have_text(
                f"studio camera --source SOURCE --server {others}"
            )
            expect(page.locator(".no-camera")).not_to_contain_text("its own machine only")
            page.fill("#camera-label", "laptop")
            page.click("text=Pair cameras")
            command = page.inner_text(".secret code")
            assert f"--server {others} --token " in command
            expect(page.locator("#access-count")).to_contain_text("2 camera tokens")
            page.get_by_role("button", name="Link for viewers").click()
            expect(page.locator(".secret code")).to_contain_text(f"{others}/signin#")
            link = page.inner_text(".secret code")
        context = chromium.new_context()
        viewer = context.new_page()
        refused = []
        viewer.on("response", lambda answer: refused.append(answer.url) if answer.status >= 400 else None)
        viewer.goto(link)
        viewer.wait_for_selector("body[data-connection=open][data-role=viewer]")
        expect(viewer.locator("#record")).to_be_hidden()
        expect(viewer.locator("#access-panel")).to_be_hidden()
        assert refused == []
        context.close()
        page = chromium.new_page()
        page.goto(f"{url}/signin?next=//elsewhere.example/")
        page.fill("#token", "wrong")
        page.click("button[type=submit]")
        page.wait_for_selector("#problem:not([hidden])")
        assert "not the operator's token" in page.inner_text("#problem")
        page.fill("#token", operator)
        page.click("button[type=submit]")
        page.wait_for_url(f"{url}/")
        page.close()  # else it draws beside all other tests


def test_encrypted(tmp_path):
    if shutil.which("openssl") is None:
        pytest.skip("no openssl on this machine to make a certificate")
    certificate, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subprocess.run(
        [
            "openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=studio",
            "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", certificate,
        ],
        check=True, capture_output=True,
    )  # fmt: skip
    files = ("--tls-cert", str(certificate), "--tls-key", str(key))
    with open_program(tmp_path / "sessions", *files) as (url, operator, token, errors):
        assert "--tls-cert" not in errors.read_text()
        trusted = ssl.create_default_context(cafile=certificate)
        headers = {"Authorization": f"Bearer {operator}"}
        with patient.Client(base_url=f"{url}/api/v1/", verify=trusted, headers=headers) as client:
            command = [
                sys.executable, "-m", "studio", "camera", "--source", "simulated:0/1", "--server", url,
                "--token", token, "--spool", str(tmp_path / "spool"),
            ]  # fmt: skip
            command += ["--certificate", str(certificate), "--name", "other"]
            with subprocess.Popen(command, stdout=subprocess.DEVNULL) as camera:
                try:
                    wait_until(lambda: sends(camera, client), "the paired camera sends")
                finally:
                    camera.terminate()
            client.post(
                "local-cameras", json={"simulated": True}
            ).raise_for_status()  # clients of the server itself
            wait_until(lambda: frames_of(client).get("camera_1"), "the server's own cameras send")


def frames_of(client):
    """How many frames each camera has sent."""
    cameras = client.get("status").json()["cameras"]
    return {name: camera["frames"] for name, camera in cameras.items()}


def sends(program, client):
    """Whether a camera has sent some frames; its program must run."""
    assert program.poll() is None
    return any(frames > 5 for frames in frames_of(client).values())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tls-cert", "cert.pem"], "belong together"),
        (["--tls-cert", "missing.pem", "--tls-key", "missing.pem"], "PEM files"),
    ],
)
def test_wrong_certificates_are_said(tmp_path, arguments, words):
    command = [
        sys.executable,
        "-m",
        "studio",
        "serve",
        "--port",
        "0",
        "--sessions",
        str(tmp_path),
        *arguments,
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode in (1, 2)
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
