"""The result of a calibration, and its JSON: each camera's pose, clock and quality, and the performer's
proportions."""

import math
from dataclasses import dataclass, field
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError
from studio.engine.base.geometry import is_rigid
from studio.engine.base.sentences import Sentence, about, codes_of, say, with_codes
from studio.engine.base.versions import CALIBRATION
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import CANONICAL, INDEX, LIMB_ROOTS, PARENTS, USUAL_TRUNK
from studio.engine.model.spans import Span, SpanJson

LONGEST_READOUT_MS = 100.0


@dataclass(frozen=True)
class Performer:
    """Proportions of a performer, measured from the joints.

    Attributes:
        height_m: standing height, floor to top of the head [m].
        offsets_m: T-pose position of each canonical joint minus its parent's (`joints.PARENTS`), stage axes
            (facing -y, left at +x), shape (21, 3) [m]. The hips' row is their height above the floor on which the
            soles stand.
        soles_measured: the heights of ankles and toes over the floor were measured while standing, or the floor was
            placed under them at usual heights; False = their heights are not tied to the floor yet.
    """

    height_m: float
    offsets_m: NDArray[np.float64]
    soles_measured: bool = False

    @property
    def root_height_m(self) -> float:
        """Height of the hips over the floor in the T-pose [m]."""
        return float(self.offsets_m[INDEX["hips"], 2])

    def trunk_shares(self) -> tuple[float, float]:
        """Places of the hips and the neck between hip joints and shoulders; see `joints.USUAL_TRUNK`."""
        at = self.offsets_m[:, 2].copy()
        for joint, parent in enumerate(PARENTS.tolist()):
            at[joint] = at[joint] + at[parent] if parent >= 0 else 0.0
        low, high = at[INDEX["left_hip"]], at[INDEX["left_shoulder"]]
        return float(-low / (high - low)), float((at[INDEX["neck"]] - low) / (high - low))

    def bone_m(self, name: str) -> float:
        """Length of the bone that ends in a canonical joint [m]."""
        return float(np.linalg.norm(self.offsets_m[INDEX[name]]))

    def bones_m(self) -> dict[str, float]:
        """Length of each bone [m], by the canonical joint at its end."""
        return {name: self.bone_m(name) for name in CANONICAL if name != "hips"}

    def reach_m(self) -> NDArray[np.float64]:
        """Reach of each joint from the shoulder or hip that carries it [m], shape (21,); infinite for those of the
        trunk."""
        reach = np.zeros(len(CANONICAL))
        for joint, (root, parent) in enumerate(zip(LIMB_ROOTS.tolist(), PARENTS.tolist(), strict=True)):
            if joint != root:
                reach[joint] = reach[parent] + np.linalg.norm(self.offsets_m[joint])
        return np.where(LIMB_ROOTS == np.arange(len(CANONICAL)), np.inf, reach)


def trunk_of(performer: Performer | None) -> tuple[float, float]:
    """Return the places of a performer's hips and neck in pictures, `joints.USUAL_TRUNK` for an unknown performer."""
    return USUAL_TRUNK if performer is None else performer.trunk_shares()


@dataclass(frozen=True)
class CameraCalibration:
    """One camera's pose, clock and quality. Figures that were not measured are None.

    Attributes:
        T_stage_camera: 4x4, camera points to stage points [m].
        clock: maps the camera's clock to the stage clock (the reference camera's).
        depth_bias_m: distance of the camera's joints from the joint centres towards the camera, along the ray [m].
        residual_median_mm, residual_p95_mm, residual_pairs: disagreement with the reference camera, over all
            joints that both report, on blocks that were not used for the fit.
        coverage: share of the walked volume that the camera saw, 0..1.
        identity_error: of the reference camera: deviation of its fit to itself from the identity (the thesis's
            check).
        verdict: `good`, `usable` or `refused`; `reasons` says why.
        disagrees: spans of stage time [s] in which the camera did not agree with the others. Neither the calibration
            nor its residuals use them.
        lens: of a camera whose frames are landmarks in pictures; None for cameras that measure points.
        readout_ms: time in which a camera with pictures reads one, from the first row to the last; its stamps are
            those of the middle row. 0 = all rows at once, or not known.
    """

    T_stage_camera: NDArray[np.float64]
    clock: ClockModel = field(default_factory=ClockModel)
    depth_bias_m: float = 0.0
    residual_median_mm: float | None = None
    residual_p95_mm: float | None = None
    residual_pairs: int = 0
    coverage: float | None = None
    identity_error: float | None = None
    verdict: str = "good"
    reasons: tuple[str, ...] = ()
    disagrees: tuple[Span, ...] = ()
    lens: Lens | None = None
    readout_ms: float = 0.0

    def __post_init__(self) -> None:
        if not is_rigid(self.T_stage_camera):
            raise CalibrationError(
                "calibration.not_rigid",
                "T_stage_camera must be a 4x4 rigid transform (orthonormal rotation with determinant "
                "+1, last row 0 0 0 1); calibrate again or mend the file",
            )


class ClockJson(TypedDict):
    """A `ClockModel` as stored: offset [ns] and drift [ppm] to the stage clock, and the time of the offset [ns]."""

    offset_ns: int
    drift_ppm: float
    reference_ns: int


class LensJson(TypedDict):
    """A `Lens` as stored [pixels]; distortion in OpenCV's order, empty = none."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: list[float]


class CameraJson(TypedDict):
    """A `CameraCalibration` as stored; figures that were not measured are null.

    `time_offset_ms` and `clock_drift_ppm` are those of the camera's clock ahead of the stage clock.
    """

    T_stage_camera: list[list[float]]
    residual_median_mm: float | None
    residual_p95_mm: float | None
    residual_pairs: int
    time_offset_ms: float
    clock_drift_ppm: float
    clock: ClockJson
    depth_bias_m: float
    coverage: float | None
    identity_error: float | None
    verdict: str
    reasons: list[str]
    said: list[Sentence]
    disagrees: list[SpanJson]
    intrinsics: LensJson | None
    readout_ms: float


class PerformerJson(TypedDict):
    """A `Performer` as stored: height [m], bone lengths and T-pose offsets [m] by canonical joint."""

    height_m: float
    bones_m: dict[str, float]
    offsets_m: dict[str, list[float]]
    soles_measured: bool


class CalibrationJson(TypedDict):
    """A `Calibration` as stored and as in `calibrate --json`; cameras by name."""

    format_version: int
    reference: str
    performer: PerformerJson | None
    floor_given: bool
    cameras: dict[str, CameraJson]


@dataclass(frozen=True)
class Calibration:
    """A stage's calibration. `cameras` keeps the order of the cameras; `performer` is None until measured.

    Attributes:
        floor_given: the floor was known without the feet (from depth cameras or an earlier calibration), and the
            heights of the performer's soles were measured over it.
    """

    reference: str
    cameras: dict[str, CameraCalibration] = field(default_factory=dict)
    performer: Performer | None = None
    floor_given: bool = False

    @property
    def refused(self) -> bool:
        return any(camera.verdict == "refused" for camera in self.cameras.values())

    @property
    def given(self) -> bool:
        """Whether the cameras were placed by other means (boards, tapes), without measured disagreement."""
        return all(camera.residual_median_mm is None for camera in self.cameras.values())

    def reasons(self) -> list[str]:
        """All cameras' reasons, each with the camera's name."""
        return [about(name, reason) for name, camera in self.cameras.items() for reason in camera.reasons]

    def to_json(self) -> CalibrationJson:
        """Return the calibration as the JSON of `calibrate --json` and of `calibrations/<n>.json`."""
        return {
            "format_version": CALIBRATION.version,
            "reference": self.reference,
            "performer": None if self.performer is None else performer_to_json(self.performer),
            "floor_given": self.floor_given,
            "cameras": {name: _camera_to_json(camera) for name, camera in self.cameras.items()},
        }

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> "Calibration":
        """Return the calibration in `value`; a file with only `cameras.<name>.T_stage_camera` is enough.

        Raises:
            CalibrationError: there is no camera, or a transform is not rigid.
            FormatError: the file has a later version.
        """
        value = CALIBRATION.current(value, "the calibration") if isinstance(value, dict) else value
        cameras = value.get("cameras") if isinstance(value, dict) else None
        if not isinstance(cameras, dict) or not cameras:
            raise CalibrationError(
                "calibration.needs_cameras",
                "a calibration needs `cameras`, an object of cameras by name; none was given",
            )
        try:
            parsed = {str(name): _camera_from_json(camera) for name, camera in cameras.items()}
            performer = value.get("performer")
            return cls(
                reference=str(value.get("reference") or next(iter(parsed))),
                cameras=parsed,
                performer=None if performer is None else performer_from_json(performer),
                floor_given=bool(value.get("floor_given", False)),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise CalibrationError(
                "calibration.unreadable", "a calibration that cannot be read: {error!r}", error=error
            ) from error


def _camera_to_json(camera: CameraCalibration) -> CameraJson:
    return {
        "T_stage_camera": camera.T_stage_camera.tolist(),
        "residual_median_mm": camera.residual_median_mm,
        "residual_p95_mm": camera.residual_p95_mm,
        "residual_pairs": camera.residual_pairs,
        "time_offset_ms": -camera.clock.offset_ns * 1e-6,
        "clock_drift_ppm": -camera.clock.drift_ppm,
        "clock": {
            "offset_ns": camera.clock.offset_ns,
            "drift_ppm": camera.clock.drift_ppm,
            "reference_ns": camera.clock.reference_ns,
        },
        "depth_bias_m": camera.depth_bias_m,
        "coverage": camera.coverage,
        "identity_error": camera.identity_error,
        "verdict": camera.verdict,
        "reasons": list(camera.reasons),
        "said": codes_of(camera.reasons),
        "disagrees": [span.to_json() for span in camera.disagrees],
        "intrinsics": None if camera.lens is None else _lens_to_json(camera.lens),
        "readout_ms": camera.readout_ms,
    }


def _lens_to_json(lens: Lens) -> LensJson:
    return {
        "fx": lens.fx,
        "fy": lens.fy,
        "cx": lens.cx,
        "cy": lens.cy,
        "width": lens.width,
        "height": lens.height,
        "distortion": list(lens.distortion),
    }


def lens_from_json(value: dict[str, Any]) -> Lens:
    """Return the lens in `intrinsics`.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    fx, fy, cx, cy = (float(value[key]) for key in ("fx", "fy", "cx", "cy"))
    distortion = tuple(float(number) for number in value.get("distortion", ()))
    width, height = int(value["width"]), int(value["height"])
    good = min(fx, fy) > 0 and min(width, height) > 0 and len(distortion) in (0, 4, 5, 6, 7, 8)
    if not good or not np.isfinite([fx, fy, cx, cy, *distortion]).all():
        raise ValueError(
            say(
                "calibration.lens",
                "intrinsics need finite numbers, focal lengths and sizes above 0, and 0 or 4 to 8 of distortion",
            )
        )
    return Lens(fx, fy, cx, cy, width, height, distortion)


def _camera_from_json(value: dict[str, Any]) -> CameraCalibration:
    clock = value.get("clock") or {}
    return CameraCalibration(
        T_stage_camera=np.array(value["T_stage_camera"], dtype=np.float64),
        clock=ClockModel(
            offset_ns=int(clock.get("offset_ns", 0)),
            drift_ppm=float(clock.get("drift_ppm", 0.0)),
            reference_ns=int(clock.get("reference_ns", 0)),
        ),
        depth_bias_m=float(
            value.get("depth_bias_m", value.get("depth_bias_mm", 0.0) * 1e-3)
        ),  # mm in old files
        residual_median_mm=value.get("residual_median_mm"),
        residual_p95_mm=value.get("residual_p95_mm"),
        residual_pairs=int(value.get("residual_pairs", 0)),
        coverage=value.get("coverage"),
        identity_error=value.get("identity_error"),
        verdict=str(value.get("verdict", "good")),
        reasons=tuple(with_codes(value.get("reasons", ()), value.get("said", ()))),
        disagrees=tuple(Span.from_json(span) for span in value.get("disagrees", ())),
        lens=None if value.get("intrinsics") is None else lens_from_json(value["intrinsics"]),
        readout_ms=_readout_ms(value.get("readout_ms", 0.0)),
    )


def _readout_ms(value: Any) -> float:
    if not 0.0 <= float(value) <= LONGEST_READOUT_MS:
        raise ValueError(
            say(
                "calibration.readout",
                "readout_ms is 0 to {most:.0f}, in milliseconds",
                most=LONGEST_READOUT_MS,
            )
        )
    return float(value)


def performer_to_json(performer: Performer) -> PerformerJson:
    """Return a performer as JSON."""
    offsets = {name: row.tolist() for name, row in zip(CANONICAL, performer.offsets_m, strict=True)}
    return {
        "height_m": performer.height_m,
        "bones_m": performer.bones_m(),
        "offsets_m": offsets,
        "soles_measured": performer.soles_measured,
    }


def performer_from_json(value: dict[str, Any]) -> Performer:
    """Return the performer in JSON of `performer_to_json`.

    Raises:
        KeyError, TypeError, ValueError: a value is missing or is no number.
    """
    offsets = np.array([value["offsets_m"][name] for name in CANONICAL], dtype=np.float64)
    height = float(value["height_m"])
    if offsets.shape != (len(CANONICAL), 3) or not np.isfinite(offsets).all() or not math.isfinite(height):
        raise ValueError(
            say("calibration.offsets", "performer.offsets_m needs three finite numbers per canonical joint")
        )
    return Performer(height, offsets, soles_measured=bool(value.get("soles_measured", True)))
