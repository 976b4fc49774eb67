"""What triggers do: each take is made once, by its name, whatever is doubled, late or from somebody else."""

import pytest

from studio.engine.base.errors import TakeError
from studio.triggers.command import TriggerCommand
from studio.triggers.operator import TriggerOperator


class Stage:
    """Takes as names in a list."""

    def __init__(self):
        self.takes, self.running = [], None

    def recording_name(self):
        return self.running

    def start_trigger(self, session, take, notes):
        if take == "full":
            raise TakeError("recording.disk_low", "the disk is full")
        self.running = f"{session or 'today'}/{take or len(self.takes) + 1}"
        self.takes.append(self.running)
        return self.running

    def stop_trigger(self):
        ended, self.running = self.running, None
        return ended


@pytest.fixture
def now():
    return [0.0]


@pytest.fixture
def stage():
    return Stage()


@pytest.fixture
def operator(stage, now):
    return TriggerOperator(stage, now_s=lambda: now[0])


def start(name="a", packet="", **more):
    return TriggerCommand("start", name=name, packet=packet, **more)


def stop(name="a", packet="", **more):
    return TriggerCommand("stop", name=name, packet=packet, **more)


def test_doubled_packets(operator, stage, now):
    assert operator.perform(start(packet="5"), "x") == ""
    assert operator.perform(start(packet="5"), "x").code == "trigger.doubled"
    assert operator.perform(stop(packet="6"), "x") == ""
    now[0] = 5.0
    assert operator.perform(start(packet="5"), "x").code == "trigger.doubled"  # it went a long way round
    assert operator.perform(stop(packet="6"), "x").code == "trigger.doubled"
    assert operator.perform(start(packet="7"), "x") == ""
    assert stage.takes == ["today/a", "today/a"]


def test_packets_without_a_number(operator, stage, now):
    for _ in range(2):
        operator.perform(start(), "x")
    operator.perform(stop(), "x")
    assert operator.perform(start(), "x").code == "trigger.doubled"
    now[0] = 2.0
    assert operator.perform(start(), "x") == ""  # a retake
    assert len(stage.takes) == 2


def test_late_packets(operator, stage, now):
    operator.perform(start("a", "1"), "x")
    assert operator.perform(stop("b", "2"), "x").code == "trigger.another"
    operator.perform(stop("a", "3"), "x")
    assert operator.perform(stop("c", "5"), "x").code == "trigger.nothing"
    assert operator.perform(start("c", "4"), "x").code == "trigger.late"
    now[0] = 3.0
    assert operator.perform(start("c", "6"), "x") == ""
    assert stage.takes == ["today/a", "today/c"]


def test_another_senders_start_does_not_cut_a_take(operator, stage):
    operator.perform(start("a"), "x")
    assert operator.perform(start("b"), "y").code == "trigger.under_way"
    assert operator.perform(start("a"), "y").code == "trigger.runs"
    assert operator.perform(stop("a"), "y") == ""
    assert stage.takes == ["today/a"]


def test_names_that_no_folder_can_have(operator, stage):
    operator.perform(start("../../etc/pass:wd", session="a/b"), "x")
    assert ".." not in stage.takes[0].split("/") and stage.takes[0].count("/") == 1
    assert operator.perform(stop("../../etc/pass:wd"), "x") == ""


def test_a_foot_switch(operator, stage):
    for _ in range(5):
        assert operator.perform(TriggerCommand("toggle"), "midi", has_token=False) == ""
    assert len(stage.takes) == 3 and stage.running


def test_a_token(stage):
    operator = TriggerOperator(stage, "secret-1")
    assert operator.perform(start(), "x").code == "trigger.token"
    assert operator.perform(start(token="secret-2"), "x").code == "trigger.token"
    assert operator.perform(start(token="secret-1"), "x") == ""
    assert operator.perform(TriggerCommand("toggle"), "midi", has_token=False) == ""


def test_what_the_stage_refuses_is_said(operator):
    assert operator.perform(start("full"), "x").code == "recording.disk_low"


def test_memory_does_not_grow(operator):
    for number in range(2_000):
        operator.perform(start(f"take {number}", str(number)), f"sender {number % 7}")
        operator.perform(stop(f"stop {number}", str(number)), "x")
    assert len(operator._packets) <= 256 and len(operator._stopped) <= 256
