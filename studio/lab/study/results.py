"""Means of a study's figures, and intervals of their changes by bootstrap over motions and seeds."""

from dataclasses import dataclass
from typing import Any, NotRequired, TypedDict

import numpy as np

from studio.lab.study.thesis_tables import Condition
from studio.review.report.bootstrap import interval


@dataclass(frozen=True)
class Change:
    """Difference of a figure between two conditions, over the recordings that both have.

    Attributes:
        before, after: means.
        low, high: 95 % interval of `after - before`.
        count: number of pairs.
    """

    before: float
    after: float
    low: float
    high: float
    count: int

    @property
    def difference(self) -> float:
        return self.after - self.before

    @property
    def share(self) -> float | None:
        """Difference as a share of `before`; None if `before` is not above 0."""
        return self.difference / self.before if self.before > 0 else None

    @property
    def direction(self) -> int:
        """-1 = fallen, 1 = risen, 0 = the interval contains 0."""
        return -1 if self.high < 0 else 1 if self.low > 0 else 0


class CellJson(TypedDict):
    """A solve of a study as stored in its file.

    Attributes:
        changes: the switches of the variant, as `KEY=VALUE`.
        problem: reason why there are no figures, or empty.
        figures: by name, as in an `Evaluation`.
        moved_10cm: number of frames in which the switch moves a joint by at least 10 cm, and of all.
        cpu_s: computing time [s].
    """

    motion: str
    cameras: int
    interference: bool
    seed: int
    variant: str
    preset: NotRequired[str]
    changes: NotRequired[list[str]]
    problem: str
    figures: NotRequired[dict[str, Any]]
    moved_10cm: NotRequired[list[int]]
    cpu_s: float


class Results:
    """All cells of a study, by condition."""

    def __init__(self, cells: list[CellJson]) -> None:
        self.cells = cells
        self._by: dict[tuple[str, int, bool], dict[tuple[str, int], CellJson]] = {}
        for cell in cells:
            key = (cell["variant"], cell["cameras"], cell["interference"])
            self._by.setdefault(key, {})[cell["motion"], cell["seed"]] = cell

    def of(self, condition: Condition) -> dict[tuple[str, int], CellJson]:
        """The cells of a condition by motion and seed, including those with a problem."""
        return self._by.get((condition.variant, condition.cameras, condition.interference), {})

    def values(self, condition: Condition, figure: str) -> dict[tuple[str, int], float]:
        """A figure by motion and seed, where measured."""
        return {
            key: float(cell["figures"][figure])
            for key, cell in self.of(condition).items()
            if "figures" in cell and not cell["problem"] and cell["figures"][figure] is not None
        }

    def mean(self, condition: Condition, figure: str) -> float | None:
        values = list(self.values(condition, figure).values())
        return float(np.mean(values)) if values else None

    def spread(self, condition: Condition, figure: str) -> tuple[float, float] | None:
        """95 % interval of the mean."""
        values = np.array(list(self.values(condition, figure).values()))
        return interval(values) if len(values) > 1 else None

    def change(self, base: Condition, condition: Condition, figure: str) -> Change | None:
        """Return the change of a figure; None without a common recording."""
        before, after = self.values(base, figure), self.values(condition, figure)
        common = sorted(before.keys() & after.keys())
        if not common:
            return None
        a, b = (np.array([values[key] for key in common]) for values in (before, after))
        low, high = interval(b - a) if len(common) > 1 else (-np.inf, np.inf)
        return Change(float(a.mean()), float(b.mean()), float(low), float(high), len(common))

    def problems(self, condition: Condition) -> list[str]:
        """Problems of a condition's recordings, one text each."""
        return [cell["problem"] for cell in self.of(condition).values() if cell["problem"]]

    def moved_share(self, condition: Condition) -> tuple[int, int] | None:
        """Number of frames in which a switch moved a joint by at least 10 cm, and of all."""
        found = [cell["moved_10cm"] for cell in self.of(condition).values() if "moved_10cm" in cell]
        return (sum(one[0] for one in found), sum(one[1] for one in found)) if found else None
