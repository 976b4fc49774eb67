"""Each body's share of the clusters when several bodies are followed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.bodies.cells import (
    MARGIN_M,
    SEED_M,
    PlacedBodies,
    cells_of,
    distances_of,
    shared_out,
)
from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.fit import BodyShape, Fitter
from studio.engine.seeing.tracker.person import LOOKED_AT, near_body
from studio.engine.seeing.tracker.view import CameraView, ImageClusters

_CLOSELY = 3 * LOOKED_AT
"""Number of points of each cluster that are tested, because it may contain an arm of somebody else."""
_REACH_M = 4.0
"""Largest distance of a person from the middle of their cluster, which may contain several people [m]."""


@dataclass
class Share:
    """One body's share of the images of one instant.

    Attributes:
        seen: images by camera; cells of other bodies are in no cluster.
        chosen: the clusters with a part of the body, by camera.
        aside_m2: area of each cluster that is not near the body [m2], by camera.
    """

    seen: dict[str, ImageClusters]
    chosen: dict[str, NDArray[np.bool_]]
    aside_m2: dict[str, NDArray[np.float64]]


def share_of_one(
    views: Mapping[str, CameraView],
    seen: Mapping[str, ImageClusters],
    fitter: Fitter,
    figure: BodyShape,
    pose: Pose,
) -> Share:
    """Return the share of a body that is followed alone."""
    share = Share(dict(seen), {}, {})
    for name, view in seen.items():
        near = near_body(view, fitter, figure, pose, views[name].eye)
        share.chosen[name] = near.alone()
        share.aside_m2[name] = near.aside_m2(view)
    return share


def shares_of(
    views: Mapping[str, CameraView],
    seen: Mapping[str, ImageClusters],
    fitter: Fitter,
    bodies: Sequence[tuple[BodyShape, Pose]],
) -> list[Share]:
    """Return the share of each of several bodies; a cluster that several touch is divided between them.

    Args:
        bodies: figures and expected poses.
    """
    shares = [Share({}, {}, {}) for _ in bodies]
    placed = PlacedBodies.of(fitter, bodies)
    for name, view in seen.items():
        nears = [
            near_body(view, fitter, *body, views[name].eye, looked_at=_CLOSELY, reach_m=_REACH_M)
            for body in bodies
        ]
        touched = np.stack([near.touched() for near in nears])
        several = touched.sum(axis=0) > 1
        chosen = np.where(several, touched, np.stack([near.alone() for near in nears]))
        aside_m2 = np.stack([near.aside_m2(view) for near in nears]).min(axis=0)
        for share, mine, own in zip(shares, chosen, _parted(view, several, placed), strict=True):
            share.seen[name], share.chosen[name], share.aside_m2[name] = own, mine, aside_m2
    return shares


def _parted(view: ImageClusters, several: NDArray[np.bool_], placed: PlacedBodies) -> list[ImageClusters]:
    """Return, for each body, the clusters without the cells of other bodies.

    Args:
        several: clusters to divide, shape (cluster_count,).
    """
    if not several.any():
        return [view] * placed.count
    cells = cells_of(view.clusters.labels, several)
    distance = distances_of(view.points, cells, placed)
    owner = shared_out(view.depth, view.clusters.labels, cells, distance, SEED_M, MARGIN_M)
    parts = []
    for body in range(placed.count):
        labels = view.clusters.labels.copy()
        others = cells[owner != body]
        labels[others[:, 0], others[:, 1]] = -1
        parts.append(replace(view, clusters=view.clusters._replace(labels=labels)))
    return parts
