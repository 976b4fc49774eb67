"""Depth images of several performers with mutual occlusion."""

from collections.abc import Callable

from studio.engine.base.errors import SettingsError
from studio.simulator.body.performers import SCORING, TUNING, Actor, find_performer
from studio.simulator.crowd.meeting import Meeting
from studio.simulator.performer.motion import perform
from studio.simulator.rig import RigCamera
from studio.simulator.sensor.recording import record_depth, truth_csv
from studio.simulator.sensor.sensors import Sensor, find_sensor
from studio.simulator.sensor.stage import DepthStage
from studio.take.folder.take import Take


def depth_stage(
    together: Meeting,
    rig: tuple[RigCamera, ...],
    sensor: Sensor,
    performer: str,
    *,
    seed: int = 0,
    furniture: bool = False,
) -> DepthStage:
    """Return the stage on which performers meet.

    Args:
        together: their motions.
        performer: body of the first; the others get the bodies that follow it in its set.
        seed, furniture: see `DepthStage.of`.

    Raises:
        SettingsError: unknown body, or too few bodies.
    """
    bodies = _cast(performer, len(together.motions))
    first, *others = [
        perform(motion, body, calibration_s=together.calibration_s, enters_s=enters_s)
        for motion, body, enters_s in zip(together.motions, bodies, together.enters_s, strict=True)
    ]
    more = tuple(zip(bodies[1:], others, strict=True))
    return DepthStage.of(sensor, rig, first, bodies[0], seed=seed, furniture=furniture, others=more)


def record_crowd_depth(
    together: Meeting,
    rig: tuple[RigCamera, ...],
    *,
    sensor: str,
    performer: str,
    furniture: bool,
    seed: int,
    progress: Callable[[float], None] | None,
) -> tuple[Callable[[Take], None], list[bytes]]:
    """Return a function that records several performers' depth images into a take, and each one's truth as CSV.

    Args:
        sensor: name; the other arguments as in `depth_stage`.
    """
    stage = depth_stage(together, rig, find_sensor(sensor), performer, seed=seed, furniture=furniture)

    def write(take: Take) -> None:
        record_depth(take, stage, progress)

    return write, [truth_csv(done) for done in (stage.performance, *(done for _, done in stage.others))]


def _cast(performer: str, count: int) -> list[Actor]:
    first = find_performer(performer)
    of = TUNING if first in TUNING else SCORING
    if count > len(of):
        raise SettingsError(
            "simulator.few_bodies",
            "{count} motions: there are bodies for {most} performers before depth cameras; give fewer",
            count=count,
            most=len(of),
        )
    return [of[(of.index(first) + k) % len(of)] for k in range(count)]
