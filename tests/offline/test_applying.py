"""Which suggested edits are kept: those that mend and move no limb away from where the cameras saw it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.clip.resample import frames_of
from studio.engine.edits.edit import Edit, LeaveOutEdit
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.whole_take.trace import STEP_M, Trace
from studio.offline.edits.applying import apply_offers
from studio.offline.edits.offers import Offer, offers
from tests import poses_factory

WRIST, POP, POP_M = OUTPUT_OF_CANONICAL_INDEX[INDEX["left_wrist"]], 60, 0.09
ARM = [OUTPUT_OF_CANONICAL_INDEX[INDEX[f"left_{name}"]] for name in ("shoulder", "elbow", "wrist", "hand")]
KNEE, ANKLE, TOE = (OUTPUT_OF_CANONICAL_INDEX[INDEX[f"right_{name}"]] for name in ("knee", "ankle", "toe"))
NEAR = slice(POP - 20, POP + 21)


@pytest.fixture
def still() -> Poses:
    poses = poses_factory.random_poses(np.random.default_rng(0), seconds=2.0)
    return replace(frames_of(poses, np.zeros(poses.frame_count, dtype=np.int64)), time_s=poses.time_s)


@pytest.fixture
def popping(still: Poses) -> Poses:
    positions = still.positions_m.copy()
    positions[POP, WRIST, 0] += POP_M
    return replace(still, positions_m=positions)


def seen(poses: Poses) -> Trace:
    """Two cameras that see the joints of poses."""
    steps = np.rint(poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX] / STEP_M).astype(np.int16)
    count = (poses.frame_count, 2, 21)
    return Trace(
        time_ns=np.rint(poses.time_s * 1e9).astype(np.int64),
        cameras=("left", "right"),
        reasons=("",),
        camera_half_mm=np.stack([steps, steps], axis=1),
        fused_half_mm=steps,
        confidence=np.full((poses.frame_count, 21), 255, dtype=np.uint8),
        used=np.ones(count, dtype=bool),
        reason=np.zeros(count, dtype=np.uint8),
    )


def pops(poses: Poses, trace: Trace) -> list[Offer]:
    return [one for one in offers(poses, trace) if one.event["kind"] == "joint_pop"]


def solving(poses: Poses, asked: list[list[Edit]]) -> Callable[[Sequence[Edit]], Poses]:
    def solve(edits: Sequence[Edit]) -> Poses:
        asked.append(list(edits))
        return poses

    return solve


def away(poses: Poses, metres: float) -> Poses:
    positions = poses.positions_m.copy()
    positions[NEAR, ARM, 1] += metres
    return replace(poses, positions_m=positions)


def test_what_removes_an_event_where_the_cameras_saw_the_arm_is_kept(still: Poses, popping: Poses) -> None:
    found = pops(popping, seen(still))
    assert len(found) == 1
    kept, after = apply_offers(found, popping, seen(still), solving(still, []))
    assert kept == [found[0].edits[0]] and after is still


def test_what_removes_an_event_by_taking_the_arm_away_from_the_cameras_is_not(
    still: Poses, popping: Poses
) -> None:
    found, asked = pops(popping, seen(still)), list[list[Edit]]()
    kept, after = apply_offers(found, popping, seen(still), solving(away(still, 0.04), asked))
    assert not kept and after is popping
    assert asked == [[edit] for edit in found[0].edits]  # each was tried


def test_a_camera_that_is_left_out_says_nothing_against_it(still: Poses, popping: Poses) -> None:
    wrong = seen(away(still, -0.04))
    (one,) = pops(popping, wrong)
    edit = one.edits[0]
    both = [
        LeaveOutEdit(
            id=name, camera=name, joints=("left_shoulder", "left_elbow", "left_wrist", "left_hand"),
            start_s=edit.start_s, end_s=edit.end_s,
        )
        for name in ("left", None)
    ]  # fmt: skip
    for leave_out, mends in zip(both, (False, True), strict=True):
        found = [replace(one, edits=(leave_out,))]
        kept, _ = apply_offers(found, away(popping, -0.04), wrong, solving(still, []))
        assert bool(kept) == mends


def test_an_event_that_another_edit_removed_has_no_edit_of_its_own(still: Poses, popping: Poses) -> None:
    positions = popping.positions_m.copy()
    positions[POP + 30, KNEE, 0] += POP_M
    twice = replace(popping, positions_m=positions)
    found = pops(twice, seen(still))
    assert len(found) == 2
    found = [replace(found[0], edits=()), found[1]]
    (kept,), _ = apply_offers(found, twice, seen(still), solving(still, []))
    assert kept == found[1].edits[0]


def test_a_foot_below_the_floor_is_not_offered_the_same_twice(still: Poses) -> None:
    positions = still.positions_m.copy()
    positions[40:60, ANKLE, 2] = positions[40:60, TOE, 2] = -0.1
    found = offers(replace(still, positions_m=positions), seen(still))
    assert "floor_penetration" in [one.event["kind"] for one in found]
    for one in found:
        assert len(one.edits) == len({repr(edit) for edit in one.edits})
