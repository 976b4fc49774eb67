"""Makes this process ready, solves more of the performer, then follows simulated ordinary cameras that see hands.

Prints as JSON how many frames were solved, in how many hands are seen, and what was compiled before and after each.
"""

import json
import sys
from dataclasses import replace

from studio import wire
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.take import solve_frames
from studio.offline import warming
from studio.simulator.demo import make_stage
from studio.simulator.landmarks.seen import see_landmarks
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig
from studio.take.raw.records import camera_frame

_FRAMES = 240


def compiled() -> dict[str, int]:
    """Return the compiled functions of the studio, with their numbers of signatures."""
    return {
        f"{name}.{key}": len(value.signatures)
        for name, module in sorted(sys.modules.items())
        if name.startswith("studio.")
        for key, value in vars(module).items()
        if getattr(value, "signatures", None)
    }


def solve_more() -> int:
    """Make ready once more, with more of the performer; return the number of frames that were solved."""
    solved, real = [0], warming.solve_frames

    def counted(frames, *args, **options):
        solved[0] += len(frames)
        return real(frames, *args, **options)

    warming.solve_frames, warming.SECONDS = counted, 1.5
    warming.prepare()
    warming.solve_frames = real
    return solved[0]


def main() -> None:
    """Make ready, solve more, follow, print."""
    warming.prepare()
    told: dict[str, object] = {"before": compiled(), "solved": solve_more(), "after_more": compiled()}
    motion, _ = stage_motion("demo", calibration=False)
    motion = replace(motion, positions_m=motion.positions_m[:_FRAMES])
    frames, cameras, rig = [], {}, standard_rig(3)
    for placed, seen in zip(rig, see_landmarks(motion, rig, seed=3), strict=True):
        cameras[seen.camera] = CameraCalibration(placed.T_stage_camera, lens=seen.lens)
        for k, (time_s, one) in enumerate(zip(seen.taken_s.tolist(), seen.pictures, strict=True)):
            if one is not None:
                size = seen.lens.width, seen.lens.height
                arrays = wire.LandmarkArrays(*size, one.pixels, one.world_m, one.hand(0), one.hand(1))
                message = wire.landmark_frame(k, round(time_s * 1e9), arrays, one.visibility)
                frames.append(camera_frame(seen.camera, "mediapipe", message))
    frames.sort(key=lambda frame: frame.device_time_ns)
    calibration = Calibration(rig[0].name, cameras, make_stage(0.1).performer)
    solve_frames(frames, calibration, preset("studio"))
    with_hands = sum(frame.picture is not None and frame.picture.hands is not None for frame in frames)
    print(json.dumps(told | {"with_hands": with_hands, "after_hands": compiled()}))


if __name__ == "__main__":
    main()
