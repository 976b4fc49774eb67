"""Zero-phase smoothing of whole poses: it removes noise without lag."""

from dataclasses import replace

from studio.engine.animation.clip.kinematics import Array, local_keys, world_poses
from studio.engine.animation.clip.resample import standard_rate
from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import normalized
from studio.engine.model.poses import Poses

_ORDER = 2
_FEWEST_FRAMES = 4


def smoothed(poses: Poses, cutoff_hz: float) -> Poses:
    """Return the poses with frequencies above the cutoff removed.

    Rotations and offsets local to the parents go through a Butterworth low-pass forwards and backwards, so that
    bones keep their lengths. At `cutoff_hz` half of an oscillation's amplitude is left.

    Args:
        poses: on a uniform grid.
        cutoff_hz: [Hz].

    Raises:
        SettingsError: the cutoff is not below half of the frame rate.
    """
    from scipy.signal import butter  # slow to load, and seldom used

    rate = standard_rate(poses.frames_per_second)
    if cutoff_hz >= rate / 2:
        raise SettingsError(
            "export.smooth_hz",
            "smooth-hz={hz:g}: allowed is a number below half of the take's {rate:g} frames a second",
            hz=cutoff_hz,
            rate=rate,
        )
    if poses.frame_count < _FEWEST_FRAMES:
        return poses
    sections = butter(_ORDER, cutoff_hz, fs=rate, output="sos")
    offsets, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    positions, rotations = world_poses(
        poses.parents, _filtered(offsets, sections), normalized(_filtered(local, sections))
    )
    return replace(poses, positions_m=positions, rotations_wxyz=rotations)


def _filtered(values: Array, sections: Array) -> Array:
    from scipy.signal import sosfiltfilt

    padding = min(3 * (2 * len(sections) + 1), len(values) - 1)
    return sosfiltfilt(sections, values, axis=0, padlen=padding)
