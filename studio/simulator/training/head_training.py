"""Training of the head's networks: `python -m studio.simulator.training.head_training CLIP.bvh ... [--out FILE]`.

Clips and performers are those of `hand_training`. Cameras stand all round; heads turn far.
"""

from collections.abc import Iterable

import numpy as np

from studio.engine.model.joints import INDEX
from studio.engine.seeing.head import WEIGHTS, head_window
from studio.engine.seeing.images.convolution import Committee
from studio.simulator.training.convolution_training import Lesson, Samples, of_distance, train_convolution
from studio.simulator.training.hand_training import arguments, read_clips
from studio.simulator.training.training_views import TrainingView, training_views

JOINT_NOISE_M = 0.03
_NETWORKS = 2
_ASIDE_DEG = 120.0

_MIRROR = np.array([-1, 1, 1, -1, 1, 1], np.float32)
"""A head is symmetric; mirroring negates the sideways components."""

LESSON = Lesson(of_distance, _MIRROR, (16, 32), hidden=128, epochs=30, dropout=0.1, decay=5e-3)


def head_samples(views: Iterable[TrainingView], rng: np.random.Generator) -> Samples:
    """Return windows of heads, placed with a tracker's errors, and face and crown directions relative to the ray."""
    windows, about, targets = [], [], []
    for view in views:
        if view.what != "head":
            continue
        place = view.joints[INDEX["head"]] + rng.normal(0, JOINT_NOISE_M, 3)
        window = head_window(view.camera, view.depth_mm, place)
        if window is not None:
            R_window_head = window.R_camera_window.T @ view.R_camera_head
            windows.append(window.samples)
            about.append(window.about)
            targets.append(np.concatenate([-R_window_head[:, 1], R_window_head[:, 2]]))
    return Samples(np.array(windows), np.array(about), np.array(targets, np.float32))


def main() -> None:
    """Make views, train several networks, and write them."""
    args = arguments(__doc__ or "", WEIGHTS)
    rng = np.random.default_rng(args.seed)
    views = training_views(
        read_clips(args.clips), args.performers, args.poses, rng, ("head",), aside_deg=_ASIDE_DEG
    )
    samples = head_samples(views, rng)
    networks = [train_convolution(samples, LESSON, rng) for _ in range(_NETWORKS)]
    Committee(tuple(networks)).save(args.out)


if __name__ == "__main__":
    main()
