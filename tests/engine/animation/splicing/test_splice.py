"""Walks are spliced at any place: feet do not slide, velocity does not jump, and nobody turns around."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.foot_lock import feet_of
from studio.engine.animation.clip.resample import frames_of, resampled
from studio.engine.animation.read.imported import imported_poses
from studio.engine.animation.splicing.retime import retimed
from studio.engine.animation.splicing.splice import Part, Spliced, spliced
from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import multiply, rotate
from studio.engine.edits.edit import RetimeEdit
from studio.engine.edits.time_map import TimeMap
from studio.engine.metrics.figures.feet import stance_of
from studio.engine.model.poses import Poses
from studio.offline.edits.take_parts import BLEND_S, NEAR_S

CMU_M = 0.056444
RATE_HZ = 60


@pytest.fixture(scope="module")
def walks(test_data: Path) -> list[Poses]:
    """Two walks of two people of the same size; the first frames are a T-pose."""
    files = [test_data / "mocap" / f"{name}.bvh" for name in ("02_01", "49_01")]
    poses = [imported_poses(file, unit_m=CMU_M, progress=lambda share: None)[0] for file in files]
    return [frames_of(resampled(one, RATE_HZ)[0], slice(3, None)) for one in poses]


def slide_cm_s(poses: Poses, rows: slice = slice(None)) -> float:
    """Mean speed of standing feet over the floor, with the stances of `foot_slides_cm_s`."""
    feet = feet_of(poses)
    speed = np.linalg.norm(np.gradient(feet, 1 / RATE_HZ, axis=0)[..., :2], axis=2)
    stands = stance_of(feet, poses.time_s)[rows]
    return float(100 * speed[rows][stands].mean()) if stands.any() else 0.0


def jump_m_s(poses: Poses, rows: slice = slice(None)) -> float:
    """99th percentile of the change of joint velocities from frame to frame."""
    changes = RATE_HZ * np.diff(poses.positions_m[rows], n=2, axis=0)
    return float(np.percentile(np.linalg.norm(changes, axis=2), 99))


def bars(first: Poses, second: Poses, made: Spliced) -> tuple[float, float]:
    """How much more feet slide in the seam than in the parts [cm/s], and the jump of velocity in the seam relative to
    the largest in the parts: over a whole part, or over its blended frames."""
    ((begin_s, end_s),) = made.seams_s
    rows = slice(int(begin_s * RATE_HZ) - 2, int(end_s * RATE_HZ) + 2)
    count = rows.stop - rows.start
    last = np.searchsorted(first.time_s, made.spans_s[0][1]) + 2
    start = max(np.searchsorted(second.time_s, made.spans_s[1][0]) - 2, 0)
    own = [jump_m_s(first), jump_m_s(second), jump_m_s(first, slice(max(last - count, 0), last))]
    own.append(jump_m_s(second, slice(start, start + count)))
    more = slide_cm_s(made.poses, rows) - max(slide_cm_s(first), slide_cm_s(second))
    return more, jump_m_s(made.poses, rows) / max(own)


@pytest.mark.parametrize("places", [3, pytest.param(20, marks=pytest.mark.long)])
@pytest.mark.parametrize("pair", [(0, 0), (1, 1), (0, 1), (1, 0)])
def test_walks_are_spliced_at_any_place(walks, pair, places):
    first, second = (walks[k] for k in pair)
    rng = np.random.default_rng(0)
    for _ in range(places):
        end_s = rng.uniform(first.time_s[0] + 1.2, first.time_s[-1])
        start_s = rng.uniform(second.time_s[0], second.time_s[-1] - 1.2)
        parts = [Part(first, None, end_s), Part(second, start_s, None)]
        made = spliced(parts, blend_s=BLEND_S, near_s=NEAR_S)
        slides, jumps = bars(first, second, made)
        assert slides < 1.0 and jumps < 1.0
        bones = np.linalg.norm(np.diff(made.poses.positions_m[:, [2, 3, 4]], axis=1), axis=2)
        assert np.ptp(bones, axis=0).max() < 1e-6


def test_the_second_part_goes_on_where_the_first_ends_and_a_loop_goes_on(walks):
    walk = walks[1]
    turn = np.array([np.cos(0.9), 0.0, 0.0, np.sin(0.9)])  # by 103 degrees, elsewhere
    quaternions = np.broadcast_to(turn, walk.rotations_wxyz.shape)
    turned = replace(
        walk,
        positions_m=np.add(rotate(quaternions, walk.positions_m), [3.0, 1.0, 0.0]),
        rotations_wxyz=multiply(quaternions, walk.rotations_wxyz),
    )
    parts = [Part(walk, None, 3.0), Part(turned, 3.0 - BLEND_S + 1.0 / RATE_HZ, None)]
    made = spliced(parts, blend_s=BLEND_S, near_s=0.0).poses
    np.testing.assert_allclose(
        made.positions_m, walk.positions_m[: made.frame_count], atol=5e-3
    )  # a step may be a little higher
    again = spliced([Part(walk, 1.0, 3.0)] * 3, blend_s=BLEND_S, near_s=NEAR_S)
    assert len(again.seams_s) == 2
    way = np.diff(again.poses.positions_m[[0, -1], 0, :2], axis=0)
    pace = np.linalg.norm(way) / again.poses.time_s[-1]
    assert pace == pytest.approx(
        np.linalg.norm(np.diff(walk.positions_m[[60, 180], 0, :2], axis=0)) / 2, rel=0.1
    )


def test_what_cannot_be_spliced_is_told(walks):
    walk = walks[0]
    big = replace(walk, positions_m=1.3 * walk.positions_m)
    other = replace(walk, joint_names=tuple(f"x{name}" for name in walk.joint_names))
    for parts, code in (
        ([], "splice.none"),
        ([Part(walk), Part(big)], "splice.body"),
        ([Part(walk, 0.0, 0.5), Part(walk)], "splice.short"),
        ([Part(walk, 9.0, None), Part(walk)], "splice.outside"),
        ([Part(walk), Part(other)], "splice.joints"),
    ):
        with pytest.raises(SettingsError) as told:
            spliced(parts, blend_s=BLEND_S, near_s=NEAR_S)
        assert told.value.code == code


@pytest.mark.parametrize("factor", [0.5, 2.5])
def test_a_part_goes_slower_or_faster_and_feet_stay(walks, factor):
    walk = walks[1]
    times = TimeMap([RetimeEdit(id="a", start_s=2.0, end_s=3.0, ease_s=0.2, factor=factor)])
    np.testing.assert_allclose(times.stage_s(times.solve_s(walk.time_s)), walk.time_s, atol=1e-9)
    begin_s, end_s = times.solve_s([2.0, 3.0])
    assert end_s - begin_s == pytest.approx(factor, abs=1e-3)
    assert times.solve_s(1.0) == pytest.approx(1.0)
    found = retimed(walk, times)
    assert found.frames_per_second == pytest.approx(walk.frames_per_second)
    own = times.stage_s(found.time_s)
    feet = np.stack(
        [np.interp(own, walk.time_s, one) for one in feet_of(walk).reshape(walk.frame_count, -1).T], 1
    )
    np.testing.assert_allclose(feet_of(found).reshape(len(own), -1), feet, atol=1e-3)
    assert jump_m_s(found) < max(1.0, 1.0 / factor**2) * 1.05 * jump_m_s(walk)
