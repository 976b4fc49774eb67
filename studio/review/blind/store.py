"""Tests and votes on disk: `sessions/blind/<id>/` with test.json, key.json, animations/ and votes.jsonl.

A test owns its animations, so later changes of solves do not affect it. `key.json` maps animations to solves, with
the hashes of the files. Its own hash, the seal, is in `test.json` from the beginning, as evidence that nothing was
changed. A vote is a line that is on disk before it is confirmed.
"""

import hashlib
import json
import os
import shutil
from pathlib import Path

import msgspec

from studio.engine.base.errors import FormatError, StudioError, TakeError
from studio.engine.base.files import write_atomically, write_json
from studio.engine.base.sentences import system_says
from studio.review.blind.model import BlindTest, Side, from_json
from studio.take.folder.names import check_name, inside

FOLDER = "blind"


class VoteEvent(msgspec.Struct, frozen=True):
    """A line of votes.jsonl: a voter joined, or voted.

    Attributes:
        voter: number of the voter, from 0 in the order of joining.
        at: ISO 8601, UTC.
        key_hash: hash of a joining voter's secret; name: their name or code.
        slot: position in the voter's order; -1 for joining.
        choice: `left`, `right` or `none`; empty for joining.
        watched_s: time for which the pair was on the screen; comment: the voter's text.
    """

    voter: int
    at: str
    key_hash: str = ""
    name: str = ""
    slot: int = -1
    choice: str = ""
    watched_s: float = 0.0
    comment: str = ""


class KeySide(Side, frozen=True, kw_only=True):
    """An animation, and the SHA-256 of its file."""

    sha256: str


class KeyPair(msgspec.Struct, frozen=True):
    """A pair of the key: its index and its animations `a` and `b`."""

    pair: int
    a: KeySide
    b: KeySide


class Key(msgspec.Struct, frozen=True):
    """Content of `key.json`: the test's id, title, time of creation (ISO 8601, UTC) and seed of its draws."""

    test: str
    title: str
    created: str
    seed: int
    pairs: tuple[KeyPair, ...]


class OpenedKey(Key, frozen=True, kw_only=True):
    """A key, the seal of its test, and whether the file still matches the seal."""

    seal: str
    seal_holds: bool


def folder_of(sessions: Path, test_id: str) -> Path:
    """Return a test's folder.

    Raises:
        TakeError: a name that is not allowed.
    """
    return inside(sessions / FOLDER, check_name("test", test_id))


def create(sessions: Path, test: BlindTest, animations: list[tuple[bytes, bytes]]) -> BlindTest:
    """Write a new test with its animations and its sealed key; return it with hashes and seal.

    Raises:
        StudioError: the disk refuses; nothing is left behind.
    """
    folder = folder_of(sessions, test.id)
    hashes = tuple((_sha256(a), _sha256(b)) for a, b in animations)
    key = _key(test, hashes)
    sealed = msgspec.structs.replace(test, animations=hashes, seal=_sha256(key))
    try:
        for index, pair in enumerate(animations):
            for side, data in zip("ab", pair, strict=True):
                with write_atomically(folder / "animations" / f"{index}_{side}.glb") as file:
                    file.write(data)
        with write_atomically(folder / "key.json") as file:
            file.write(key)
        save(sessions, sealed)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return sealed


def _key(test: BlindTest, hashes: tuple[tuple[str, str], ...]) -> bytes:
    pairs = tuple(
        KeyPair(index, *(_key_side(*one) for one in zip((pair.a, pair.b), digests, strict=True)))
        for index, (pair, digests) in enumerate(zip(test.pairs, hashes, strict=True))
    )
    key = Key(test.id, test.title, test.created, test.seed, pairs)
    return json.dumps(msgspec.to_builtins(key), indent=2, ensure_ascii=False).encode()


def _key_side(side: Side, sha256: str) -> KeySide:
    return KeySide(**msgspec.structs.asdict(side), sha256=sha256)


def save(sessions: Path, test: BlindTest) -> None:
    """Write a test's `test.json`.

    Raises:
        StudioError: the disk refuses; the old file stays.
    """
    write_json(folder_of(sessions, test.id) / "test.json", msgspec.to_builtins(test))


def load_all(sessions: Path) -> tuple[list[BlindTest], list[str]]:
    """Return all readable tests, oldest first, and a sentence about each unreadable one."""
    tests, problems = [], []
    for path in sorted((sessions / FOLDER).glob("*/test.json")):
        try:
            tests.append(from_json(json.loads(path.read_text(encoding="utf-8"))))
        except (OSError, ValueError, RecursionError, FormatError) as error:
            problems.append(f"blind test {path.parent.name} cannot be read: {error}")
    return sorted(tests, key=lambda test: test.created), problems


def animation(sessions: Path, test: BlindTest, pair: int, side: str) -> bytes:
    """Return the GLB file of a side, `a` or `b`, as it was when the test was made.

    Raises:
        TakeError: it is missing or was changed.
    """
    path = folder_of(sessions, test.id) / "animations" / f"{pair}_{side}.glb"
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TakeError(
            "blind.animation_gone",
            "animation {name} of test {test} is gone: {error}",
            name=path.name,
            test=test.id,
            error=system_says(error),
        ) from error
    if _sha256(data) != test.animations[pair]["ab".index(side)]:
        raise TakeError(
            "blind.animation_changed",
            "animation {name} of test {test} was changed after the test was made",
            name=path.name,
            test=test.id,
        )
    return data


def read_events(sessions: Path, test_id: str) -> list[VoteEvent]:
    """Return the events of a test; a line that a crash interrupted is skipped."""
    path = folder_of(sessions, test_id) / "votes.jsonl"
    if not path.is_file():
        return []
    events = []
    for line in path.read_bytes().split(b"\n"):
        try:
            events.append(msgspec.json.decode(line, type=VoteEvent))
        except msgspec.DecodeError:
            continue
    return events


def append_event(sessions: Path, test_id: str, event: VoteEvent) -> None:
    """Add a line; it is on disk when this returns.

    Raises:
        StudioError: the disk refuses.
    """
    path = folder_of(sessions, test_id) / "votes.jsonl"
    try:
        with path.open("ab") as file:
            if file.tell() > 0 and not _ends_with_line(path):
                file.write(b"\n")  # keeps an interrupted line separate
            file.write(msgspec.json.encode(event) + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise StudioError(
            "blind.vote_not_kept",
            "the vote could not be kept: {error}; free some space and vote again",
            error=system_says(error),
        ) from error


def _ends_with_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"


def read_key(sessions: Path, test: BlindTest) -> OpenedKey:
    """Return the key of a test.

    Raises:
        TakeError: it cannot be read.
    """
    try:
        data = (folder_of(sessions, test.id) / "key.json").read_bytes()
        key = msgspec.json.decode(data, type=Key)
        return OpenedKey(**msgspec.structs.asdict(key), seal=test.seal, seal_holds=_sha256(data) == test.seal)
    except (OSError, ValueError) as error:
        raise TakeError(
            "blind.key_unreadable",
            "the key of test {test} cannot be read: {error}",
            test=test.id,
            error=error,
        ) from error


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
