"""Training of the head's network: `python -m studio.camera.simulator.head_training CLIP.bvh ... [--out FILE]`.

Clips and performers are those of `hand_training`.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from studio.camera.simulator.hand_training import arguments, read_clips
from studio.camera.simulator.network_training import train
from studio.camera.simulator.training_views import TrainingView, training_views
from studio.engine.head import SIDE, WEIGHTS, along_ray, head_window
from studio.engine.joints import INDEX

Array32 = NDArray[np.float32]

JOINT_NOISE_M = 0.025
_TIMES = 3


def head_samples(views: Iterable[TrainingView], rng: np.random.Generator) -> tuple[Array32, Array32]:
    """Return inputs, shape (n, inputs), and where face and crown point along the ray, shape (n, 6)."""
    inputs, targets = [], []
    for view in views:
        if view.what != "head":
            continue
        for _ in range(_TIMES):
            place = view.joints[INDEX["head"]] + rng.normal(0, JOINT_NOISE_M, 3)
            values = head_window(view.camera, view.depth_mm, place)
            if values is not None:
                R_ray_head = along_ray(place).T @ view.R_camera_head
                inputs.append(values)
                targets.append(np.concatenate([-R_ray_head[:, 1], R_ray_head[:, 2]]))
    return np.array(inputs, np.float32), np.array(targets, np.float32)


def mirrored(inputs: Array32, targets: Array32) -> tuple[Array32, Array32]:
    """Return the samples of the mirror images: a head is alike on both sides."""
    flipped, turned = inputs.copy(), targets.copy()
    for part in range(2):
        of = slice(part * SIDE * SIDE, (part + 1) * SIDE * SIDE)
        flipped[:, of] = inputs[:, of].reshape(-1, SIDE, SIDE)[:, :, ::-1].reshape(len(inputs), -1)
    turned[:, [0, 3]] *= -1
    return flipped, turned


def _slope(outputs: Array32, targets: Array32) -> Array32:
    """Derivative of the squared distance."""
    return 2 * (outputs - targets)


def main() -> None:
    """Make views, train, and write the weights."""
    args = arguments(__doc__ or "", WEIGHTS)
    rng = np.random.default_rng(args.seed)
    views = training_views(read_clips(args.clips), args.performers, args.poses, rng, ("head",))
    inputs, targets = head_samples(views, rng)
    both = [np.concatenate(pair) for pair in zip((inputs, targets), mirrored(inputs, targets), strict=True)]
    train(both[0], both[1], (256, 64), _slope, rng, epochs=14, dropout=0.15, decay=2e-2).save(args.out)


if __name__ == "__main__":
    main()
