"""Identity of simulated performers, scored by the true owner of each body, without calibration and solve.

Ten motions (those of `STUDIO_TEST_DATA/mocap` and the embedded one) meet in five ways, each with its own seed.
"""

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.identity.whole_take import People, find_people
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.simulator.crowd.meeting import Meeting, meet
from studio.simulator.crowd.seen import SeenCrowd, see_crowd
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig

WAYS = ("passing", "circling", "embracing", "lifting", "back-to-back")
TAKES = 50
_LEAST_SHARE = 0.99
"""Least share of a performer's bodies that must be their own."""


@dataclass(frozen=True)
class Told:
    """How often a performer changes to another, and the share of bodies that are nobody's or somebody else's."""

    people: People
    performers: int
    switches: int
    wrong: float
    missed: float

    def right(self, performers: int) -> bool:
        """Whether this many performers were found, and all kept their identity."""
        return self.performers == performers and self.switches == 0 and self.wrong <= 1.0 - _LEAST_SHARE


def frames_of(seen: SeenCrowd) -> list[CameraFrame]:
    """A camera's frames, as they come from a recording."""
    out: list[CameraFrame] = []
    for k, (stamp, bodies) in enumerate(zip(seen.device_time_ns.tolist(), seen.bodies, strict=True)):
        every = [
            CameraFrame(seen.camera, k, stamp, one.positions_m, one.confidence, body=one.number)
            for one in bodies
        ]
        if every:
            out.append(CameraFrame(**{**vars(every[0]), "others": tuple(every[1:])}))
    return out


def crowd_of(
    motions: Sequence[str | Path], meeting: str, cameras: int, seed: int, *, seconds: float | None = None
):
    """Simulated performers, what the cameras see of them, their frames, and the true calibration.

    Args:
        seconds: they perform for, at most; None = the whole of the shortest motion.
    """
    whole = [stage_motion(path, calibration=False)[0] for path in motions]
    together = meet([motion if seconds is None else beginning(motion, seconds) for motion in whole], meeting)
    rig = standard_rig(cameras)
    seen = list(see_crowd(together, rig, seed=seed))
    placed = {
        camera.name: CameraCalibration(T_stage_camera=camera.T_stage_camera, clock=_clock(one))
        for camera, one in zip(rig, seen, strict=True)
    }
    walker = Performer(1.75, together.motions[0].offsets_m)
    calibration = Calibration(reference=rig[0].name, cameras=placed, performer=walker)
    return together, seen, {one.camera: frames_of(one) for one in seen}, calibration


def beginning(motion: CanonicalMotion, seconds: float) -> CanonicalMotion:
    """Return a motion's first seconds."""
    count = round(seconds / motion.frame_s)
    return replace(motion, positions_m=motion.positions_m[:count], hands_open=motion.hands_open[:count])


def _clock(seen: SeenCrowd) -> ClockModel:
    device_ns, taken_ns = seen.device_time_ns, np.round(seen.taken_s * 1e9).astype(np.int64)
    slope = np.polyfit(device_ns - device_ns[0], taken_ns - device_ns, 1)
    return ClockModel(round(slope[1]), 1e6 * slope[0], int(device_ns[0]))


def told(together: Meeting, seen: list[SeenCrowd], frames, calibration: Calibration) -> Told:
    """Find the people in the frames and score them."""
    people = find_people(frames, calibration)
    whose = {
        one.camera: {
            (stamp, body.number): body.who
            for stamp, bodies in zip(one.device_time_ns.tolist(), one.bodies, strict=True)
            for body in bodies
        }
        for one in seen
    }
    from_s = together.calibration_s
    count, wrong, found, switches = 0, 0, 0, 0
    total = sum(
        len(bodies) for one in seen for t, bodies in zip(one.taken_s, one.bodies, strict=True) if t >= from_s
    )
    for performer in people.performers:
        marks = sorted(
            (calibration.cameras[name].clock.stage_ns(frame.device_time_ns) * 1e-9,
             whose[name][(frame.device_time_ns, frame.body)])
            for name, mine in performer.frames.items() for frame in mine
        )  # fmt: skip
        times, who = np.array([mark[0] for mark in marks]), np.array([mark[1] for mark in marks])
        who, times = who[times >= from_s], times[times >= from_s]
        if len(who) == 0:
            continue
        count += 1
        own = np.bincount(who).argmax()
        found += len(who)
        wrong += int((who != own).sum())
        # the majority over a quarter of a second
        steps = np.arange(times[0], times[-1], 0.1)
        near = [who[(times >= t - 0.125) & (times < t + 0.125)] for t in steps]
        major = np.array([np.bincount(part).argmax() for part in near if len(part)])
        switches += int(np.count_nonzero(np.diff(major)))
    return Told(people, count, switches, wrong / max(found, 1), 1.0 - found / max(total, 1))


def take_of(number: int, performers: int, data: Path) -> tuple[list[str | Path], str]:
    """The motions of a take's performers, and how they meet."""
    motions: list[str | Path] = [*sorted((data / "mocap").glob("*.bvh")), "demo"]
    first, way = divmod(number % TAKES, len(WAYS))
    return [motions[(first + k * (way + 1)) % len(motions)] for k in range(performers)], WAYS[way]


def main() -> None:
    """Print how often performers changed in each take, and in how many takes nobody did."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.crowd_people", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--step", type=int, default=1, help="score every so many of the 50 takes")
    parser.add_argument("--performers", type=int, default=2)
    parser.add_argument("--cameras", type=int, default=3)
    parser.add_argument(
        "--seed", type=int, default=3000, help="of the first take; that of the next is one more"
    )
    chosen = parser.parse_args()
    numbers, right = range(0, TAKES, chosen.step), 0
    for number in numbers:
        motions, way = take_of(number, chosen.performers, chosen.data)
        found = told(*crowd_of(motions, way, chosen.cameras, chosen.seed + number))
        right += found.right(chosen.performers)
        print(
            f"{number} {' '.join(Path(path).stem for path in motions)}, {way}: {found.performers} performers, "
            f"{found.switches} switches, {100 * found.wrong:.2f} % wrong, {100 * found.missed:.2f} % missed",
            flush=True,
        )
    print(f"{right} of {len(numbers)} with everybody themselves throughout")


if __name__ == "__main__":
    main()
