"""The rigid bodies and markers of a take at any time of its replay."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from studio.engine.base.errors import StudioError
from studio.engine.model.rigid_body import PlacedBody, PlacedMarkers
from studio.engine.rigid_bodies.known import KnownBody, TakeBodies
from studio.engine.rigid_bodies.markers import MarkerTracks
from studio.engine.rigid_bodies.tracks import BodyTrack, BodyTracks
from studio.take.folder.solved import SolvedPerformer
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import take_bodies
from studio.take.rigid_bodies.used import prop_in_hand, stage_bodies, stage_markers

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReplayedBodies:
    """The bodies of a take on the stage, what they are, and its markers on the stage."""

    tracks: BodyTracks = field(default_factory=BodyTracks)
    known: TakeBodies = field(default_factory=TakeBodies)
    markers: MarkerTracks = field(default_factory=MarkerTracks)

    @classmethod
    def of(cls, take: Take, performers: Sequence[SolvedPerformer] = ()) -> "ReplayedBodies":
        """Return those of a take; as in exports, props are tied to the hands of a solve's performers that hold them.
        None are returned if a file is damaged."""
        try:
            known = take_bodies(take)
            found = stage_bodies(take, known)
            props = [one for one in known.bodies if one.use == "prop" and one.name in found.tracks]
            held = {
                one.name: _in_hand(found.tracks[one.name], one, performers) for one in props if performers
            }
            markers = stage_markers(take, known)
            return cls(BodyTracks({**found.tracks, **held}, found.on_stage), known, markers)
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

    def markers_at(self, time_s: float) -> PlacedMarkers | None:
        """Return the markers that were seen at a stage time [s]; None = none."""
        return self.markers.at(time_s)


def _in_hand(track: BodyTrack, body: KnownBody, performers: Sequence[SolvedPerformer]) -> BodyTrack:
    """Return a prop's motion at those instants of a solve at which it was seen; unchanged if it was seen at none."""
    poses = prop_in_hand(body.name, track, body, performers)
    seen = poses.confidence[:, 0] > 0
    if not seen.any():
        return track
    return BodyTrack(poses.time_s[seen], poses.positions_m[seen, 0], poses.rotations_wxyz[seen, 0])


NO_BODIES = ReplayedBodies()
