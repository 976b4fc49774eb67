"""Clients that wait a minute where a test does not say otherwise: a machine that is busy is slow, not wrong.

They keep no idle connection, which the server could close just when it is used again.
"""

from functools import partial
from typing import Any

import httpx
from websockets.sync import client

WAIT_S = 60.0


class Client(httpx.Client):
    """httpx's client, patient."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"timeout": WAIT_S, "limits": httpx.Limits(max_keepalive_connections=0)} | options)


request = partial(httpx.request, timeout=WAIT_S)
get = partial(httpx.get, timeout=WAIT_S)
post = partial(httpx.post, timeout=WAIT_S)
put = partial(httpx.put, timeout=WAIT_S)
patch = partial(httpx.patch, timeout=WAIT_S)
delete = partial(httpx.delete, timeout=WAIT_S)
connect = partial(client.connect, open_timeout=WAIT_S, ping_timeout=WAIT_S)
