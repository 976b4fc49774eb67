"""Boards of known size in pictures: a ChArUco board, or AprilTags. OpenCV finds them, the extra `board`.

Source: Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial markers under
occlusion", Pattern Recognition 47, 2014; Wang, Olson, "AprilTag 2", IROS 2016.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import NotAvailableError, SettingsError
from studio.engine.base.value_sentences import bad_value

ALLOWED = (
    "charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM[:DICTIONARY], such as charuco:5x7:60:45:4x4_50, or "
    "apriltag:SIZE_MM[:FAMILY], such as apriltag:160:36h11"
)
FAMILIES = ("36h11", "25h9", "16h5", "36h10")
DICTIONARIES = (
    *(f"{bits}x{bits}_{count}" for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)),
    "original",
)
_ORIGINAL_MARKERS = 1024
_SIZES_MM = (5.0, 5000.0)
_SQUARES = (3, 50)
_LEAST_CORNERS = 6
"""Minimum number of corners for a ChArUco board to count as seen."""


@dataclass(frozen=True)
class Board:
    """A board or tags in front of the cameras; lengths in metres.

    Attributes:
        kind: `charuco`, or `apriltag`: any number of tags of one size.
        size_m: side of a square, or of a tag's black part.
        dictionary: of its markers, or the family of the tags.
        columns, rows: number of squares of a ChArUco board.
        marker_m: side of its markers.
    """

    kind: str
    size_m: float
    dictionary: str
    columns: int = 0
    rows: int = 0
    marker_m: float = 0.0

    @classmethod
    def parse(cls, text: str) -> "Board":
        """Return the board that a text describes, see `ALLOWED`.

        Raises:
            SettingsError: the text describes no board.
        """
        kind, *parts = text.strip().lower().split(":")
        try:
            if kind == "apriltag" and len(parts) in (1, 2):
                family = parts[1].removeprefix("tag") if len(parts) > 1 else FAMILIES[0]
                return cls(kind, _length_m(parts[0]), _known(family, FAMILIES))
            if kind == "charuco" and len(parts) in (3, 4):
                columns, rows = (int(number) for number in parts[0].split("x"))
                square_m, marker_m = _length_m(parts[1]), _length_m(parts[2])
                dictionary = _known(parts[3] if len(parts) > 3 else DICTIONARIES[0], DICTIONARIES)
                if (
                    min(columns, rows) < _SQUARES[0]
                    or max(columns, rows) > _SQUARES[1]
                    or marker_m >= square_m
                ):
                    raise ValueError(text)
                _check_markers(columns, rows, dictionary)
                return cls(kind, square_m, dictionary, columns, rows, marker_m)
        except ValueError:
            pass
        raise SettingsError(bad_value("--board", text, ALLOWED))


@dataclass(frozen=True)
class SeenBoard:
    """A board, or one tag, in a picture.

    Attributes:
        number: of the tag; 0 for a board.
        points: its corners in its own plane [m], z = 0, the whole board's middle at the origin, shape (n, 2).
        pixels: the same corners in the picture, shape (n, 2).
        ids: numbers of these corners, increasing, shape (n,).
    """

    number: int
    points: NDArray[np.float64]
    pixels: NDArray[np.float64]
    ids: NDArray[np.int64]


class BoardFinder:
    """Finds a board in pictures.

    Attributes:
        markers: number of pictures in which any of its markers was seen, with or without its corners.

    Raises:
        NotAvailableError: OpenCV is not installed.
    """

    def __init__(self, board: Board) -> None:
        self._board, self._cv2 = board, opencv()
        self.markers = 0

    def find(self, grey: NDArray[np.uint8]) -> list[SeenBoard]:
        """Return the boards in a picture, shape (rows, columns): at most one board, or several tags."""
        if self._board.kind == "apriltag":
            return self._tags(grey)
        found, any_markers = list[SeenBoard](), False
        for detector in self._charuco:
            corners, ids, _, markers = detector.detectBoard(grey)
            any_markers = any_markers or (markers is not None and len(markers) > 0)
            if ids is not None and len(ids) >= _LEAST_CORNERS:
                found = [self._seen(np.asarray(ids).ravel(), np.asarray(corners).reshape(-1, 2))]
                break
        self.markers += any_markers
        return found

    def others(self, grey: NDArray[np.uint8]) -> str:
        """Return the other dictionary or family with the most markers in a picture; "" = none has two."""
        counts = {}
        for name in (*DICTIONARIES[3::4], *FAMILIES):
            if name != self._board.dictionary:
                _, ids, _ = self._detector(name).detectMarkers(grey)
                counts[name] = 0 if ids is None else len(ids)
        best = max(counts, key=lambda name: counts[name])
        return best if counts[best] > 1 else ""

    @cached_property
    def _charuco(self) -> list[Any]:
        """Detectors of the board as OpenCV draws it now, and as it did before version 4.6."""
        found = []
        for old in (False, True):
            board = charuco_board(self._board)
            board.setLegacyPattern(old)
            found.append(self._cv2.aruco.CharucoDetector(board))
        return found

    @cached_property
    def _tag(self) -> Any:
        return self._detector(self._board.dictionary)

    def _detector(self, dictionary: str) -> Any:
        parameters = self._cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = self._cv2.aruco.CORNER_REFINE_SUBPIX
        return self._cv2.aruco.ArucoDetector(marker_dictionary(dictionary), parameters)

    def _seen(self, ids: NDArray[np.int64], pixels: NDArray[np.float64]) -> SeenBoard:
        what, order = self._board, np.argsort(ids)
        ids, across = ids[order].astype(np.int64), what.columns - 1
        places = np.column_stack([ids % across + 1, ids // across + 1]) * what.size_m
        middle = 0.5 * what.size_m * np.array([what.columns, what.rows])
        return SeenBoard(0, places - middle, pixels[order].astype(np.float64), ids)

    def _tags(self, grey: NDArray[np.uint8]) -> list[SeenBoard]:
        corners, ids, _ = self._tag.detectMarkers(grey)
        if ids is None:
            return []
        self.markers += 1
        half = 0.5 * self._board.size_m
        places = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
        return [
            SeenBoard(int(number), places, np.asarray(mine, np.float64).reshape(4, 2), np.arange(4))
            for number, mine in zip(np.ravel(ids), corners, strict=True)
        ]


def _length_m(text: str) -> float:
    size_mm = float(text)
    if not _SIZES_MM[0] <= size_mm <= _SIZES_MM[1]:
        raise ValueError(text)
    return size_mm * 1e-3


def _check_markers(columns: int, rows: int, dictionary: str) -> None:
    """Raise a SettingsError if a dictionary has too few markers for a board."""
    needed, count = columns * rows // 2, int(dictionary.partition("_")[2] or _ORIGINAL_MARKERS)
    if needed > count:
        raise SettingsError(
            "board.few_markers",
            "a board of {columns} x {rows} squares needs {needed} markers, and {dictionary} has {count}: use a "
            "larger dictionary, or fewer squares",
            columns=columns,
            rows=rows,
            needed=needed,
            dictionary=dictionary,
            count=count,
        )


def _known(name: str, allowed: tuple[str, ...]) -> str:
    if name not in allowed:
        raise ValueError(name)
    return name


def charuco_board(board: Board) -> Any:
    """Return OpenCV's ChArUco board.

    Raises:
        NotAvailableError: OpenCV is not installed.
    """
    size, markers = (board.columns, board.rows), marker_dictionary(board.dictionary)
    return opencv().aruco.CharucoBoard(size, board.size_m, board.marker_m, markers)


def marker_dictionary(name: str) -> Any:
    """Return OpenCV's markers of a dictionary or family.

    Raises:
        NotAvailableError: OpenCV is not installed.
    """
    aruco = opencv().aruco
    if name in FAMILIES:
        key = f"DICT_APRILTAG_{name}"
    else:
        key = "DICT_ARUCO_ORIGINAL" if name == "original" else f"DICT_{name.upper()}"
    return aruco.getPredefinedDictionary(getattr(aruco, key))


def opencv() -> Any:
    """Return the module of OpenCV.

    Raises:
        NotAvailableError: it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise no_opencv() from error
    return cv2


def no_opencv() -> NotAvailableError:
    """Return the error of a machine without OpenCV."""
    return NotAvailableError(
        "board.no_opencv",
        'boards are found by OpenCV, which is not installed: pip install "capture-studio[board]"',
    )
