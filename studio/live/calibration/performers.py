"""Performer profiles: measured proportions, `sessions/performers/<name>.json`, for later sessions."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.files import write_json
from studio.engine.base.versions import PERFORMER
from studio.engine.model.calibration import Performer, PerformerJson, performer_from_json, performer_to_json
from studio.take.folder.names import check_name, inside, is_safe_name
from studio.take.folder.take import utc_now

FOLDER = "performers"

_SAME_M = 0.010
"""Largest mean difference of bones that were measured twice of one person."""

_CLEAR_M = 0.003
"""Least lead of the nearest profile over the second nearest [m]; with less, neither is recognised."""


class ProfileJson(PerformerJson):
    """A performer's profile as stored: name, when it was measured (ISO 8601, UTC), proportions."""

    name: str
    measured: str


@dataclass(frozen=True)
class Profile:
    """A performer's profile: name, when it was measured (ISO 8601, UTC), proportions."""

    name: str
    measured: str
    performer: Performer

    def to_json(self) -> ProfileJson:
        """Return the profile as in the API."""
        return {"name": self.name, "measured": self.measured, **performer_to_json(self.performer)}


def save_profile(sessions: Path, name: str, performer: Performer) -> Profile:
    """Store a performer's proportions; an older profile of that name is replaced.

    Raises:
        TakeError: a name that is not allowed.
        StudioError: the folder cannot be written.
    """
    profile = Profile(check_name("performer", name), utc_now(), performer)
    write_json(_path(sessions, name), PERFORMER.stamped(profile.to_json()))
    return profile


def load_profile(sessions: Path, name: str) -> Profile:
    """Return a performer's profile.

    Raises:
        TakeError: there is none of that name, or it cannot be read.
    """
    path = _path(sessions, check_name("performer", name))
    if not path.is_file():
        known = ", ".join(profile.name for profile in list_profiles(sessions)) or "none yet"
        raise TakeError(
            "performer.not_measured",
            "there is no performer {name!r}; measured so far: {known}",
            name=name,
            known=known,
        )
    try:
        value = PERFORMER.current(json.loads(path.read_text(encoding="utf-8")), path)
        return Profile(name, str(value["measured"]), performer_from_json(value))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, FormatError) as error:
        raise TakeError(
            "performer.unreadable",
            "performer {name!r} cannot be read ({error!r}); measure again",
            name=name,
            error=error,
        ) from error


def list_profiles(sessions: Path) -> list[Profile]:
    """Return all profiles that can be read, by name."""
    found = []
    for path in sorted((sessions / FOLDER).glob("*.json")):
        if is_safe_name(path.stem):
            try:
                found.append(load_profile(sessions, path.stem))
            except TakeError:
                continue  # reported when it is requested by name
    return found


def recognised_profile(profiles: list[Profile], performer: Performer) -> Profile | None:
    """Return the profile whose bones a measured performer has; None if no profile fits, or two fit similarly well."""
    bones = performer.bones_m()
    far_m = sorted(
        (
            (float(np.mean([abs(m - bones[name]) for name, m in one.performer.bones_m().items()])), one)
            for one in profiles
        ),
        key=lambda pair: pair[0],
    )
    if not far_m or far_m[0][0] > _SAME_M or (len(far_m) > 1 and far_m[1][0] - far_m[0][0] < _CLEAR_M):
        return None
    return far_m[0][1]


def has_profile(sessions: Path, name: str) -> bool:
    """Whether there is a profile of that name."""
    return _path(sessions, name).is_file()


def delete_profile(sessions: Path, name: str) -> None:
    """Delete a profile.

    Raises:
        TakeError: there is none of that name.
    """
    path = _path(sessions, check_name("performer", name))
    if not path.is_file():
        raise TakeError("performer.none", "there is no performer {name!r}", name=name)
    path.unlink()


def _path(sessions: Path, name: str) -> Path:
    return inside(sessions / FOLDER, f"{name}.json")
