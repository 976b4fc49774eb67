"""Performers known by their bones when a take of several performers was recorded, in `take.json`."""

from collections.abc import Iterable

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.identity.known import KnownPerson
from studio.engine.model.calibration import performer_from_json, performer_to_json
from studio.engine.model.joints import CANONICAL, JOINT_COUNT
from studio.take.folder.meta import TakePerformerMeta
from studio.take.folder.take import Take


def performers_meta(people: Iterable[KnownPerson]) -> list[TakePerformerMeta]:
    """Return people as `take.json` has them."""
    return [
        {
            "number": one.performer,
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
