"""Clients that wait a minute where a test does not say otherwise: a machine that is busy is slow, not wrong.

They keep no idle connection, which the server could close just when it is used again. They share the certificates of
the system: loading them takes some 20 ms, which each request would take otherwise.
"""

from functools import partial
from typing import Any

import httpx
from websockets.sync import client

WAIT_S = 60.0
_TRUSTED = httpx.create_ssl_context()


class Client(httpx.Client):
    """httpx's client, patient."""

    def __init__(self, **options: Any) -> None:
        usual = {"timeout": WAIT_S, "limits": httpx.Limits(max_keepalive_connections=0), "verify": _TRUSTED}
        super().__init__(**usual | options)


request = partial(httpx.request, timeout=WAIT_S, verify=_TRUSTED)
get = partial(httpx.get, timeout=WAIT_S, verify=_TRUSTED)
post = partial(httpx.post, timeout=WAIT_S, verify=_TRUSTED)
put = partial(httpx.put, timeout=WAIT_S, verify=_TRUSTED)
patch = partial(httpx.patch, timeout=WAIT_S, verify=_TRUSTED)
delete = partial(httpx.delete, timeout=WAIT_S, verify=_TRUSTED)
connect = partial(client.connect, open_timeout=WAIT_S, ping_timeout=WAIT_S)
