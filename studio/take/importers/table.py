"""Reader of CSV with numbers; its errors name file and line."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path

from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import unreadable


def csv_rows(file: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield (line number, cells without outer blanks) of every row that is not blank.

    Raises:
        FormatError: the file cannot be read, or is not text.
    """
    try:
        with open(file, encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream, skipinitialspace=True)
            for row in reader:
                cells = [cell.strip() for cell in row]
                if any(cells):
                    yield reader.line_num, cells
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(
            "import.not_csv",
            "{path} is not a CSV text file ({error}); give the recording as exported",
            path=file,
            error=error,
        ) from error
    except OSError as error:
        raise FormatError(unreadable(file, error)) from error


def first_row(file: Path) -> list[str]:
    """Return the cells of the first row; empty where the file is empty or not text."""
    try:
        return next(csv_rows(file), (0, []))[1]
    except FormatError:
        return []


def header_index(file: Path, header: list[str]) -> dict[str, int]:
    """Return the columns by name.

    Raises:
        FormatError: a name that occurs twice.
    """
    twice = sorted({name for name in header if name and header.count(name) > 1})
    if twice:
        raise FormatError(
            "import.columns_twice",
            "{path}: columns {names} come twice; each column needs its own name",
            path=file,
            names=[*twice],
        )
    return {name: i for i, name in enumerate(header)}


def number(file: Path, line: int, column: str, text: str) -> float:
    """Return the number in a cell.

    Raises:
        FormatError: not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise FormatError(
            "import.not_finite_number",
            "{path}:{line}: {column} is {text!r}; a finite number is needed",
            path=file,
            line=line,
            column=column,
            text=text[:40],
        )
    return value


def whole_number(file: Path, line: int, column: str, text: str) -> int:
    """Return the whole number in a cell.

    Raises:
        FormatError: not a whole number, or one of more than 18 digits.
    """
    try:
        value = int(text)
    except ValueError:
        value = 10**18
    if abs(value) >= 10**18:
        raise FormatError(
            "import.not_whole_number",
            "{path}:{line}: {column} is {text!r}; a whole number is needed",
            path=file,
            line=line,
            column=column,
            text=text[:40],
        )
    return value


def check_length(file: Path, line: int, cells: list[str], count: int) -> None:
    """Raise FormatError if a row has another number of cells than the header."""
    if len(cells) != count:
        raise FormatError(
            "import.row_cut",
            "{path}:{line}: {n} values where {count} are needed; the row is cut",
            path=file,
            line=line,
            n=len(cells),
            count=count,
        )
