"""Training of the hand states' networks.

`python -m studio.simulator.training.hand_training CLIP.bvh ... [--out FILE]` runs it.

The networks in the repository were made from the CMU clips 02_01, 02_03, 02_04, 05_06 and 14_08 and the embedded
performance. The clips 02_05, 49_01, 49_02 and 49_04 and the simulator's performers for scoring were not used.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.model.joints import INDEX
from studio.engine.seeing.hands.shape import WEIGHTS
from studio.engine.seeing.hands.window import hand_window
from studio.engine.seeing.images.convolution import Committee
from studio.simulator.body.performers import TUNING
from studio.simulator.motion import DEMO
from studio.simulator.performer.motion import read_performance
from studio.simulator.training.convolution_training import Lesson, Samples, of_log_odds, train_convolution
from studio.simulator.training.training_views import TrainingView, training_views

JOINT_NOISE_M = (0.024, 0.045)
"""SD of the tracker's wrist and elbow errors per axis, for an adult: usual, and with bad tracking."""

_BADLY = 0.3
"""Share of samples with bad tracking."""

_NETWORKS = 2
_TIMES = 3
_FOREARM_M = 0.25

LESSON = Lesson(of_log_odds, np.ones(1, np.float32), (12, 24), hidden=48, epochs=8, dropout=0.3, decay=2e-2)
"""Mirroring keeps the openness, because palm and back of a hand look alike in depth."""


def hand_samples(views: Iterable[TrainingView], rng: np.random.Generator) -> Samples:
    """Return windows of hands, placed with a tracker's errors, and the openness of the hands."""
    windows, about, targets = [], [], []
    for view in views:
        if view.what == "head":
            continue
        wrist, elbow = (view.joints[INDEX[f"{view.what}_{joint}"]] for joint in ("wrist", "elbow"))
        forearm_m = float(np.linalg.norm(wrist - elbow))
        for _ in range(_TIMES):
            noise_m = JOINT_NOISE_M[int(rng.random() < _BADLY)] * min(forearm_m / _FOREARM_M, 1.2)
            window = hand_window(
                view.camera,
                view.depth_mm,
                wrist + rng.normal(0, noise_m, 3),
                elbow + rng.normal(0, noise_m, 3),
                forearm_m * rng.normal(1.0, 0.05),
                mirrored=view.what == "right",
            )
            if window is not None:
                windows.append(window.samples)
                about.append(window.about)
                targets.append([min(max(2.0 * view.openness - 0.5, 0.0), 1.0)])
    return Samples(np.array(windows), np.array(about), np.array(targets, np.float32))


def read_clips(paths: list[str]) -> tuple[CanonicalMotion, ...]:
    """Return the motions of BVH files and of the embedded performance.

    Raises:
        FormatError: a file that is not a BVH.
    """
    return tuple(read_performance(path, TUNING[0], calibration=False).motion for path in (*paths, DEMO))


def arguments(text: str, out: Path) -> argparse.Namespace:
    """Return the command line arguments: clips, performers, poses, seed and out."""
    parser = argparse.ArgumentParser(description=text)
    parser.add_argument("clips", nargs="*", help="BVH files whose poses are used")
    parser.add_argument("--performers", type=int, default=240)
    parser.add_argument("--poses", type=int, default=60)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--out", type=Path, default=out)
    return parser.parse_args()


def main() -> None:
    """Make views, train several networks, and write them."""
    args = arguments(__doc__ or "", WEIGHTS)
    rng = np.random.default_rng(args.seed)
    views = training_views(read_clips(args.clips), args.performers, args.poses, rng, ("left", "right"))
    samples = hand_samples(views, rng)
    networks = [train_convolution(samples, LESSON, rng) for _ in range(_NETWORKS)]
    Committee(tuple(networks)).save(args.out)


if __name__ == "__main__":
    main()
