"""Camera clocks: offset and drift from time-stamped exchanges, and composition of clock models (step 3).

Exchanges as in NTP (RFC 5905, section 8) compare a camera's clock with the server's. A slow exchange is imprecise, so
only the fastest of each few seconds is kept. Once these span long enough, a robust line through them gives the drift.
Whatever the delays of the two directions, the error of an exchange is at most half its round trip. Two in a row that
contradict the line by more than that prove that the camera's clock jumped, and start a new segment.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from studio.engine.model.frames import ClockModel

WINDOW_NS = 120_000_000_000
"""Time for which an exchange is kept."""

BUCKET_NS = 4_000_000_000
"""The fastest exchange of each span of this length is kept."""

DRIFT_SPAN_NS = 20_000_000_000
"""Drift is estimated once the exchanges span this long; with less, noise would look like drift."""

MAX_DRIFT_PPM = 500.0
KNOWN_DRIFT_PPM = 50.0
"""Bounds of the drift: of an estimate, and of its error once estimated."""

STEP_NS = 3_000_000
"""Smallest jump of a clock, beyond the round trips; smaller ones are left to the drift estimate."""

MAX_ROUND_TRIP_NS = 2_000_000_000

ARRIVAL_STEP_NS = 500_000_000
ARRIVAL_SPREAD_NS = 100_000_000
AHEAD_ARRIVALS, BEHIND_ARRIVALS = 2, 15
"""For a clock known by arrivals alone: it has jumped if this many frames in a row are early or late by more than a
step and by about the same amount. No delay makes frames early. A held-up link makes them late by decreasing amounts.
"""


@dataclass(frozen=True)
class _ClockSample:
    device_ns: int
    offset_ns: int
    round_trip_ns: int


class ClockEstimator:
    """Estimates the map from one camera's clock to the server's clock.

    Attributes:
        segment: number of jumps of the camera's clock so far; the model belongs to the present segment.
        step_ns: change of the offset in the last jump [ns].
    """

    def __init__(self) -> None:
        self.segment = 0
        self.step_ns = 0
        self._suspect: _ClockSample | None = None
        self._samples: deque[_ClockSample] = deque()
        self._one_way: _ClockSample | None = None
        self._odd: list[_ClockSample] = []
        self._model: ClockModel | None = None

    @property
    def model(self) -> ClockModel | None:
        """The map from the camera's clock to the server's; None before the first frame or exchange."""
        return self._model

    @property
    def exchanged(self) -> bool:
        """Whether an exchange was made; without one, the model assumes that frames arrive without delay."""
        return bool(self._samples)

    @property
    def round_trip_ns(self) -> int | None:
        """The shortest round-trip time within the window [ns]."""
        return min((sample.round_trip_ns for sample in self._samples), default=None)

    @property
    def error_ns(self) -> int | None:
        """Largest error of the model due to the network: half the shortest round trip [ns]."""
        least = self.round_trip_ns
        return None if least is None else least // 2

    def add_exchange(
        self, client_send_ns: int, server_receive_ns: int, server_send_ns: int, client_receive_ns: int
    ) -> bool:
        """Add one exchange; return whether it is plausible (no time runs backwards, round trip under 2 s).

        Args:
            client_send_ns, client_receive_ns: on the camera's clock [ns].
            server_receive_ns, server_send_ns: on the server's clock [ns].
        """
        inside_ns = server_send_ns - server_receive_ns
        round_trip_ns = (client_receive_ns - client_send_ns) - inside_ns
        if inside_ns < 0 or not 0 <= round_trip_ns <= MAX_ROUND_TRIP_NS:
            return False
        offset_ns = (server_receive_ns - client_send_ns + server_send_ns - client_receive_ns) // 2
        sample = _ClockSample((client_send_ns + client_receive_ns) // 2, offset_ns, round_trip_ns)
        if self._contradicts(sample):
            first, self._suspect = self._suspect, sample
            if first is None or not _agree(first, sample):
                return True
            assert self._model is not None
            self.step_ns = offset_ns - (self._model.stage_ns(sample.device_ns) - sample.device_ns)
            self.segment += 1
            self._samples.clear()
            self._keep(first)
        self._suspect = None
        self._keep(sample)
        self._model = self._fit()
        return True

    def _contradicts(self, sample: _ClockSample) -> bool:
        """Whether no delay can explain the difference between an exchange and the model."""
        least = self.round_trip_ns
        if least is None or self._model is None:
            return False
        ppm = MAX_DRIFT_PPM if self._model.drift_ppm == 0.0 else KNOWN_DRIFT_PPM
        drift_ns = ppm * 1e-6 * abs(sample.device_ns - self._model.reference_ns)
        difference = sample.offset_ns - (self._model.stage_ns(sample.device_ns) - sample.device_ns)
        return abs(difference) > (least + sample.round_trip_ns) // 2 + drift_ns + STEP_NS

    def add_arrival(self, device_ns: int, arrival_ns: int) -> None:
        """Add a frame's device time and arrival. Until the first exchange, the delay counts as zero.

        If arrivals show a jump of the clock, a new segment starts.
        """
        if self._samples:
            return
        offset_ns = arrival_ns - device_ns
        old = self._one_way
        if old is not None and abs(offset_ns - old.offset_ns) > ARRIVAL_STEP_NS:
            if not self._jumped(_ClockSample(device_ns, offset_ns, 0)):
                return
            self.step_ns = self._odd[-1].offset_ns - old.offset_ns
            self.segment += 1
            first = min(self._odd, key=lambda sample: sample.offset_ns)
            device_ns, offset_ns, old = first.device_ns, first.offset_ns, None
        self._odd.clear()
        if old is None or offset_ns < old.offset_ns or abs(device_ns - old.device_ns) > WINDOW_NS:
            self._one_way = _ClockSample(device_ns, offset_ns, 0)
            self._model = ClockModel(offset_ns=offset_ns, reference_ns=device_ns)

    def _jumped(self, sample: _ClockSample) -> bool:
        """Whether this arrival and those before it prove that the clock jumped."""
        assert self._one_way is not None
        if self._odd and abs(sample.offset_ns - self._odd[0].offset_ns) > ARRIVAL_SPREAD_NS:
            self._odd.clear()
        self._odd.append(sample)
        ahead = sample.offset_ns < self._one_way.offset_ns
        return len(self._odd) >= (AHEAD_ARRIVALS if ahead else BEHIND_ARRIVALS)

    def _keep(self, sample: _ClockSample) -> None:
        """Keep the sample if it is the fastest of its few seconds; drop old samples."""
        samples = self._samples
        if samples and samples[-1].device_ns // BUCKET_NS == sample.device_ns // BUCKET_NS:
            if sample.round_trip_ns <= samples[-1].round_trip_ns:
                samples[-1] = sample
        else:
            samples.append(sample)
        while sample.device_ns - samples[0].device_ns > WINDOW_NS:
            samples.popleft()

    def _fit(self) -> ClockModel:
        """A line through the kept samples (Theil-Sen: the median of all slopes), or the best sample alone."""
        least = min(sample.round_trip_ns for sample in self._samples)
        good = [s for s in self._samples if s.round_trip_ns <= 2 * least + 500_000]
        newest = good[-1]
        if newest.device_ns - good[0].device_ns < DRIFT_SPAN_NS or len(good) < 4:
            best = min(good, key=lambda s: (s.round_trip_ns, -s.device_ns))
            return ClockModel(offset_ns=best.offset_ns, reference_ns=best.device_ns)
        time = np.array([s.device_ns - newest.device_ns for s in good], dtype=np.float64)
        offset = np.array([s.offset_ns - newest.offset_ns for s in good], dtype=np.float64)
        first, second = np.triu_indices(len(good), 1)
        slope = float(np.median((offset[second] - offset[first]) / (time[second] - time[first])))
        slope = min(max(slope, -MAX_DRIFT_PPM * 1e-6), MAX_DRIFT_PPM * 1e-6)
        at_newest = float(np.median(offset - slope * time))
        return ClockModel(newest.offset_ns + round(at_newest), slope * 1e6, newest.device_ns)


def _agree(a: _ClockSample, b: _ClockSample) -> bool:
    """Whether two exchanges are consistent with one clock."""
    drift_ns = MAX_DRIFT_PPM * 1e-6 * abs(a.device_ns - b.device_ns)
    return abs(a.offset_ns - b.offset_ns) <= (a.round_trip_ns + b.round_trip_ns) // 2 + drift_ns + STEP_NS


def invert(clock: ClockModel) -> ClockModel:
    """Return the inverse model: from B to A where `clock` maps A to B."""
    at = clock.stage_ns(clock.reference_ns)
    drift = 1.0 / (1.0 + clock.drift_ppm * 1e-6) - 1.0
    return ClockModel(clock.reference_ns - at, drift * 1e6, at)


def chain(first: ClockModel, second: ClockModel) -> ClockModel:
    """Return the model A to C from `first`, A to B, and `second`, B to C."""
    at = first.reference_ns
    drift = (1.0 + first.drift_ppm * 1e-6) * (1.0 + second.drift_ppm * 1e-6) - 1.0
    return ClockModel(second.stage_ns(first.stage_ns(at)) - at, drift * 1e6, at)


def shifted(clock: ClockModel, offset_ns: int) -> ClockModel:
    """Return the model with `offset_ns` added to its results."""
    return ClockModel(clock.offset_ns + offset_ns, clock.drift_ppm, clock.reference_ns)
