"""The markers of a take put on joints, and written for `studio evaluate` and for other programs."""

from pathlib import Path

import msgspec
import numpy as np

from studio.engine.animation.export.c3d import write_points_c3d
from studio.engine.animation.export.points import LabelledPoints
from studio.engine.animation.read.landmarks import MARKER_ENDING
from studio.engine.animation.read.points import NamedPoints
from studio.engine.base.errors import SettingsError
from studio.engine.metrics.reference.points_csv import write_points_csv
from studio.engine.model.joints import INDEX
from studio.engine.rigid_bodies.known import TakeBodies, bad_value
from studio.engine.rigid_bodies.markers import MarkerTracks
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import save_take_bodies, take_bodies, take_markers
from studio.take.rigid_bodies.used import stage_markers

RATE_HZ = 120.0
KINDS = (".csv", ".c3d")


def name_marker(take: Take, name: str, joint: str) -> TakeBodies:
    """Put a marker of a take on a canonical joint, "" = none; return the descriptions.

    Raises:
        SettingsError: no such joint, or another marker of the same asset sits on it.
    """
    if joint and joint not in INDEX:
        raise bad_value("joint", joint[:80], ", ".join(INDEX))
    known = take_bodies(take)
    asset = name.rpartition(":")[0]
    markers = {other: on for other, on in known.markers.items() if other != name}
    taken = [other for other, on in markers.items() if on == joint and other.rpartition(":")[0] == asset]
    if joint and taken:
        raise SettingsError(
            "rigid.marker_joint",
            "{joint} has the marker {other} already; take it away first: studio rigid TAKE set {other} joint=",
            joint=joint,
            other=taken[0],
        )
    if joint:
        markers[name] = joint
    found = msgspec.structs.replace(known, markers=markers)
    save_take_bodies(take, found)
    return found


def marker_points(take: Take, asset: str | None = None) -> NamedPoints:
    """Return a take's markers on the stage, on its clock, at 120 Hz; one on a joint has the joint's name.

    Args:
        take: whose markers.
        asset: only the markers of this one; None = of all.

    Raises:
        SettingsError: no marker with a name was received, or none of this asset.
        FormatError: a file is damaged.
    """
    known = take_bodies(take)
    markers = stage_markers(take, known)
    if asset is not None:
        markers = markers.of_asset(asset)
    if not markers.names or len(markers.time_s) < 2:
        raise SettingsError(
            "rigid.no_markers",
            "no marker with a name came in while this take was recorded, or none of {asset}; there are: {assets}",
            asset=asset or "any",
            assets=", ".join(assets_of(take_markers(take))) or "none",
        )
    time_s, places = markers.on_grid(RATE_HZ)
    return NamedPoints(time_s, tuple(_label(known, name) for name in markers.names), places)


def _label(known: TakeBodies, name: str) -> str:
    asset, colon, _ = name.rpartition(":")
    joint = known.markers.get(name)
    return name if joint is None else f"{asset}{colon}{joint}{MARKER_ENDING}"


def assets_of(markers: MarkerTracks) -> list[str]:
    """Return the names of the assets that the markers sit on."""
    return list(dict.fromkeys(name.rpartition(":")[0] for name in markers.names))


def write_markers(take: Take, path: Path, asset: str | None = None) -> NamedPoints:
    """Write a take's markers as CSV, on the stage clock, or C3D, which begins at 0; return them.

    Raises:
        SettingsError: a file of another kind; else as `marker_points`.
        FormatError, NotAvailableError, StudioError: it cannot be written.
    """
    if path.suffix.lower() not in KINDS:
        raise bad_value("FILE", path.name, " or ".join(KINDS))
    points = marker_points(take, asset)
    if path.suffix.lower() == ".csv":
        write_points_csv(path, points.time_s, points.names, points.positions_m)
    else:
        unknown = np.full(points.positions_m.shape[:2], np.nan)
        write_points_c3d(LabelledPoints(points.names, points.positions_m, unknown), RATE_HZ, path)
    return points
