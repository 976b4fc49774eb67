"""A sheet with a board or a tag in true size, to be printed, as SVG."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.engine.seeing.board import Board, charuco_board, marker_dictionary

_WORDS_MM = 14.0
"""Room for the words below."""

_SMALLEST_WORDS_MM, _LARGEST_WORDS_MM = 2.0, 5.0
_Square = tuple[float, float, float]
"""A black square: left, top, side [mm]."""


def board_sheet(board: Board, number: int = 0) -> str:
    """Return a board, or the tag with this number, as SVG in millimetres, with a white margin and its name below.

    Raises:
        SettingsError: the family has no tag with this number.
        NotAvailableError: OpenCV is not installed.
    """
    if board.kind == "apriltag":
        wide = high = 1e3 * board.size_m
        squares, margin = list(_tag(board, number)), wide / 8.0
        words = f"AprilTag {board.dictionary}, number {number}: the black square is {wide:g} mm"
    else:
        side = 1e3 * board.size_m
        wide, high, margin = board.columns * side, board.rows * side, side / 2.0
        squares = list(_charuco(board))
        words = (
            f"ChArUco {board.columns} x {board.rows}, {board.dictionary}: squares {side:g} mm, "
            f"markers {1e3 * board.marker_m:g} mm"
        )
    letters = min(max(wide / 40.0, _SMALLEST_WORDS_MM), _LARGEST_WORDS_MM)
    whole, tall = wide + 2.0 * margin, high + 2.0 * margin + _WORDS_MM
    drawn = "".join(f"M{x:.3f} {y:.3f}h{a:.3f}v{a:.3f}h-{a:.3f}z" for x, y, a in squares)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{whole:.3f}mm" height="{tall:.3f}mm" '
        f'viewBox="{-margin:.3f} {-margin:.3f} {whole:.3f} {tall:.3f}">'
        f'<rect x="{-margin:.3f}" y="{-margin:.3f}" width="{whole:.3f}" height="{tall:.3f}" fill="#fff"/>'
        f'<path d="{drawn}" fill="#000" shape-rendering="crispEdges"/>'
        f'<text x="0" y="{high + margin + letters:.3f}" font-family="sans-serif" font-size="{letters:.3f}" '
        f'fill="#000">{words}. Print at 100 %, and measure it.</text></svg>\n'
    )


def _tag(board: Board, number: int) -> Iterator[_Square]:
    count = len(marker_dictionary(board.dictionary).bytesList)
    if not 0 <= number < count:
        raise SettingsError(bad_value("--number", number, f"0 to {count - 1}"))
    yield from _marker(board.dictionary, number, 0.0, 0.0, 1e3 * board.size_m)


def _charuco(board: Board) -> Iterator[_Square]:
    side, drawn = 1e3 * board.size_m, charuco_board(board)
    white = set()
    for number, corners in zip(np.ravel(drawn.getIds()), drawn.getObjPoints(), strict=True):
        x, y = 1e3 * np.asarray(corners)[:, :2].min(axis=0)
        white.add((int(x // side), int(y // side)))
        yield from _marker(board.dictionary, int(number), float(x), float(y), 1e3 * board.marker_m)
    for column, row in np.ndindex(board.columns, board.rows):
        if (column, row) not in white:
            yield column * side, row * side, side


def _marker(dictionary: str, number: int, left: float, top: float, side: float) -> Iterator[_Square]:
    """Yield the black squares of a marker and of its black border, which is one square wide."""
    markers = marker_dictionary(dictionary)
    across = markers.markerSize + 2
    bits: NDArray[np.uint8] = markers.generateImageMarker(number, across)
    for row, column in np.argwhere(np.asarray(bits) == 0):
        cell = side / across
        yield left + column * cell, top + row * cell, cell
