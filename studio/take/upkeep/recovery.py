"""Repair of a take after a crash: a finished `raw.mcap` from the readable part, a rebuilt `take.json`.

Nothing is lost: a damaged file stays next to its repaired successor (`raw.damaged.mcap`, `take.damaged.json`).
"""

import os
import shutil
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from mcap.records import Channel, Message
from mcap.writer import CompressionType, Writer

from studio import wire
from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.base.sentences import system_says
from studio.take.folder.lock import is_held
from studio.take.folder.names import is_safe_name
from studio.take.folder.take import Take, TakeVersionError, new_meta, read_calibration
from studio.take.raw.frames import CHUNK_BYTES, RawReader, inspect_raw
from studio.take.raw.records import PROFILE, RawCamera, RawEvent

TEMPORARY_PREFIX = ".raw.recovered-"


def recover(path: str | Path) -> Take:
    """Return a take whose raw recording is finished and whose `take.json` fits it, with state `recovered`.

    Args:
        path: the take's folder; `take.json` may be missing or broken where there is a `raw.mcap`.

    Raises:
        TakeError: the take is being recorded, was written in another version, or has neither a readable
            `take.json` nor a `raw.mcap`.
    """
    path = Path(path)
    raw = path / "raw.mcap"
    if raw.is_file() and is_held(raw):
        raise TakeError(
            "take.recording_under_way", "{path} is being recorded; stop the recording first", path=path
        )
    try:
        take = Take.open(path)
    except TakeVersionError:
        raise
    except TakeError:
        take = None
    if raw.is_file() and not inspect_raw(raw).complete:
        rewrite_raw(raw)
    if take is None:
        take = rebuild_meta(path)
    if raw.is_file():
        for hello in inspect_raw(raw).hellos:
            take.add_camera(hello)
    take.meta["recording"] = "recovered"
    take.save_meta()
    return take


def rewrite_raw(raw: Path) -> Path:
    """Replace a damaged `raw.mcap` by a finished file of its readable part; return the path of the damaged one.

    Frames and events keep their bytes, times and order. `raw.mcap` exists at every instant.

    Raises:
        TakeError: the folder cannot be written.
    """
    handle, name = tempfile.mkstemp(prefix=TEMPORARY_PREFIX, suffix=".mcap", dir=raw.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            _copy_records(RawReader(raw), file)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        kept = _free_name(raw.with_name("raw.damaged.mcap"))
        _keep(raw, kept)
        os.replace(temporary, raw)
    except OSError as error:
        raise TakeError(
            "take.not_repaired",
            "cannot repair {path}: {error}; free space or check the rights",
            path=raw,
            error=system_says(error),
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
    return kept


def _copy_records(reader: RawReader, file: IO[bytes]) -> None:
    writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile=PROFILE, library=PROFILE)
    channels: dict[int, int] = {}
    for record, _ in reader.pairs():
        if isinstance(record, Channel):
            channels[record.id] = _register(writer, record)
        elif isinstance(record, Message):
            if record.channel_id not in channels:
                channels[record.channel_id] = _register(writer, reader.channels[record.channel_id])
            writer.add_message(
                channels[record.channel_id],
                log_time=record.log_time,
                data=record.data,
                publish_time=record.publish_time,
                sequence=record.sequence,
            )
    writer.finish()


def _register(writer: Writer, channel: Channel) -> int:
    return writer.register_channel(channel.topic, channel.message_encoding, 0, channel.metadata)


def _free_name(path: Path) -> Path:
    """Return `path`, or the first of `<stem>.2<suffix>`, `.3`, ... that does not exist."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f"{path.stem}.{number}{path.suffix}")
    return free


def _keep(file: Path, kept: Path) -> None:
    """Link a file under a second name; copy it on a disk without links."""
    try:
        os.link(file, kept)
    except OSError:
        shutil.copy2(file, kept)


def rebuild_meta(path: Path) -> Take:
    """Return the take with a new `take.json` made from `raw.mcap` and the folders; a damaged one stays.

    Data that was only in `take.json` is lost: performer, notes, rating, and the end of the calibration part.

    Raises:
        TakeError: written in another version, or no `raw.mcap`.
    """
    file, raw = path / "take.json", path / "raw.mcap"
    if not raw.is_file():
        raise TakeError(
            "take.nothing_left",
            "{path} has neither a readable take.json nor a raw.mcap; delete it",
            path=path,
        )
    reader = RawReader(raw)
    hellos: list[wire.Hello] = []
    live = False
    for record in reader:
        if isinstance(record, RawEvent):
            live = True
        elif isinstance(record, RawCamera):
            hellos.append(record.hello)
    if file.exists():
        os.replace(file, _free_name(path / "take.damaged.json"))
    imported = not live and all(hello.boot_id == "import" for hello in hellos)
    resolved = path.resolve()
    session = resolved.parent.name if is_safe_name(resolved.parent.name) else "takes"
    name = resolved.name if is_safe_name(resolved.name) else "take"
    created = datetime.fromtimestamp(raw.stat().st_mtime, UTC).isoformat(timespec="seconds")
    meta = new_meta(
        session=session,
        name=name,
        source="import" if imported else "live",
        notes="take.json was rebuilt from raw.mcap; performer, notes and calibration_s are lost",
        created=created,
    )
    take = Take(path, meta)
    for hello in hellos:
        take.add_camera(hello)
    take.meta["calibration"] = _last_good_calibration(take)
    take.meta["recording"] = "recovered"
    take.save_meta()
    return take


def _last_good_calibration(take: Take) -> int | None:
    for number in reversed(take.calibration_numbers()):
        try:
            calibration = read_calibration(take.calibration_path(number))
        except CalibrationError:
            continue
        if not calibration.refused:
            return number
    return None
