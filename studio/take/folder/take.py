"""A take on disk: its folder, `take.json`, calibrations and solves. `raw` reads and writes the frames.

<take>/take.json  calibrations/<n>.json  raw.mcap  solves/<name>/  exports/
"""

import json
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from studio.engine.base.errors import CalibrationError, StudioError, TakeError
from studio.engine.base.files import write_json
from studio.engine.base.sentences import about, say, system_says
from studio.engine.model.calibration import Calibration
from studio.take.folder.meta import CameraMeta, TakeMeta
from studio.take.folder.names import check_name, inside, is_safe_name
from studio.take.folder.performers import performer_by_name
from studio.wire import Hello

FORMAT_VERSION = 1
SOURCES = ("live", "import", "simulate", "splice")
STATES = ("recording", "done", "recovered")


class TakeVersionError(TakeError):
    """A take written in another version of the format."""


def utc_now() -> str:
    """Return the time as `take.json` writes it: ISO 8601, UTC, whole seconds."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def timecode(moment: datetime, frames_per_second: int = 60) -> str:
    """Return a time of day as `hh:mm:ss:ff`, the form of slates and editing programs."""
    frame = moment.microsecond * frames_per_second // 1_000_000
    return f"{moment:%H:%M:%S}:{frame:02d}"


def camera_json(hello: Hello) -> CameraMeta:
    """Return a camera's entry in `take.json`."""
    intrinsics = (
        None if hello.intrinsics is None else msgspec.json.decode(msgspec.json.encode(hello.intrinsics))
    )
    return {
        "name": hello.name,
        "device": hello.device,
        "joint_set": hello.joint_set,
        "serial": hello.serial,
        "frames_per_second": hello.frames_per_second,
        "intrinsics": intrinsics,
        "boot_ids": [hello.boot_id],
    }


def new_meta(
    *,
    session: str,
    name: str,
    source: str,
    created: str,
    calibration_s: float | None = None,
    performer: str = "",
    notes: str = "",
) -> TakeMeta:
    """Return the `take.json` of a take without cameras; see `Take.create`.

    Raises:
        TakeError: an unknown source.
    """
    if source not in SOURCES:
        raise TakeError(
            "take.source",
            "take source {source!r} is not known; allowed: {allowed}",
            source=source,
            allowed=[*SOURCES],
        )
    return {
        "format_version": FORMAT_VERSION,
        "id": f"{session}/{name}",
        "session": session,
        "name": name,
        "created": created,
        "source": source,
        "cameras": [],
        "performer": performer,
        "notes": notes,
        "rating": None,
        "calibration": None,
        "calibration_s": calibration_s,
        "recording": "recording",
    }


POSES = "poses.npz"
"""The poses of a solve's performer, in its folder."""

PERFORMER = "performer_1"
"""Name of the only performer of a solve."""


class Take:
    """A take's folder and the content of its `take.json`.

    Attributes:
        path: the take's folder.
        meta: `take.json`; change it and call `save_meta`.
    """

    def __init__(self, path: Path, meta: TakeMeta) -> None:
        self.path = path
        self.meta = meta

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle a take as its path; the receiver opens it in its state at that time."""
        return Take.open, (self.path,)

    @classmethod
    def create(
        cls,
        path: str | Path,
        *,
        session: str,
        name: str,
        source: str,
        calibration_s: float | None = None,
        performer: str = "",
        notes: str = "",
        created: str | None = None,
    ) -> "Take":
        """Make the folder of a new take, in place, with recording state `recording`.

        Args:
            path: a folder that does not exist or is empty.
            session: name of the session; a label, `path` gives the folder.
            name: name of the take.
            source: one of `SOURCES`.
            calibration_s: length of the calibration part at the beginning [s].
            performer: name of the performer.
            created: ISO 8601 in UTC; now where None.

        Raises:
            TakeError: an unsafe name, or a folder that is not empty.
        """
        path = Path(path)
        check_name("session", session)
        check_name("take", name)
        check_free(path)
        meta = new_meta(
            session=session,
            name=name,
            source=source,
            calibration_s=calibration_s,
            performer=performer,
            notes=notes,
            created=created or utc_now(),
        )
        take = cls(path, meta)
        try:
            for folder in ("calibrations", "solves", "exports"):
                (path / folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _not_made(path, error) from error
        try:
            take.save_meta()
        except StudioError:
            shutil.rmtree(path, ignore_errors=True)  # `check_free` found it empty
            raise
        return take

    @classmethod
    def open(cls, path: str | Path) -> "Take":
        """Return the take in a folder.

        Raises:
            TakeVersionError: written in another version of the format.
            TakeError: no take there, or a `take.json` that cannot be read.
        """
        path = Path(path)
        file = path / "take.json"
        if not path.is_dir():
            raise TakeError(
                "take.no_folder",
                "no take at {path}: there is no such folder; give the folder of a take",
                path=path,
            )
        if not file.is_file():
            raise TakeError(
                "take.no_take_json",
                "no take at {path}: the folder has no take.json; give a take, or run `studio doctor`",
                path=path,
            )
        try:
            meta = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            raise TakeError(
                "take.json_unreadable",
                "{file} cannot be read ({error}); run `studio doctor` to rebuild it",
                file=file,
                error=error,
            ) from error
        check_meta(file, meta)
        return cls(path, meta)

    def save_meta(self) -> None:
        """Write `take.json` atomically."""
        write_json(self.path / "take.json", self.meta)

    @property
    def raw_path(self) -> Path:
        return self.path / "raw.mcap"

    @property
    def camera_names(self) -> tuple[str, ...]:
        return tuple(camera["name"] for camera in self.meta["cameras"])

    def add_camera(self, hello: Hello, *, clock_within_s: float | None = None) -> None:
        """Add a camera to `meta`; a known one only gets its new `boot_id`. Then call `save_meta`.

        Args:
            hello: of its client.
            clock_within_s: see `CameraMeta`.
        """
        for camera in self.meta["cameras"]:
            if camera["name"] == hello.name:
                if hello.boot_id not in camera["boot_ids"]:
                    camera["boot_ids"].append(hello.boot_id)
                return
        camera = camera_json(hello)
        if clock_within_s is not None:
            camera["clock_within_s"] = clock_within_s
        self.meta["cameras"].append(camera)

    def common_clocks(self) -> dict[str, float]:
        """Return the maximum offset of the clocks of cameras that were brought to one clock [s], by camera."""
        found = ((camera["name"], camera.get("clock_within_s")) for camera in self.meta["cameras"])
        return {name: within_s for name, within_s in found if within_s is not None}

    def calibration(self) -> Calibration:
        """Return the calibration in use.

        Raises:
            CalibrationError: none is in use, or its file cannot be read.
        """
        number = self.meta["calibration"]
        if number is None:
            refused = self.calibration_numbers()
            raise CalibrationError(
                say(
                    "take.calibration_refused",
                    "take {take} has no calibration in use: calibration {number} was refused; `studio "
                    "calibrate {take}` says why, and record a walk that it can use",
                    take=self.path,
                    number=refused[-1],
                )
                if refused
                else say(
                    "take.not_calibrated",
                    "take {take} has no calibration in use; run `studio calibrate {take}` first",
                    take=self.path,
                )
            )
        return read_calibration(self.calibration_path(number))

    def calibration_path(self, number: int) -> Path:
        return self.path / "calibrations" / f"{number}.json"

    def calibration_numbers(self) -> list[int]:
        """Numbers of the stored calibrations, in order."""
        return _numbers((self.path / "calibrations").glob("*.json"))

    def add_calibration(self, calibration: Calibration, *, use: bool) -> int:
        """Store a calibration under the next number and return that; `use` puts it in use."""
        number = max(self.calibration_numbers(), default=0) + 1
        write_json(self.calibration_path(number), calibration.to_json())
        if use:
            self.meta["calibration"] = number
            self.save_meta()
        return number

    def solve_folder(self, name: str) -> Path:
        """Return the folder of a solve, which need not exist.

        Raises:
            TakeError: a name that is not allowed.
        """
        return inside(self.path / "solves", check_name("solve", name))

    def solve_names(self) -> list[str]:
        """Names of the solves with poses, in alphabetical order."""
        solves = self.path / "solves"
        found = {
            file.relative_to(solves).parts[0] for deep in ("*/", "*/*/") for file in solves.glob(deep + POSES)
        }
        return sorted(name for name in found if is_safe_name(name))

    def performer_names(self, solve: str) -> list[str]:
        """Names of the performers of a solve of several, in order of entry; empty for a solve of one.

        Raises:
            TakeError: a name that is not allowed.
        """
        return _in_order(self.solve_folder(solve).glob(f"*/{POSES}"))

    def all_performers(self) -> list[str]:
        """Names of the performers of all solves of several, in order of entry; empty for one."""
        return _in_order((self.path / "solves").glob(f"*/*/{POSES}"))

    def performer_folder(self, solve: str, performer: str | None = None) -> Path:
        """Return the folder with the poses of a solve's performer, by name as given or `performer_1`, ...; the first
        where None.

        Raises:
            TakeError: a name that is not allowed, or no such performer.
        """
        folder, names = self.solve_folder(solve), self.performer_names(solve)
        if performer is None:
            return folder / names[0] if names else folder
        performer = performer_by_name(self.meta, performer)
        if performer not in (names or [PERFORMER]):
            raise TakeError(
                "take.no_performer",
                "solve {solve!r} of {take} has no performer {name!r}; it has: {others}",
                solve=solve,
                take=self.path,
                name=performer,
                others=names or [PERFORMER],
            )
        return folder / performer if names else folder


def _in_order(poses: Iterable[Path]) -> list[str]:
    """Return the names of performers with these poses, in order of entry."""
    names = {file.parent.name for file in poses}
    return sorted((name for name in names if is_safe_name(name)), key=lambda name: (len(name), name))


def _numbers(files: Iterable[Path]) -> list[int]:
    return sorted(int(file.stem) for file in files if file.stem.isascii() and file.stem.isdigit())


def read_calibration(file: Path) -> Calibration:
    """Return the calibration in a JSON file.

    Raises:
        CalibrationError: the file is missing or cannot be read.
    """
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise CalibrationError(
            "take.calibration_unreadable",
            "calibration {path} cannot be read ({error}); calibrate again",
            path=file,
            error=error,
        ) from error
    try:
        return Calibration.from_json(value)
    except CalibrationError as error:
        raise CalibrationError(about(str(file), error.sentence)) from error


def _not_made(path: Path, error: OSError) -> TakeError:
    """Return the error for a folder in which the system refuses to make a take."""
    return TakeError(
        "take.not_made",
        "cannot make a take at {path}: {error}; choose another folder",
        path=path,
        error=system_says(error),
    )


def check_free(path: Path) -> None:
    """Raise TakeError if `path` is a file or a folder that is not empty."""
    try:
        taken = path.exists() and (not path.is_dir() or any(path.iterdir()))
    except OSError as error:
        raise _not_made(path, error) from error
    if taken:
        raise TakeError(
            "take.not_empty", "{path} exists and is not empty; choose another folder or delete it", path=path
        )


def check_meta(file: Path, meta: Any) -> None:
    """Raise TakeError if the content of a `take.json` is not that of a take of this version."""
    if not isinstance(meta, dict) or "format_version" not in meta:
        raise TakeError(
            "take.json_other",
            "{file} is not the take.json of a take; run `studio doctor` to rebuild it",
            file=file,
        )
    version = meta["format_version"]
    if version != FORMAT_VERSION:
        raise TakeVersionError(
            "take.version",
            "{path} has format version {version!r}, this program reads version {own}; open the "
            "take with the version that made it",
            path=file,
            version=version,
            own=FORMAT_VERSION,
        )
    kinds: dict[str, type | tuple[type, ...]] = {
        "session": str,
        "name": str,
        "created": str,
        "source": str,
        "recording": str,
        "cameras": list,
        "calibration": (int, type(None)),
        "calibration_s": (int, float, type(None)),
    }
    wrong = [key for key, kind in kinds.items() if key not in meta or not isinstance(meta[key], kind)]
    cameras = meta.get("cameras")
    if isinstance(cameras, list) and not all(
        isinstance(c, dict) and isinstance(c.get("name"), str) and isinstance(c.get("boot_ids"), list)
        for c in cameras
    ):
        wrong.append("cameras")
    if wrong:
        raise TakeError(
            "take.fields",
            "{path} lacks or misuses {names}; run `studio doctor` to rebuild it from raw.mcap",
            path=file,
            names=[*wrong],
        )
