"""The rigid bodies of a take at any time of its replay."""

import logging
from dataclasses import dataclass, field

import numpy as np

from studio.engine.base.errors import StudioError
from studio.engine.model.rigid_body import PlacedBody
from studio.engine.rigid_bodies.known import TakeBodies
from studio.engine.rigid_bodies.tracks import BodyTracks
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import take_bodies
from studio.take.rigid_bodies.used import stage_bodies

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReplayedBodies:
    """The bodies of a take on the stage, and what they are."""

    tracks: BodyTracks = field(default_factory=BodyTracks)
    known: TakeBodies = field(default_factory=TakeBodies)

    @classmethod
    def of(cls, take: Take) -> "ReplayedBodies":
        """Return those of a take; none where a file is damaged."""
        try:
            known = take_bodies(take)
            return cls(stage_bodies(take, known), known)
        except StudioError as error:
            _log.warning("%s", error)
            return NO_BODIES

    def at(self, time_s: float) -> tuple[PlacedBody, ...]:
        """Return the bodies that were seen at a stage time [s]."""
        found, at_s = [], np.array([time_s])
        for name, track in self.tracks.tracks.items():
            positions, rotations = track.at(at_s)
            if np.isfinite(positions).all():
                one = self.known.named(name)
                said = ("", None) if one is None else (one.use, one.shape)
                found.append(PlacedBody(name, positions[0], rotations[0], *said))
        return tuple(found)


NO_BODIES = ReplayedBodies()
