"""Notifications of recordings that start and stop, and of solved takes: XML over UDP, and HTTP webhooks."""

import json
import logging
import queue
import socket
import threading
import time
from dataclasses import asdict, dataclass
from urllib.error import URLError
from urllib.request import Request, urlopen

from studio.engine.base.sentences import say
from studio.triggers.capture_xml import capture_packet
from studio.triggers.listeners import Heard, TriggerStatus

_MOST_WAITING = 200
_TIMEOUT_S, _TRIES, _BETWEEN_S = 5.0, 3, 1.0
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TriggerNews:
    """An event to report.

    Attributes:
        event: `start`, `stop` or `solved`.
        session, take: names of the session and the take.
        timecode: timecode of the event, "" = none.
        solve: for `solved`, the solve's name.
        seconds: for `stop`, the take's length [s].
    """

    event: str
    session: str
    take: str
    timecode: str = ""
    solve: str = ""
    seconds: float = 0.0


class XmlTeller:
    """Sends `CaptureStart` and `CaptureStop` to addresses; packet numbers begin at a value from the clock."""

    def __init__(self, targets: tuple[tuple[str, int], ...], token: str) -> None:
        self._targets = targets
        self._token = token
        self._packet = int(time.time()) % 1_000_000 * 10
        self.heard = Heard(", ".join(f"{host}:{port}" for host, port in targets))

    def tell(self, news: TriggerNews) -> None:
        """Send the packet of a start or a stop, without waiting for the network."""
        if news.event == "solved":
            return
        self._packet += 1
        data = capture_packet(
            news.event, name=news.take, session=news.session, timecode=news.timecode, packet=self._packet,
            token=self._token,
        )  # fmt: skip
        for target in self._targets:
            try:
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
                    channel.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                    channel.sendto(data, target)
            except OSError as error:
                self._fail(f"{target[0]}:{target[1]}", error)
            else:
                self.heard.problem = ""
                self.heard.add(f"{news.event} {news.take}", "")

    def _fail(self, address: str, error: OSError) -> None:
        self.heard.problem = say(
            "trigger.not_told",
            "cannot tell {address}: {error}",
            address=address,
            error=error.strerror or error,
        )

    def status(self) -> TriggerStatus:
        """Return the state so far."""
        return self.heard.status()


class WebhookTeller:
    """Posts JSON to addresses in order, from its own thread; a failed post is retried."""

    def __init__(self, urls: tuple[str, ...], token: str) -> None:
        self._urls = urls
        self._token = token
        self.heard = Heard(", ".join(urls))
        self._queue: queue.Queue[TriggerNews | None] = queue.Queue(_MOST_WAITING)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="webhooks", daemon=True)
        self._thread.start()

    def tell(self, news: TriggerNews) -> None:
        """Queue the news for posting; if the queue is full, they are dropped, which is reported."""
        try:
            self._queue.put_nowait(news)
        except queue.Full:
            self.heard.add(f"{news.event} {news.take}", say("trigger.dropped", "too many wait to be told"))

    def _run(self) -> None:
        while (news := self._queue.get()) is not None:
            for url in self._urls:
                self._post(url, news)

    def _post(self, url: str, news: TriggerNews) -> None:
        body = json.dumps({key: value for key, value in asdict(news).items() if value}).encode()
        headers = {"Content-Type": "application/json"}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        what = f"{news.event} {news.take}"
        for number in range(_TRIES):
            try:
                with urlopen(Request(url, body, headers), timeout=_TIMEOUT_S):
                    self.heard.problem = ""
                    self.heard.add(what, "")
                    return
            except (OSError, URLError, ValueError) as error:
                self.heard.problem = say(
                    "trigger.not_told", "cannot tell {address}: {error}", address=url, error=error
                )
                _log.info("webhook %s: %s", url, error)
            if number + 1 < _TRIES and self._stopping.wait(_BETWEEN_S):
                return
        self.heard.add(what, self.heard.problem)

    def status(self) -> TriggerStatus:
        """Return the state so far."""
        return self.heard.status()

    def close(self) -> None:
        """Stop posting; wait at most 1 s for a post in progress."""
        self._stopping.set()
        while True:
            try:
                self._queue.put_nowait(None)
                break
            except queue.Full:
                self._queue.get_nowait()
        self._thread.join(timeout=1.0)
