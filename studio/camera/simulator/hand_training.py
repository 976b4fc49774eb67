"""Training of the hand states' network: `python -m studio.camera.simulator.hand_training CLIP.bvh ... [--out FILE]`.

The network in the repository was made from the CMU clips 02_01, 02_03, 02_04, 05_06 and 14_08 and the embedded
performance; 02_05, 49_01, 49_02 and 49_04 are left for scoring, as are the simulator's performers for scoring.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.camera.simulator.depth.motion import read_performance
from studio.camera.simulator.depth.performers import TUNING
from studio.camera.simulator.network_training import joined, train
from studio.camera.simulator.simulate import DEMO
from studio.camera.simulator.training_views import TrainingView, training_views
from studio.engine.hands.shape import WEIGHTS, window_inputs
from studio.engine.hands.window import hand_window
from studio.engine.joints import INDEX
from studio.engine.motion.motion import CanonicalMotion

Array32 = NDArray[np.float32]

JOINT_NOISE_M = 0.026
"""How far the tracker's wrist and elbow are off, per axis, for an adult."""

_HIDDEN = (128, 128, 192, 192)
"""Sizes of the first layers of the networks that are joined."""

_TIMES = 2
_SMOOTHED = 0.02
_FOREARM_M = 0.25


def hand_samples(views: Iterable[TrainingView], rng: np.random.Generator) -> tuple[Array32, Array32]:
    """Return inputs, shape (n, inputs), and whether the hand is open, shape (n, 1), with a tracker's errors."""
    inputs, targets = [], []
    for view in views:
        if view.what == "head":
            continue
        wrist, elbow = (view.joints[INDEX[f"{view.what}_{joint}"]] for joint in ("wrist", "elbow"))
        forearm_m = float(np.linalg.norm(wrist - elbow))
        noise_m = JOINT_NOISE_M * min(forearm_m / _FOREARM_M, 1.2)
        for _ in range(_TIMES):
            window = hand_window(
                view.camera,
                view.depth_mm,
                wrist + rng.normal(0, noise_m, 3),
                elbow + rng.normal(0, noise_m, 3),
                forearm_m * rng.normal(1.0, 0.05),
                mirrored=view.what == "right",
            )
            if window is not None:
                inputs.append(window_inputs(window))
                targets.append([view.openness > 0.5])
    return np.array(inputs, np.float32), np.array(targets, np.float32)


def _slope(outputs: Array32, targets: Array32) -> Array32:
    """Derivative of the cross-entropy with smoothed targets."""
    return 1 / (1 + np.exp(-outputs)) - (targets * (1 - 2 * _SMOOTHED) + _SMOOTHED)


def read_clips(paths: list[str]) -> tuple[CanonicalMotion, ...]:
    """Return the motions of BVH files and of the embedded performance.

    Raises:
        FormatError: a file that is no BVH.
    """
    return tuple(read_performance(path, TUNING[0], calibration=False).motion for path in (*paths, DEMO))


def arguments(text: str, out: Path) -> argparse.Namespace:
    """Return the command line's arguments: clips, performers, poses, seed and out."""
    parser = argparse.ArgumentParser(description=text)
    parser.add_argument("clips", nargs="*", help="BVH files whose poses are used")
    parser.add_argument("--performers", type=int, default=240)
    parser.add_argument("--poses", type=int, default=60)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--out", type=Path, default=out)
    return parser.parse_args()


def main() -> None:
    """Make views, train several networks, and write them joined."""
    args = arguments(__doc__ or "", WEIGHTS)
    rng = np.random.default_rng(args.seed)
    views = training_views(read_clips(args.clips), args.performers, args.poses, rng, ("left", "right"))
    inputs, targets = hand_samples(views, rng)
    joined(
        [
            train(inputs, targets, (hidden, 32), _slope, rng, epochs=9, dropout=0.3, decay=2e-2)
            for hidden in _HIDDEN
        ]
    ).save(args.out)


if __name__ == "__main__":
    main()
