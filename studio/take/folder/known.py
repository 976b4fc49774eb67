"""Who was known when a take was recorded on a stage of several: names and bones, in `take.json`."""

from collections.abc import Callable, Iterable

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.identity.known import KnownPerson
from studio.engine.model.calibration import performer_from_json, performer_to_json
from studio.engine.model.joints import CANONICAL, JOINT_COUNT
from studio.take.folder.meta import TakePerformerMeta
from studio.take.folder.performers import performer_number
from studio.take.folder.take import Take


def performers_meta(people: Iterable[KnownPerson], name_of: Callable[[int], str]) -> list[TakePerformerMeta]:
    """Return people as `take.json` has them; `name_of` returns what a performer is called, by number."""
    return [
        {
            "number": one.performer,
            "name": name_of(one.performer),
            "proportions": None if one.proportions is None else performer_to_json(one.proportions),
            "bones_m": {
                joint: round(float(length), 5)
                for joint, length in zip(CANONICAL, one.bones_m, strict=True)
                if np.isfinite(length)
            },
        }
        for one in people
    ]


def known_people(take: Take) -> list[KnownPerson]:
    """Return the performers who were known when the take was recorded; all are away.

    Raises:
        FormatError: they cannot be read.
    """
    out: list[KnownPerson] = []
    for one in take.meta.get("performers", []):
        try:
            proportions, bones = one["proportions"], one["bones_m"]
            out.append(
                KnownPerson(
                    int(one["number"]),
                    None if proportions is None else performer_from_json({**proportions}),
                    np.array([float(bones.get(joint, np.nan)) for joint in CANONICAL]),
                    np.full((JOINT_COUNT, 3), np.nan),
                    None,
                )
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FormatError(
                "take.known_person", "a performer that cannot be read: {error!r}", error=error
            ) from error
    return out


def performer_names(take: Take) -> dict[int, str]:
    """Return what performers are called in a take, by number; who has no name of their own is left out."""
    named = {int(one["number"]): str(one["name"]) for one in take.meta.get("performers", []) if "name" in one}
    given = {performer_number(key): name for key, name in take.meta.get("performer_names", {}).items()}
    return {**named, **given}
