"""A stage of depth cameras that watch one performer."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.simulator.body.mesh import BodyMesh, make_body
from studio.simulator.body.performers import Actor
from studio.simulator.performer.figure import Figure
from studio.simulator.performer.motion import PerformerMotion
from studio.simulator.performer.prop import HeldProp
from studio.simulator.rig import RigCamera
from studio.simulator.sensor.camera import SimulatedDepthCamera
from studio.simulator.sensor.room import Room
from studio.simulator.sensor.sensors import Sensor

_DROP_SHARE = 0.004
"""Share of the frames at which a loss of frames begins."""

_DROP_LONGEST = 3


@dataclass(frozen=True)
class DepthStage:
    """Data shared by all cameras of a stage.

    Attributes:
        sensor: of every camera.
        rig: poses of the cameras.
        performance: the performer's motion.
        mesh: the performer's body.
        others: bodies of further people in view, and their motions.
        room: the surrounding room.
        seed: of all noise.
        props: held in a hand.
    """

    sensor: Sensor
    rig: tuple[RigCamera, ...]
    performance: PerformerMotion
    mesh: BodyMesh
    room: Room
    seed: int
    others: tuple[tuple[BodyMesh, PerformerMotion], ...] = ()
    props: tuple[HeldProp, ...] = ()

    @staticmethod
    def of(
        sensor: Sensor,
        rig: tuple[RigCamera, ...],
        performance: PerformerMotion,
        performer: Actor,
        *,
        seed: int = 0,
        furniture: bool = False,
        others: tuple[tuple[Actor, PerformerMotion], ...] = (),
        props: tuple[HeldProp, ...] = (),
    ) -> "DepthStage":
        """Return the stage of a performer, others in view and props, in a room around the rig and all people."""
        people = [
            done.motion.positions_m.reshape(-1, 3) for done in (performance, *(done for _, done in others))
        ]
        places = np.concatenate([[camera.T_stage_camera[:3, 3] for camera in rig], *people])
        mesh = make_body(performer, performance.motion.offsets_m)
        room = Room.around(places, furniture=furniture)
        more = tuple((make_body(who, other.motion.offsets_m), other) for who, other in others)
        return DepthStage(sensor, rig, performance, mesh, room, seed, more, props)

    def camera(self, index: int) -> SimulatedDepthCamera:
        """Return one camera; cameras with the same index give the same images at the same times."""
        people = (Figure(self.mesh, self.performance), *(Figure(mesh, other) for mesh, other in self.others))
        return SimulatedDepthCamera(
            self.sensor,
            self.rig[index].T_stage_camera,
            (*people, *self.props),
            self.room,
            np.random.default_rng([self.seed, index, 1]),
            cameras=len(self.rig),
        )


def dropped(rng: np.random.Generator, count: int) -> NDArray[np.bool_]:
    """Return which of `count` frames are lost, in bursts of 1 to 3, shape (count,)."""
    lost = np.zeros(count, dtype=bool)
    for start in np.nonzero(rng.random(count) < _DROP_SHARE)[0]:
        lost[start : start + rng.integers(1, _DROP_LONGEST + 1)] = True
    return lost
