"""Spans of time in which a camera did not agree with the others."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import say


class SpanJson(TypedDict):
    """A `Span` as stored: from and to [s], null: to the end; distance from the other cameras [mm]."""

    from_s: float
    to_s: float | None
    shift_mm: float
    named: bool


@dataclass(frozen=True)
class Span:
    """A span of time in which a camera's joints were away from the other cameras': from and to [s], and how far [m].

    `to_s` is None where the cameras did not agree again before the frames ended. `named`: at least two others show
    that this camera is the one that differs; with two cameras, neither can be named.
    """

    from_s: float
    to_s: float | None
    metres: float
    named: bool = False

    def later(self, by_s: float) -> "Span":
        """Return the span on a clock that is ahead by `by_s`."""
        return replace(self, from_s=self.from_s + by_s, to_s=None if self.to_s is None else self.to_s + by_s)

    def contains(self, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which times lie in the span, of the shape of `time_s`."""
        return (time_s >= self.from_s) & (time_s < (np.inf if self.to_s is None else self.to_s))

    def words(self) -> str:
        """Return the meaning of the span and what to do, in words, with its own times."""
        mm = f"{self.metres * 1e3:.0f}"
        if self.to_s is None:
            return say(
                "verdict.stopped_agreeing",
                "no longer agrees with the other cameras from {seconds:.1f} s on ({mm} mm off): was it "
                "moved, or the performer at the edge of its view? Solve that part without it, or "
                "calibrate again",
                seconds=self.from_s,
                mm=mm,
            )
        return say(
            "verdict.span_disagrees",
            "does not agree with the other cameras from {seconds:.1f} to {until:.1f} s ({mm} mm "
            "off): was it moved, or the performer at the edge of its view? Solve that part without "
            "it, or calibrate again",
            seconds=self.from_s,
            until=self.to_s,
            mm=mm,
        )

    def to_json(self) -> SpanJson:
        """Return the span as stored in `calibrations/<n>.json` and in `metrics.json`."""
        to_s = None if self.to_s is None else round(self.to_s, 3)
        return {
            "from_s": round(self.from_s, 3),
            "to_s": to_s,
            "shift_mm": round(self.metres * 1e3, 1),
            "named": self.named,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Span":
        """Return the span in JSON of `to_json`.

        Raises:
            KeyError, TypeError, ValueError: a value is missing or is no number.
        """
        to_s = None if value["to_s"] is None else float(value["to_s"])
        named = bool(value.get("named", False))
        return cls(float(value["from_s"]), to_s, float(value["shift_mm"]) * 1e-3, named)
