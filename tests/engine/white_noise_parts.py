"""The parts of a finished take's error in white noise: body, ranges, smoothing, noise.

python -m tests.engine.white_noise_parts [--data FOLDER]

Per motion, RMS over 21 joints [cm]:

- `body`: the true joints, each frame on its own, by a body without ranges: what its build cannot reach;
- `ranges`: the same within human ranges;
- `no noise`: the true joints finished: includes smoothing and standing feet;
- `finished`: the same with white noise, spikes and drop-outs;
- `near jumps`: how many frames lie within 0.1 s of an impossible motion of a true joint (over 1000 m/s2 at 120 Hz);
- `elsewhere`: `finished` without them.
"""

import argparse
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import matrices
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.finish.trajectory import Kinematics, moved
from studio.engine.whole_take.take import solve_frames
from tests.engine.white_noise import MOTIONS, SETTLED_FRAMES, noisy_take

JUMP_M_S2 = 1000.0
NEAR_S = 0.1
STEPS, LONGEST_STEP = 60, 0.3
REST_RAD = 1e-4
BEYOND = 100.0
"""Weight relative to metres: of the usual posture, so that twists are defined, and of the excess beyond a range."""


def off_m(joints: NDArray[np.float64], true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far joints are off [m], shape (frame_count, 21), without the first second."""
    return np.linalg.norm(joints - true, axis=2)[SETTLED_FRAMES:]


def rms_cm(off: NDArray[np.float64]) -> float:
    """Return the root mean square [cm]."""
    return float(100.0 * np.sqrt((off**2).mean()))


def fitted(
    humanoid: Humanoid, poses: Poses, true: NDArray[np.float64], *, limited: bool
) -> NDArray[np.float64]:
    """Return joints of the body fitted to true joints from a solve's poses, frame by frame [m], shape
    (frame_count, 21, 3), by steps of Levenberg and Marquardt on all frames in parallel."""
    kinematics, (low, high) = Kinematics(humanoid), humanoid.range_rad.T
    turns = matrices(poses.rotations_wxyz)
    q = np.stack(
        [
            configuration_of(humanoid, hips, turn)
            for hips, turn in zip(poses.positions_m[:, 0], turns, strict=True)
        ]
    )
    damping = np.full(len(q), 1e-5)
    k, hinges = np.arange(q.shape[1] - 1), np.arange(FREE_DOFS, q.shape[1] - 1)

    def beyond(q: NDArray[np.float64]) -> NDArray[np.float64]:
        return (q[:, 7:] - np.clip(q[:, 7:], low, high)) * limited

    def cost(q: NDArray[np.float64]) -> NDArray[np.float64]:
        posture = REST_RAD**2 * ((q[:, 7:] - humanoid.rest_q) ** 2).sum(axis=1)
        return (
            ((true - kinematics.sites(q)) ** 2).sum(axis=(1, 2))
            + posture
            + BEYOND * (beyond(q) ** 2).sum(axis=1)
        )

    best = cost(q)
    for _ in range(STEPS):
        sites, jacobians = kinematics.linearised(q)
        normal = np.matmul(jacobians.transpose(0, 2, 1), jacobians)
        right = np.einsum("fij,fi->fj", jacobians, (true - sites).reshape(len(q), -1))
        out = beyond(q)
        normal[:, hinges, hinges] += REST_RAD**2 + BEYOND * (out != 0.0)
        right[:, FREE_DOFS:] -= REST_RAD**2 * (q[:, 7:] - humanoid.rest_q) + BEYOND * out
        normal[:, k, k] += 1e-9 + damping[:, None]
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        tried = moved(q, np.clip(step, -LONGEST_STEP, LONGEST_STEP))
        found = cost(tried)
        better = found < best
        q[better], best = tried[better], np.where(better, found, best)
        damping = np.clip(np.where(better, 0.3 * damping, 4.0 * damping), 1e-9, 10.0)
    return kinematics.sites(q)


def near_jumps(motion: CanonicalMotion, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which instants are near an impossible motion of a joint, shape (count,)."""
    bend = np.diff(motion.positions_m, n=2, axis=0) / motion.frame_s**2
    jumps_s = (1 + np.flatnonzero((np.linalg.norm(bend, axis=2) > JUMP_M_S2).any(axis=1))) * motion.frame_s
    return (np.abs(time_s[:, None] - jumps_s) <= NEAR_S).any(axis=1)


def parts(bvh: Path, *, seconds: float = 15.0) -> dict[str, float]:
    """Return a motion's row: RMS by part [cm], and the share of frames near jumps."""
    out: dict[str, float] = {}
    settings = parse_settings("finish", ())
    for name, noise in (("no noise", False), ("finished", True)):
        frames, calibration, motion = noisy_take(bvh, seconds=seconds, noise=noise)
        poses = solve_frames(frames, calibration, settings)
        true = np.stack([motion.at(t) for t in poses.time_s])
        off = off_m(poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX], true)
        if not noise:
            assert calibration.performer is not None
            humanoid = build_humanoid(Skeleton.of(calibration.performer))
            for part, limited in (("body", False), ("ranges", True)):
                out[part] = rms_cm(off_m(fitted(humanoid, poses, true, limited=limited), true))
        out[name] = rms_cm(off)
    near = near_jumps(motion, poses.time_s[SETTLED_FRAMES:])
    return out | {"near jumps": float(near.mean()), "elsewhere": rms_cm(off[~near])}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.engine.white_noise_parts", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    for motion in MOTIONS:
        row = parts(parser.parse_args().data / "mocap" / f"{motion}.bvh")
        print(motion, "  ".join(f"{name} {value:.2f}" for name, value in row.items()), flush=True)


if __name__ == "__main__":
    main()
