"""The thesis's four figures, on the wrists (elbows, shoulders) relative to the chest, with its constants fixed.

A curve is one axis of one joint of one side over time. The solve is aligned rigidly first, and the reference
is taken at the solve's instants. Source: Ménard, "Génération d'animations par capture de mouvements avec
multiples caméras 3D", École Polytechnique de Montréal 2014, sections 3.2.3 and 5.6.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from studio.engine.metrics.reference.matching import Matched
from studio.engine.metrics.results import ThesisFigures

SPIKE_M = 0.10
SPIKE_S = 4 / 30
DEVIATION_S = 0.2
DEVIATION_M_S2 = 1.0
LOW_PASS_HZ = 3.0

_AT_ONCE = 400_000

FIGURES: tuple[str, ...] = tuple(ThesisFigures.__annotations__)
"""Keys of the result of `figures`."""


def curves(matched: Matched, joint: str = "wrist") -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return a joint of both sides relative to the chest [m], solve and reference, each (side_count, frame_count, 3).

    Frames in which the reference lacks a side or the chest are left out. None without chest or joint, or with fewer
    than two frames left.
    """
    names = [name for name in (f"left_{joint}", f"right_{joint}") if matched.has(name)]
    if not names or not matched.has("chest"):
        return None
    solve, reference = matched.pick(names)
    chest_solve, chest_reference = matched.pick(["chest"])
    a, b = solve - chest_solve, reference - chest_reference
    whole = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))
    return (a[whole].transpose(1, 0, 2), b[whole].transpose(1, 0, 2)) if whole.sum() > 1 else None


def figures(matched: Matched, joint: str = "wrist") -> ThesisFigures:
    """Return the thesis's figures of one joint."""
    found = curves(matched, joint)
    if found is None:
        return {
            "absolute_difference_cm": None,
            "shortest_distance_cm": None,
            "spike_difference": None,
            "deviations": None,
            "nearest_sample_cm": None,
        }
    solve, reference = found
    return {
        "absolute_difference_cm": absolute_difference_cm(solve, reference),
        "shortest_distance_cm": shortest_distance_cm(solve, reference),
        "spike_difference": spike_difference(solve, reference, matched.rate_hz),
        "deviations": deviations(solve, reference, matched.rate_hz),
        "nearest_sample_cm": nearest_sample_cm(solve, reference),
    }


def absolute_difference_cm(solve_m: NDArray[np.float64], reference_m: NDArray[np.float64]) -> float:
    """Mean over axes, frames and sides of the difference at one time [cm]; arrays (..., frame_count, 3)."""
    return float(np.abs(solve_m - reference_m).mean() * 100)


def shortest_distance_cm(solve_m: NDArray[np.float64], reference_m: NDArray[np.float64]) -> float:
    """Return the mean distance of joints from the reference's whole paths [cm]; (side_count, frame_count, 3)."""
    distances = [distance_to_path(a, b) for a, b in zip(solve_m, reference_m, strict=True)]
    return float(np.mean(distances) * 100)


def nearest_sample_cm(solve_m: NDArray[np.float64], reference_m: NDArray[np.float64]) -> float:
    """Mean distance to the nearest sample of the reference's curve of the same axis at any time [cm].

    As in the thesis (section 6.2.1): each axis alone, samples not interpolated. Arrays (..., frame_count, 3).
    """
    distances = []
    for a, b in zip(
        *(np.moveaxis(x, -1, -2).reshape(-1, x.shape[-2]) for x in (solve_m, reference_m)), strict=True
    ):
        samples = np.sort(b)
        after = np.clip(np.searchsorted(samples, a), 1, len(samples) - 1)
        distances.append(np.minimum(np.abs(a - samples[after - 1]), np.abs(a - samples[after])))
    return float(np.mean(distances) * 100)


def spike_difference(solve_m: NDArray[np.float64], reference_m: NDArray[np.float64], rate_hz: float) -> float:
    """Number of spikes of the solve minus those of the reference, mean per curve; arrays (..., frame_count, 3)."""
    curves = [np.moveaxis(x, -1, -2).reshape(-1, x.shape[-2]) for x in (solve_m, reference_m)]
    counts = [[spike_count(curve, rate_hz) for curve in side] for side in curves]
    return float(np.mean(counts[0]) - np.mean(counts[1]))


def deviations(
    solve_m: NDArray[np.float64], reference_m: NDArray[np.float64], rate_hz: float
) -> float | None:
    """Intervals in which one curve is concave and the other convex, as the mean per curve; None under 1 s."""
    if solve_m.shape[-2] < rate_hz:
        return None
    a, b = (np.moveaxis(x, -1, -2).reshape(-1, x.shape[-2]) for x in (solve_m, reference_m))
    return float(np.mean([deviation_count(p, q, rate_hz) for p, q in zip(a, b, strict=True)]))


def distance_to_path(points_m: NDArray[np.float64], path_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each point's distance [m] to a path of straight segments; (point_count, 3), (vertex_count, 3).

    The distance is exact. Segments are searched in classes of doubling length, since a segment can be nearer than its
    middle by half of its length. Where a performer stands still, thousands of short segments lie together.
    """
    start, along = path_m[:-1], np.diff(path_m, axis=0)
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-6)
    doubling = np.floor(np.log2(length)).astype(int)
    best = np.full(len(points_m), np.inf)
    for some in np.unique(doubling):
        mine = doubling == some
        _nearer(best, points_m, start[mine], along[mine], 0.5 * float(length[mine].max()))
    return best


def _nearer(
    best: NDArray[np.float64],
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    along: NDArray[np.float64],
    half_m: float,
) -> None:
    """Lower `best` to the distance of nearer segments that are at most twice `half_m` long."""
    tree = cKDTree(start + 0.5 * along)
    left, count = np.arange(len(points)), 8
    while len(left):
        count = min(count, len(start))
        farther = []
        for part in np.array_split(left, 1 + len(left) * count // _AT_ONCE):
            middle_distance, index = tree.query(points[part], k=[*range(1, count + 1)])
            found = _distance_to_segments(points[part, None], start[index], along[index]).min(axis=1)
            best[part] = np.minimum(best[part], found)
            farther.append(part[best[part] > middle_distance[:, -1] - half_m])
        left = np.concatenate(farther) if count < len(start) else left[:0]
        count *= 4


def _distance_to_segments(
    points: NDArray[np.float64], start: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    length2 = np.maximum((along**2).sum(axis=-1), 1e-30)
    share = np.clip(((points - start) * along).sum(axis=-1) / length2, 0.0, 1.0)
    return np.linalg.norm(points - start - share[..., None] * along, axis=-1)


def spike_count(curve_m: NDArray[np.float64], rate_hz: float) -> int:
    """Return the number of maximal intervals of a curve that are covered by windows of 4/30 s spanning over 10 cm."""
    return _run_count(in_spike(curve_m, rate_hz), 1)


def in_spike(curve_m: NDArray[np.float64], rate_hz: float) -> NDArray[np.bool_]:
    """Return which samples of a curve lie in a window of 4/30 s that spans over 10 cm."""
    window = max(1, round(SPIKE_S * rate_hz)) + 1
    covered = np.zeros(len(curve_m), dtype=bool)
    if len(curve_m) < window:
        return covered
    views = np.lib.stride_tricks.sliding_window_view(curve_m, window)
    spiking = np.flatnonzero(np.ptp(views, axis=1) > SPIKE_M)
    for k in range(window):
        covered[spiking + k] = True
    return covered


def deviation_count(a_m: NDArray[np.float64], b_m: NDArray[np.float64], rate_hz: float) -> int:
    """Return the number of intervals of at least 0.2 s in which two curves curve in opposite directions, each by over
    1 m/s2.

    The curves are low-passed at 3 Hz first (Butterworth of second order, forwards and backwards).
    """
    from scipy.signal import butter, sosfiltfilt  # slow to load: not at the start of the server

    filter_sos = butter(2, LOW_PASS_HZ, fs=rate_hz, output="sos")
    p, q = (np.diff(sosfiltfilt(filter_sos, x), n=2) * rate_hz**2 for x in (a_m, b_m))
    opposite = (p * q < 0) & (np.abs(p) > DEVIATION_M_S2) & (np.abs(q) > DEVIATION_M_S2)
    return _run_count(opposite, max(1, int(np.ceil(DEVIATION_S * rate_hz - 1e-9))))


def _run_count(flags: NDArray[np.bool_], least: int) -> int:
    """Number of runs of at least `least` true values."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return int((np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1) >= least).sum())
