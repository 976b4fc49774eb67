"""Physics over a whole take: compares the finished and the corrected motion and joins the better parts."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.whole_take.finish.contact.contacts import Contacts
from studio.engine.whole_take.finish.trajectory import moved, steps_between
from studio.engine.whole_take.physics.correction import WindowStep
from studio.engine.whole_take.physics.dynamics import GRAVITY_M_S2, body_mass_kg
from studio.engine.whole_take.physics.measure import Meter, PhysicsFigures
from studio.engine.whole_take.physics.verdict import kept, strays

WINDOW = 600
"""Frames measured at a time."""

MIN_FRAMES = 6
"""Shorter pieces between gaps are not corrected."""

Fused = Callable[[int, int], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Begin and end -> fused joints [m], shape (F, 21, 3), NaN = unseen, and their deviation [m], shape (F, 21)."""


class Physics:
    """Joins a finished take and its correction.

    Attributes:
        correction: solver of the correction's steps, in place of finishing's `Smoother`.
        report: effect of the correction, for `metrics.json`; empty before `joined`.
    """

    def __init__(self, humanoid: Humanoid, dt: float, *, limited: bool) -> None:
        """Prepare for a humanoid's frames, `dt` apart [s]."""
        self.correction = WindowStep(humanoid, dt, limited=limited)
        self.report: SolveMetrics = {}
        self._meter = Meter(humanoid, dt)
        self._weight_n = body_mass_kg(humanoid) * GRAVITY_M_S2
        self._dt = dt

    def joined(
        self,
        finished: NDArray[np.float64],
        corrected: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        contacts: Contacts | None,
        fused: Fused,
    ) -> NDArray[np.float64]:
        """Return the corrected configurations where their figures are better, else the finished ones, shape (F, nq).

        Args:
            finished: configurations of the finished take.
            corrected: of the corrected one; overwritten by the result.
            pieces: begin and end of each part without a gap [frames].
            contacts: standing feet; None = unknown.
            fused: returns the fused joints.
        """
        totals = _Totals()
        for first, last in pieces:
            if last - first < MIN_FRAMES:
                corrected[first:last] = finished[first:last]
                totals.add_left(last - first)
                continue
            before, after, strayed = self._compared(finished, corrected, first, last, contacts, fused)
            share = kept(before, after, strayed, self._dt)
            for begin, end in _windows(first, last):
                some = share[begin - first : end - first, None]
                ways = some * steps_between(finished[begin:end], corrected[begin:end])
                between = moved(finished[begin:end], ways)
                corrected[begin:end] = np.where(some > 0.0, between, finished[begin:end])
            joined = [self._measured(corrected, w, first, last, contacts)[0] for w in _windows(first, last)]
            totals.add(share, before, PhysicsFigures.joined(joined))
        self.report = totals.report(self._weight_n)
        return corrected

    def _compared(
        self,
        finished: NDArray[np.float64],
        corrected: NDArray[np.float64],
        first: int,
        last: int,
        contacts: Contacts | None,
        fused: Fused,
    ) -> tuple[PhysicsFigures, PhysicsFigures, NDArray[np.bool_]]:
        """Figures of both motions over a piece, and the frames in which a joint of the corrected one strays."""
        before, after, strayed = [], [], []
        for window in _windows(first, last):
            figures, joints = self._measured(finished, window, first, last, contacts)
            before.append(figures)
            figures, moved_joints = self._measured(corrected, window, first, last, contacts)
            after.append(figures)
            strayed.append(strays(joints, moved_joints, *fused(*window)))
        return PhysicsFigures.joined(before), PhysicsFigures.joined(after), np.concatenate(strayed)

    def _measured(
        self,
        q: NDArray[np.float64],
        window: tuple[int, int],
        first: int,
        last: int,
        contacts: Contacts | None,
    ) -> tuple[PhysicsFigures, NDArray[np.float64]]:
        """Figures and canonical joints of a window of the piece from `first` to `last`."""
        begin, end = window
        low, high = max(begin - 1, first), min(end + 1, last)
        standing = None if contacts is None else contacts.part(slice(low, high))
        figures, joints = self._meter.measured(q[low:high], standing)
        rows = slice(begin - low, end - low)
        return figures.part(rows), joints[rows]


def _windows(first: int, last: int) -> Iterator[tuple[int, int]]:
    """Windows of a piece; a remainder too short to be measured joins the window before it."""
    begin = first
    while begin < last:
        end = min(begin + WINDOW, last)
        if last - end < MIN_FRAMES:
            end = last
        yield begin, end
        begin = end


_FIGURES = (
    ("residual_force_n", 1.0),
    ("residual_moment_nm", 1.0),
    ("torque_excess_nm", 1.0),
    ("foot_slide_cm_s", 100.0),
    ("sole_sunk_mm", 1000.0),
)
"""Names in `metrics.json`, and their units in SI units, in the order of the sums."""


class _Totals:
    """Adds up figures over the pieces of a take."""

    def __init__(self) -> None:
        self._frames = self._measured = 0
        self._kept = 0.0
        self._sums = np.zeros((2, 5))

    def add_left(self, frames: int) -> None:
        self._frames += frames

    def add(self, share: NDArray[np.float64], before: PhysicsFigures, after: PhysicsFigures) -> None:
        self._frames += len(share)
        self._measured += len(share)
        self._kept += float(share.sum())
        for row, figures in enumerate((before, after)):
            self._sums[row] += [
                figures.force_n.sum(), figures.moment_nm.sum(), figures.excess_nm.sum(),
                figures.slide_m_s.sum(), figures.sunk_m.sum(),
            ]  # fmt: skip

    def report(self, weight_n: float) -> SolveMetrics:
        """The line `physics`, and `physics_figures`: means over the measured frames, before and after."""
        means = self._sums / max(self._measured, 1)
        kept_share = self._kept / max(self._frames, 1)
        figures = {"kept_share": round(kept_share, 4), "body_weight_n": round(weight_n, 1)}
        for column, (name, factor) in enumerate(_FIGURES):
            for row, when in enumerate(("before", "after")):
                figures[f"{name}_{when}"] = round(float(factor * means[row, column]), 4)
        (force, moment, excess, _, sunk), (force2, moment2, excess2, _, sunk2) = means
        line = (
            f"kept in {100 * kept_share:.0f} % of the frames; unexplained force {force:.0f} to {force2:.0f} N "
            f"({force / weight_n:.2f} to {force2 / weight_n:.2f} body weights) and moment {moment:.1f} to "
            f"{moment2:.1f} N m, torque beyond strength {excess:.1f} to {excess2:.1f} N m, soles "
            f"{1e3 * sunk:.0f} to {1e3 * sunk2:.0f} mm under the floor"
        )
        return {"physics": line, "physics_figures": figures}
