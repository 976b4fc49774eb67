"""Result of a calibration of ordinary cameras."""

from dataclasses import dataclass, field

import numpy as np

from studio.engine.base.geometry import make_transform
from studio.engine.base.sentences import about
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.model.calibration import Performer
from studio.engine.model.cameras.lens import Lens

NOWHERE = make_transform(
    np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), np.array([0.0, 0.0, 1.2])
)
"""Pose of a camera that was refused at once: upright at eye level, over the stage's origin."""

VERDICTS = ("good", "usable", "refused")
"""Verdicts from best to worst."""


@dataclass(frozen=True)
class Rests:
    """Residuals of a camera's landmarks after the adjustment.

    Attributes:
        mean_mrad, median_mrad, p95_mrad: as angles [mrad].
        mean_px, median_px, p95_px: [pixel].
        median_mm, p95_mm: across the line of sight, at the joint [mm].
        count: number of landmarks.
    """

    mean_mrad: float = np.nan
    median_mrad: float = np.nan
    p95_mrad: float = np.nan
    mean_px: float = np.nan
    median_px: float = np.nan
    p95_px: float = np.nan
    median_mm: float = np.nan
    p95_mm: float = np.nan
    count: int = 0


@dataclass(frozen=True)
class Uncertain:
    """Standard deviations of a camera's parameters, from the adjustment; 0 = given.

    Attributes:
        place_m: of the camera's place relative to the first camera, not counting the overall scale [m].
        turn_deg: of its direction relative to the first camera.
        focal_share: of its focal length, as a share of it.
        ahead_s: of its clock [s].
    """

    place_m: float = 0.0
    turn_deg: float = 0.0
    focal_share: float = 0.0
    ahead_s: float = 0.0


@dataclass(frozen=True)
class PlacedView:
    """One calibrated camera.

    Attributes:
        T_stage_camera: 4x4, camera points to stage points [m]; the stage has z up and its floor at z = 0.
        lens: as given, or as found.
        ahead_s: what is added to the camera's stamps to give the first camera's clock [s].
        rests: residuals of its landmarks.
        uncertain: standard deviations of its parameters.
        swapped: share of its frames in which left and right of arms or legs were swapped.
        coverage: share of the instants at which it saw the performer; None = unknown.
        verdict: `good`, `usable` or `refused`; `reasons` says why.
    """

    T_stage_camera: Array
    lens: Lens
    ahead_s: float = 0.0
    rests: Rests = field(default_factory=Rests)
    uncertain: Uncertain = field(default_factory=Uncertain)
    swapped: float = 0.0
    coverage: float | None = None
    verdict: str = "good"
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class ViewsResult:
    """Calibrated cameras and the performer that they saw.

    Attributes:
        cameras: by name, in the given order.
        times_s: instants on the first camera's clock [s], shape (instant_count,).
        joints_m: canonical joints at the instants, stage frame [m], shape (instant_count, 21, 3); NaN = unknown.
        bones_m: length of the bones that were held constant [m], by name.
        performer: his proportions; None if too little of him was seen.
        scale_known: whether the performer's height was given; otherwise 1.75 m is assumed.
    """

    cameras: dict[str, PlacedView]
    times_s: Array
    joints_m: Array
    bones_m: dict[str, float]
    performer: Performer | None
    scale_known: bool

    @property
    def verdict(self) -> str:
        """The worst of the cameras' verdicts."""
        return max((camera.verdict for camera in self.cameras.values()), key=VERDICTS.index)

    @property
    def reasons(self) -> tuple[str, ...]:
        """All cameras' reasons, each with the camera's name."""
        return tuple(about(name, one) for name, camera in self.cameras.items() for one in camera.reasons)
