"""A take with solves for replay: the poses of tests.poses_factory, and a trace of two cameras."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from studio.api.takes.thumbnails import picture_of
from studio.engine.animation.clip.resample import frames_of
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.trace import STEP_M, Trace
from studio.review.render.thumbnail import SIZE_PX
from studio.take.folder.solves import Solved, write_performers, write_solve
from studio.take.folder.take import Take
from tests import poses_factory

FRAMES = 121


def add_picture(take: Take) -> None:
    """Give a take a picture, so that its server starts no process that draws one."""
    picture = picture_of(take.path)
    picture.parent.mkdir(exist_ok=True)
    Image.new("RGB", (SIZE_PX, SIZE_PX), "grey").save(picture)


def take_with_solves(path: Path, *, seed: int = 0, picture: bool = True) -> Take:
    """Make a take of two seconds at 60 Hz with the solves `studio`, which has a trace, and `live`, which has none."""
    take = Take.create(path, session=path.parent.name, name=path.name, source="import")
    take.meta["recording"] = "done"
    take.save_meta()
    poses = poses_factory.random_poses(np.random.default_rng(seed), seconds=2.0)
    joints = poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX]
    steps = np.rint(joints / STEP_M).astype(np.int16)
    used = np.ones((FRAMES, 2, 21), dtype=bool)
    reason = np.zeros((FRAMES, 2, 21), dtype=np.uint8)
    used[10:20, 1], reason[10:20, 1] = False, 1
    trace = Trace(
        time_ns=np.rint(poses.time_s * 1e9).astype(np.int64),
        cameras=("left", "right"),
        reasons=("", "spike"),
        camera_half_mm=np.stack([steps, steps], axis=1),
        fused_half_mm=steps,
        confidence=np.full((FRAMES, 21), 255, dtype=np.uint8),
        used=used,
        reason=reason,
    )
    for name, kept in (("studio", trace), ("live", None)):
        write_solve(take, name, settings=preset("studio"), poses=poses, metrics={}, trace=kept)
    if picture:
        add_picture(take)
    return take


LATE_S = 0.5
"""So much later comes the second of two."""

DOUBT_S = (1.0, 1.25)
"""When the second of two is not told apart from the first, from the first's beginning [s]."""


def take_of_two(path: Path, *, solves: tuple[str, ...] = ("studio",)) -> Take:
    """Make a take with solves of two performers at 60 Hz: one is there for two seconds, the other, beside them, comes
    later and leaves with them."""
    take = Take.create(path, session=path.parent.name, name=path.name, source="import")
    take.meta["recording"] = "done"
    take.save_meta()
    first, second = (poses_factory.random_poses(np.random.default_rng(k), seconds=2.0) for k in range(2))
    late = round(LATE_S * 60)
    second = frames_of(second, slice(late, None))
    second = replace(second, positions_m=second.positions_m + np.array([1.2, 0.0, 0.0]))
    begin, end = (first.begins_s + part for part in DOUBT_S)
    performers = {
        "performer_1": Solved(first, {"frames": first.frame_count, "undecided_s": []}),
        "performer_2": Solved(second, {"frames": second.frame_count, "undecided_s": [[begin, end]]}),
    }
    for name in solves:
        write_performers(take, name, settings=preset("studio"), performers=performers, metrics={})
    add_picture(take)
    return take
