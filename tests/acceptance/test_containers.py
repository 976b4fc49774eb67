"""The container files say what they should, and their steps work when they are taken by hand."""

import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import httpx
import pytest
import yaml

from studio.__main__ import make_parser
from studio.server.config import PREFIX, Config
from tests import patient
from tests.acceptance.processes import free_port, wait_until

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
SERVICES = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))


def test_the_image_is_small_plain_and_watched():
    stages = re.findall(r"^FROM (\S+)(?: AS (\S+))?", DOCKERFILE, re.M)
    assert len(stages) == 2 and stages[0][1] == "build" and "--from=build" in DOCKERFILE
    last = DOCKERFILE.rsplit("\nFROM ", 1)[1]
    assert re.search(r"^USER 1000$", last, re.M) and re.search(r"^VOLUME /sessions$", last, re.M)
    assert re.search(r"^HEALTHCHECK .*\n.*127\.0\.0\.1:8000/health", last, re.M)
    assert not re.search(r"latest|TOKEN=|PASSWORD|SECRET", DOCKERFILE)


def test_everything_that_is_copied_is_let_in():
    let_in = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    for line in re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, re.M):
        assert set(line.split()) <= {*let_in, *(f"./{name}" for name in let_in)}, line


def test_compose_has_one_server_and_two_cameras_with_secrets():
    services = SERVICES["services"]
    cameras = {name: one for name, one in services.items() if name != "server"}
    assert len(cameras) == 2
    for one in cameras.values():
        args = make_parser().parse_args(one["command"])
        assert args.source.startswith("simulated:") and args.server == "http://server:8000"
        assert one["depends_on"]["server"]["condition"] == "service_healthy"
    known = {PREFIX + one.name.upper() for one in fields(Config)}
    for name, one in services.items():
        assert set(one["environment"]) <= known and one["read_only"] and one["cap_drop"] == ["ALL"], name
        for key, value in one["environment"].items():
            if "TOKEN" in key:
                assert value.removeprefix("/run/secrets/") in one["secrets"]
    assert set(SERVICES["secrets"]) == {"operator_token", "camera_token"}
    assert services["server"]["volumes"] == ["sessions:/sessions"]
    assert all(port.startswith("127.0.0.1:") for port in services["server"]["ports"])


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a POSIX shell")
def test_the_steps_by_hand(tmp_path):
    port = free_port()
    studio = f"{sys.executable} -m studio"
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with subprocess.Popen(
        ["sh", str(ROOT / "docker" / "by_hand.sh"), str(tmp_path), str(port)],
        env={**os.environ, "STUDIO": studio, "PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as steps:
        try:
            wait_until((tmp_path / "docker" / "operator_token").exists, "the secrets are there")
            token = (tmp_path / "docker" / "operator_token").read_text()
            with patient.Client(base_url=f"http://127.0.0.1:{port}", timeout=60) as client:
                wait_until(lambda: healthy(client), "the server is healthy")
                assert client.get("/api/v1/status").status_code == 401
                client.headers["Authorization"] = f"Bearer {token}"
                wait_until(lambda: len(cameras(client)) == 2, "both cameras are live")
                assert set(cameras(client)) == {"left", "right"}
        finally:
            os.killpg(steps.pid, signal.SIGTERM)
            said = steps.communicate(timeout=60)[0]
    assert steps.returncode == 0, said
    for name in ("operator_token", "camera_token"):
        assert (tmp_path / "docker" / name).read_text() not in said, "no secret in the output"
    assert (tmp_path / "docker").stat().st_mode & 0o077 == 0


def healthy(client: httpx.Client) -> bool:
    try:
        return client.get("/health").status_code == 200
    except httpx.TransportError:
        return False


def cameras(client: httpx.Client) -> list[str]:
    """Names of the cameras that send frames."""
    found = client.get("/api/v1/status").json()["cameras"]
    return [name for name, camera in found.items() if camera["frames"] > 5]
