"""SVG as text: elements, scales and axes; no drawing library."""

from dataclasses import dataclass
from html import escape

import numpy as np

LIGHT = {
    "ink": "#26303c",
    "faint": "#5b6573",
    "grid": "#e1e5ea",
    "paper": "#ffffff",
    "beside": "#c3c9d1",
    "series-0": "#2f6fb3",
    "series-1": "#d9772b",
    "series-2": "#3f9b57",
    "series-3": "#a8478f",
    "series-4": "#8a7a2c",
    "series-5": "#5b57b8",
    "series-6": "#2a9a94",
    "series-7": "#b8413e",
}
DARK = {
    "ink": "#e6e9ee",
    "faint": "#a3adba",
    "grid": "#343c48",
    "paper": "#1c2129",
    "beside": "#5d6775",
    "series-0": "#6ea8e6",
    "series-1": "#eb9a58",
    "series-2": "#6cc485",
    "series-3": "#d484bf",
    "series-4": "#c2b160",
    "series-5": "#9c98ee",
    "series-6": "#5fc9c3",
    "series-7": "#ea7f7b",
}
"""Colours of drawings on light and on dark pages; a drawing on its own is light."""


def _colour(name: str) -> str:
    return f"var(--{name},{LIGHT[name]})"


INK, FAINT, GRID, PAPER, BESIDE = map(_colour, ("ink", "faint", "grid", "paper", "beside"))
COLOURS: tuple[str, ...] = tuple(_colour(name) for name in LIGHT if name.startswith("series"))
"""Colours of series, in order; their lightness differs, for readers with red-green colour blindness."""
REFERENCE = INK


def number(value: float) -> str:
    """Format a coordinate: two decimals are finer than any screen."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def text(
    x: float,
    y: float,
    words: str,
    *,
    size: float = 11,
    fill: str = INK,
    anchor: str = "start",
    bold: bool = False,
) -> str:
    """Return a text element."""
    weight = ' font-weight="600"' if bold else ""
    return (
        f'<text x="{number(x)}" y="{number(y)}" font-size="{number(size)}" fill="{fill}" '
        f'text-anchor="{anchor}"{weight}>{escape(words)}</text>'
    )


def line(x1: float, y1: float, x2: float, y2: float, *, stroke: str = GRID, width: float = 1.0) -> str:
    """Return a straight line."""
    return (
        f'<line x1="{number(x1)}" y1="{number(y1)}" x2="{number(x2)}" y2="{number(y2)}" '
        f'stroke="{stroke}" stroke-width="{number(width)}"/>'
    )


def rectangle(x: float, y: float, width: float, height: float, *, fill: str, title: str = "") -> str:
    """Return a rectangle, with `title` as its tooltip."""
    inner = f"<title>{escape(title)}</title>" if title else ""
    return (
        f'<rect x="{number(x)}" y="{number(y)}" width="{number(max(width, 0.0))}" '
        f'height="{number(max(height, 0.0))}" fill="{fill}">{inner}</rect>'
    )


def path(xs: np.ndarray, ys: np.ndarray, *, stroke: str, width: float = 1.4) -> str:
    """Return a polyline through points; NaN breaks it."""
    pieces: list[str] = []
    pen_up = True
    for x, y in zip(xs, ys, strict=True):
        if not np.isfinite(x) or not np.isfinite(y):
            pen_up = True
            continue
        pieces.append(f"{'M' if pen_up else 'L'}{x:.1f} {y:.1f}")
        pen_up = False
    return f'<path d="{"".join(pieces)}" fill="none" stroke="{stroke}" stroke-width="{number(width)}"/>'


def drawing(width: float, height: float, parts: list[str], label: str) -> str:
    """Return a whole SVG, which scales with the page; `label` describes it for screen readers."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {number(width)} {number(height)}" '
        f'role="img" aria-label="{escape(label)}" font-family="system-ui, sans-serif" '
        f'style="max-width:{number(width)}px;width:100%;height:auto;background:{PAPER}">{"".join(parts)}</svg>'
    )


@dataclass(frozen=True)
class Scale:
    """Maps values `low` to `high` to pixels `start` to `end`."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def many(self, values: np.ndarray) -> np.ndarray:
        return self.start + (values - self.low) / (self.high - self.low) * (self.end - self.start)


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Return round numbers that span `low` to `high`, about `count` steps of 1, 2 or 5 times a power of ten."""
    span = max(high - low, 1e-9)
    rough = span / count
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * (1 - 1e-9))
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    return [float(round(k * step, 10)) for k in np.arange(first, last + 1)]
