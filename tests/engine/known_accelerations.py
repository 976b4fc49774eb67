"""What finishing could reach in white noise if it knew each degree of freedom's acceleration: a limit, not a method.

python -m tests.engine.known_accelerations [--data FOLDER]

The acceleration prior needs the size of each degree of freedom's acceleration, which finishing has to guess from
noisy joints. Here it is taken from the same motion finished without noise: the root mean square around every frame,
per degree of freedom, times a factor, since accelerations are correlated from frame to frame. The best of several
factors counts. RMS over 21 joints [cm] and error of acceleration [m/s2], measured as in `white_noise`.
"""

import argparse
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.base.geometry import matrices
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take import finisher
from studio.engine.whole_take.finish.smoother import Smoother
from studio.engine.whole_take.finish.trajectory import steps
from studio.engine.whole_take.take import solve_frames
from tests.engine.white_noise import Figures, figures, noisy_take

MOTIONS = ("02_05", "14_08", "49_02")
"""Motions; 05_06 is left out, since its true joints jump as no human's do (`white_noise_parts`)."""

AROUND_S, FACTORS = 0.15, (5.0, 8.0, 12.0)
LEAST_SHARE = 0.2
"""Least deviation while a degree of freedom hardly moves, as a share of its root mean square over the take."""


@contextmanager
def known(deviation: NDArray[np.float64]) -> Iterator[None]:
    """Make finishing use these deviations of accelerations [rad or m per frame2], shape (frame_count - 2, nv)."""
    usual, window = Smoother._acceleration_stiffness, finisher.WINDOW
    Smoother._acceleration_stiffness = lambda self, acceleration: 1.0 / deviation**2
    finisher.WINDOW = 1_000_000
    try:
        yield
    finally:
        Smoother._acceleration_stiffness, finisher.WINDOW = usual, window


def deviations(bvh: Path) -> NDArray[np.float64]:
    """Return the size of each degree of freedom's acceleration around each frame [rad or m per frame2]."""
    frames, calibration, _ = noisy_take(bvh, noise=False)
    poses = solve_frames(frames, calibration, parse_settings("finish", ()))
    assert calibration.performer is not None
    humanoid = build_humanoid(Skeleton.of(calibration.performer))
    turns = matrices(poses.rotations_wxyz)
    q = np.stack([configuration_of(humanoid, *of) for of in zip(poses.positions_m[:, 0], turns, strict=True)])
    squared = np.diff(steps(q), axis=0) ** 2
    frame_s = float(np.median(np.diff(poses.time_s)))
    around = gaussian_filter1d(squared, AROUND_S / frame_s, axis=0, mode="nearest")
    return np.sqrt(np.maximum(around, LEAST_SHARE**2 * squared.mean(axis=0)) + 1e-14)


def limit(bvh: Path) -> tuple[Figures, Figures]:
    """Return the figures of finishing, and the best ones with known accelerations."""
    frames, calibration, truth = noisy_take(bvh)
    settings = parse_settings("finish", ())
    usual = figures(solve_frames(frames, calibration, settings), truth)
    deviation, found = deviations(bvh), []
    for factor in FACTORS:
        with known(factor * deviation):
            found.append(figures(solve_frames(frames, calibration, settings), truth))
    return usual, min(found, key=lambda one: one.rms_cm)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m tests.engine.known_accelerations", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    folder = parser.parse_args().data / "mocap"
    for motion in MOTIONS:
        usual, best = limit(folder / f"{motion}.bvh")
        print(
            f"{motion}: finished {usual.rms_cm:.2f} cm, {usual.acceleration_error_m_s2:.1f} m/s2; "
            f"accelerations known {best.rms_cm:.2f} cm, {best.acceleration_error_m_s2:.1f} m/s2",
            flush=True,
        )


if __name__ == "__main__":
    main()
