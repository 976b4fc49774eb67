"""`python -m tests.engine.seeing.tracker.hard_motions [--seeds N]`: motions that are hard for one camera.

A full turn, arms crossed, hands behind the back, a crouch, leaving the view and coming back, each by the scoring
performers in turn. Each run prints one line: the longest time in which the limbs were far off while the whole body
was in the image, and the number of frames with front and back confused. Each motion prints one line at the end.
"""

import argparse

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.joints import INDEX
from studio.engine.seeing.tracker.tracker import Tracker
from studio.simulator.body.performers import SCORING
from studio.simulator.performer.scenes import SCENES
from tests.engine.seeing.tracker.scenes import LIMBS, simulated

HZ = 30
OFF_M = 0.15
"""Limbs are far off where their mean error is larger; an unknown limb counts as this error."""

AGAIN_S = 1.0
BEGIN_S = 1.0
"""Allowed time for a start and for a recovery."""


def longest_s(off: NDArray[np.bool_]) -> float:
    """Length of the longest run of true values at 30 Hz [s]."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], off.astype(int), [0]])))
    return float((ends[1::2] - ends[::2]).max(initial=0) / HZ)


def run(name: str, seed: int) -> tuple[float, int, float]:
    """Return the longest time off [s], the number of frames with front and back confused, and the mean error [m]."""
    motion = SCENES[name]()
    performer = SCORING[seed % len(SCORING)]
    cameras, placed, sets, truth = simulated(
        motion, performer=performer, end_s=motion.duration_s, seed=100 + seed
    )
    (camera,) = cameras
    tracker = Tracker(cameras, placed)
    found = np.stack([tracker.track(frames).positions for frames in sets])
    error = np.nan_to_num(np.linalg.norm(found - truth, axis=2)[:, LIMBS], nan=OFF_M)
    seen = _in_image(cameras[camera], invert_transform(placed[camera]), truth)
    counted = seen & (np.arange(len(sets)) >= BEGIN_S * HZ)
    off = counted & (error.mean(axis=1) >= OFF_M)
    turned = np.cos(_heading(found) - _heading(truth)) < 0.0
    return longest_s(off), int((turned & counted).sum()), float(error[counted].mean())


def _in_image(camera, T_camera_stage, joints_m):
    """Whether the whole body is in the image, shape (frame_count,)."""
    points = transform_points(T_camera_stage, joints_m.reshape(-1, 3))
    u, v = camera.pixels_of(points).T
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height) & (points[:, 2] > 0)
    return inside.reshape(joints_m.shape[:2]).all(axis=1)


def _heading(joints_m):
    across = joints_m[:, INDEX["left_shoulder"]] - joints_m[:, INDEX["right_shoulder"]]
    return np.arctan2(across[:, 1], across[:, 0])


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    args = parser.parse_args()
    for name in SCENES:
        runs = [run(name, seed) for seed in range(args.seeds)]
        for seed, (off_s, turned, error_m) in enumerate(runs):
            print(
                f"{name} {seed}: {100 * error_m:.1f} cm, off {off_s:.1f} s, turned round {turned}", flush=True
            )
        within = sum(off_s <= AGAIN_S for off_s, _, _ in runs)
        round_ = sum(turned > 0 for _, turned, _ in runs)
        print(f"{name}: {within} of {len(runs)} within {AGAIN_S:g} s, {round_} turned round")


if __name__ == "__main__":
    main()
