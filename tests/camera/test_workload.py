"""What limits a camera client."""

from studio.camera.client.workload import Workload, processor_ns

SECOND = 1_000_000_000


class Times:
    """The clock, and what tracker and process have used so far [ns]."""

    def __init__(self) -> None:
        self.now, self.tracked, self.used = 0, 0, 0

    def workload(self) -> Workload:
        return Workload(lambda: self.tracked, clock_ns=lambda: self.now, used_ns=lambda: self.used)

    def go(self, *, tracked: float = 0.0, used: float = 0.0) -> None:
        """Let a second pass in which tracker and process use these shares of it."""
        self.now += SECOND
        self.tracked += round(tracked * SECOND)
        self.used += round(used * SECOND)


def test_the_busier_of_tracker_and_process_counts():
    times = Times()
    workload = times.workload()
    times.go(tracked=0.96, used=0.2)
    assert workload.shares() == (96, 0)
    times = Times()
    workload = times.workload()
    times.go(tracked=0.1, used=1.7)  # two threads on two processors
    assert workload.shares() == (100, 0)


def test_the_last_three_seconds_count():
    times = Times()
    workload = times.workload()
    for share in (1.0, 1.0, 1.0, 0.3, 0.3, 0.3, 0.3):
        times.go(tracked=share)
        found = workload.shares()
    assert found == (30, 0)


def test_waiting_for_the_network_is_told_apart():
    times = Times()
    workload = times.workload()
    begin = times.now
    times.go(used=0.1)
    workload.sent(begin)
    times.go(used=0.1)
    assert workload.shares() == (10, 50)


def test_a_process_that_computes_is_seen_to():
    before = processor_ns()
    total = 0
    while processor_ns() == before:
        total += sum(range(1000))
    assert processor_ns() > before
