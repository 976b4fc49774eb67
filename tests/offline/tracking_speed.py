"""How long tracking a take's depth takes, on one core and on all, in turns: others may use the machine too.

    .venv/bin/python -m tests.offline.tracking_speed TAKE [PAIRS]

`per_camera`: each camera for itself, in one process or in one for each camera. `points`: all cameras together, images
looked at one by one or side by side, 60 instants.
"""

import statistics
import sys
import time
from collections.abc import Callable
from itertools import islice

from studio.engine.base import blas  # noqa: F401, as in every solve
from studio.engine.seeing.tracker import looking
from studio.engine.seeing.tracker.skeletons import from_points
from studio.offline.side_by_side import core_count, track_cameras
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthRecording

INSTANTS = 60


def took_s(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main(folder: str, pairs: str = "3") -> None:
    take = Take.open(folder)
    recording, calibration = DepthRecording(take.raw_path), take.calibration()
    cameras = {name: recording.cameras[name] for name in recording.cameras if name in calibration.cameras}
    clocks = {name: calibration.cameras[name].clock for name in cameras}
    images = list(islice(recording.frames(tuple(cameras), clocks=clocks), INSTANTS * len(cameras)))

    def apart(cores: int) -> object:
        return track_cameras(take, recording, tuple(cameras), processes=cores)

    def together(cores: int) -> object:
        looking._core_count = lambda: cores
        return list(from_points(images, cameras, calibration))

    together(1)
    for name, work in (("per_camera", apart), ("points", together)):
        ratios = []
        for _ in range(int(pairs)):
            one_s, all_s = took_s(lambda work=work: work(1)), took_s(lambda work=work: work(core_count()))
            ratios.append(all_s / one_s)
            print(
                f"{name:10} one {one_s:6.1f} s  {core_count()} cores {all_s:6.1f} s  {ratios[-1]:.2f}",
                flush=True,
            )
        print(f"{name:10} median {statistics.median(ratios):.2f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
