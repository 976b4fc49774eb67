"""`studio camera --wait`: a camera client that waits for a studio, serves it, and waits again once it is released."""

import sys
from typing import Any

from studio import wire
from studio.camera.client.link import RefusedError
from studio.camera.client.run import run_camera
from studio.camera.sources.registry import parse_source
from studio.camera.waiting.wait import wait_for_call
from studio.engine.base.errors import SettingsError


def run_waiting(source: str, name: str | None, host: str, **options: Any) -> int:
    """Wait for studios and send a source's frames to them until Ctrl-C, SIGTERM or the source's end; return 0.

    Args:
        source: a text, see `SOURCES`; it is opened once a studio has called.
        name: of the camera.
        host: address to wait on, see `wait_for_call`.
        options: of `run_camera`.

    Raises:
        SettingsError: no name, or a host that is not this machine's.
        StudioError: the source cannot be used, or the camera cannot be announced.
    """
    parse_source(source)
    if name is None or not wire.is_camera_name(name):
        raise SettingsError(
            "waiting.name",
            "a camera that waits needs a name by which the studio lists it; give --name, such as --name left",
        )
    kind = source.partition(":")[0].partition("?")[0]

    def show(code: str) -> None:
        print(f"{name} waits for a studio; connect it on the studio's page with the code {code}", flush=True)

    while (call := wait_for_call(name, kind, host, show)) is not None:
        print(f"{name} goes to {call.server}", flush=True)
        try:
            return run_camera(source, call.server, name, call.token, until_let_go=True, **options)
        except RefusedError as error:
            print(f"studio camera: {error}", file=sys.stderr, flush=True)
    return 0
