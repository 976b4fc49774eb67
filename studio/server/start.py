"""Starts the server: its socket and the simulated stage's cameras, then its code.

Loading the code takes more than a second of one core. The cameras load theirs on another one meanwhile, and are
connected once the server answers.
"""

from contextlib import suppress

from studio.api.cameras.client_process import SPOOL, ClientProcess
from studio.api.cameras.simulated import simulated_sources
from studio.engine.base.loading import loading
from studio.server.config import Config
from studio.server.listening import LOOPBACK, open_socket, url_of
from studio.server.logs import set_up_logging


def serve(config: Config, *, demo: str | None = None, performers: int = 1) -> int:
    """Run the studio until Ctrl-C or SIGTERM, then save a recording under way; return the exit code 0.

    Args:
        config: address and folder of takes (made if missing); a loopback address keeps other machines out.
        demo: start simulated cameras of this kind (`DEMO_CAMERAS`), and calibrate if there is no calibration yet.
        performers: how many the simulated stage has.

    Raises:
        StudioError: the port is in use, the folder cannot be made, or the certificate or a token cannot be used.
    """
    set_up_logging(config.log_format, config.log_level)
    listening = open_socket(config.host, config.port)
    sources = None if demo is None else simulated_sources(demo, performers)
    running: dict[str, ClientProcess] = {}
    try:
        if sources and config.host in LOOPBACK and config.tls_cert is None:  # no token, no certificate
            url, folder = url_of(config.host, listening), config.sessions / SPOOL
            with suppress(OSError):  # an error of the folder, which the server reports
                for name, source in sources.items():
                    running[name] = ClientProcess(
                        name, source, url=url, token="", folder=folder, certificate=None
                    )
        with loading():
            from studio.server.run import run
        return run(config, listening, sources=sources, performers=performers, running=running)
    finally:
        listening.close()
        for one in running.values():
            one.end()
