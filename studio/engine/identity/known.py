"""Performers known from before, with whom a new pipeline begins."""

from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.identity.person import FollowedPerson
from studio.engine.model.calibration import Performer, PerformerJson, performer_from_json, performer_to_json
from studio.engine.model.joints import JOINT_COUNT


class KnownPersonJson(TypedDict):
    """A `KnownPerson` as stored; unknown numbers are null."""

    performer: int
    proportions: PerformerJson | None
    bones_m: list[float]
    joints_m: list[list[float]]
    seen_s: float | None


@dataclass(frozen=True)
class KnownPerson:
    """A performer known from before.

    Attributes:
        performer: their number, from 1.
        proportions: None = those of the calibration.
        bones_m: see `FollowedPerson.bones_m`, shape (21,).
        joints_m: their last joints, stage frame [m], shape (21, 3).
        seen_s: time of these joints, stage time [s]; None = they are away.
    """

    performer: int
    proportions: Performer | None
    bones_m: NDArray[np.float64]
    joints_m: NDArray[np.float64]
    seen_s: float | None

    def away(self) -> "KnownPerson":
        """Return the same performer with only the bones known."""
        return replace(self, joints_m=np.full((JOINT_COUNT, 3), np.nan), seen_s=None)

    def person(self) -> FollowedPerson:
        """Return the person to follow."""
        if self.seen_s is None:
            return FollowedPerson.known(self.bones_m)
        return FollowedPerson.known(self.bones_m, self.joints_m, self.seen_s)

    def to_json(self) -> KnownPersonJson:
        """Return the performer as JSON."""
        return {
            "performer": self.performer,
            "proportions": None if self.proportions is None else performer_to_json(self.proportions),
            "bones_m": self.bones_m.tolist(),
            "joints_m": self.joints_m.tolist(),
            "seen_s": self.seen_s,
        }

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> "KnownPerson":
        """Return the performer in JSON of `to_json`.

        Raises:
            FormatError: a value is missing or is no number.
        """
        try:
            proportions, seen_s = value["proportions"], value["seen_s"]
            bones = np.array(value["bones_m"], dtype=np.float64)
            joints = np.array(value["joints_m"], dtype=np.float64)
            if bones.shape != (JOINT_COUNT,) or joints.shape != (JOINT_COUNT, 3):
                raise ValueError(f"{bones.shape} bones and {joints.shape} joints")
            return cls(
                int(value["performer"]),
                None if proportions is None else performer_from_json(proportions),
                bones,
                joints,
                None if seen_s is None else float(seen_s),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise FormatError(
                "take.known_person", "a performer that cannot be read: {error!r}", error=error
            ) from error
