"""All stages in one run."""

from collections.abc import Callable
from statistics import median

from studio.engine.base.system import one_core
from studio.engine.whole_take.collect import collect_poses
from studio.lab.bench import stages
from studio.lab.bench.depth import depth_simulator, tracker
from studio.simulator.demo import make_stage
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND

TURNS = 5
TRACKED_CAMERAS = (1, 3)
MOST_IMAGES = 120
"""Maximum number of images rendered and tracked."""


def run_bench(
    frames: int, *, progress: Callable[[float], None] | None = None
) -> dict[str, stages.StageTiming]:
    """Return the timing of every stage by name, as in `bench --json`.

    Args:
        frames: output frames per stage.
        progress: receives the share done, 0..1.
    """
    tell = progress or (lambda _share: None)
    out: dict[str, stages.StageTiming] = {}
    with one_core():
        stage = make_stage(max(frames / stages.SETTINGS.output_hz, 20 / FRAMES_PER_SECOND))
        out["parse"], camera_frames = stages.parse(stage)
        out["record"] = stages.record(stage)
        out["sync"], sets = stages.sync(stage, camera_frames)
        tell(0.1)
        out["fusion"], fused = stages.fusion(sets)
        out["solve"] = stages.solve(stage, sets)
        tell(0.4)
        out["solve_mink"] = stages.solve_mink(stage, fused)
        out["mink_frame_tasks"] = stages.mink_frame_tasks(stage, fused)
        out["mink_retargeting"] = stages.retargeting_mink(stage, fused)
        tell(0.7)
        out["completion"] = stages.completion(stage, sets, fused)
        out |= stages.filters(fused)
        out["pipeline"], results = stages.pipeline(stage)
        out |= people(frames)
        out |= stages.sending(results)
        out["finish"] = stages.finish(stage)
        tell(0.9)
        out |= stages.exports(collect_poses(results))
        out["depth_simulator"] = depth_simulator(frames)
        for count in TRACKED_CAMERAS:
            out[f"tracker_{count}"] = tracker(min(frames, MOST_IMAGES), count)
    plain = out["mink_frame_tasks"]["median_ms"]
    for name in ("solve", "solve_mink", "mink_frame_tasks", "mink_retargeting"):
        out[name]["ratio_to_mink_frame_tasks"] = out[name]["median_ms"] / plain
    return out


def people(frames: int) -> dict[str, stages.StageTiming]:
    """Return the live pipeline's timing for one and two performers and four cameras, from the last of several turns.

    The ratio is the median over turns (one, then two) of the ratio of mean processor times, which load affects less.
    Means are used because every second frame has no new reading and takes half the time.
    """
    seconds = max(frames / stages.SETTINGS.output_hz, 20 / FRAMES_PER_SECOND)
    of = {count: make_stage(seconds, cameras=4, performers=count) for count in (1, 2)}
    turns = [
        {count: stages.people_pipeline(stage, count) for count, stage in of.items()} for _ in range(TURNS)
    ]
    ratios = [turn[2].get("cpu_mean_ms", 0.0) / turn[1].get("cpu_mean_ms", 1.0) for turn in turns]
    turns[-1][2]["ratio_to_one_performer"] = median(ratios)
    return {f"pipeline_{count}_of_4": timing for count, timing in turns[-1].items()}
