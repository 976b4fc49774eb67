"""The simulated sensors: intrinsics, range and noise, each with its source.

Sources:
    [MS-NUI]    Kinect for Windows SDK 1.8, NUI_CAMERA_DEPTH_NOMINAL_FOCAL_LENGTH_IN_PIXELS (285.63 at 320 x 240);
                range 0.8 to 4 m, beyond it unreliable up to about 5 m.
    [Khoshelham 2012] Khoshelham and Elberink, "Accuracy and Resolution of Kinect Depth Data", Sensors 12(2): random
                error 1.425e-3 z^2 m, disparity steps of 1/8 pixel, baseline 7.5 cm.
    [Nguyen 2012] Nguyen, Izadi, Lovell, "Modeling Kinect Sensor Noise", 3DIMPVT: lateral noise about 0.8 pixels of
                640 x 480; axial noise grows beyond 60 degrees of incidence.
    [Fankhauser 2015] Fankhauser et al., "Kinect v2 for Mobile Robot Navigation", ICAR: axial noise by distance and
                angle; intrinsics of a Kinect v2 about 365 pixels at 512 x 424, radial distortion 0.09, -0.27, 0.09.
    [K4A]       Azure Kinect DK hardware specification: modes, ranges 0.5 to 3.86 m and 0.5 to 5.46 m, random error of
                at most 17 mm; intrinsics are the factory calibration stored in a published recording (pyk4a).
    [Toelgyessy 2021] "Evaluation of the Azure Kinect and its comparison to Kinect V1 and V2", Sensors 21(2): noise by
                distance and reflectivity, flying pixels, multipath.
    [Orbbec]    Femto Bolt data sheet: the Azure Kinect's depth modes and ranges, made with the same imager.
    [Intel]     D400 series data sheet and "Tuning depth cameras for best performance": 848 x 480, baseline 50 mm,
                from 0.28 m on, depth error = z^2 * subpixel / (focal length * baseline), subpixel 0.08 or better.
"""

from dataclasses import dataclass

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import unknown
from studio.engine.model.cameras.depth import DepthCamera

_K4A_LENS = (0.547940, -0.020971, 2.0558e-5, -7.2104e-5, -0.002652, 0.889679, 0.086130, -0.013910)


@dataclass(frozen=True)
class StructuredLight:
    """Matching of a projected pattern by an infrared camera, or stereo, with the second camera as the projector.

    Attributes:
        baseline_m: distance of the projector or second camera to the right of the camera.
        disparity_noise_px: SD of the disparity.
        disparity_step_px: the disparity is rounded to this.
        patch_px: size of the patches over which noise is correlated; 0 = independent pixels.
        edge_noise_px: SD of the position of an edge.
        lost_at_edge: share of the pixels at an edge without a reading, because a match there includes both sides.
        disturbed: whether others' patterns disturb it.
    """

    baseline_m: float
    disparity_noise_px: float
    disparity_step_px: float
    patch_px: int
    edge_noise_px: float
    lost_at_edge: float
    disturbed: bool


@dataclass(frozen=True)
class TimeOfFlight:
    """Phase of modulated light.

    Attributes:
        noise_mm: SD at distance z [m] and albedo 0.5 is `noise_mm[0] + noise_mm[1] * z + noise_mm[2] * z**2`.
        grazing_mm: added at an angle of incidence a [rad]: this * z**1.5 * a**2 / (pi/2 - a)**2.
        flying: share of the pixels at an edge that lie between front and back.
        lost_at_edge: share of the pixels at an edge without a reading.
        multipath_mm: excess distance of a point in a right-angled corner.
        least_signal: albedo * cos(incidence) / z**2 below which there is no reading.
    """

    noise_mm: tuple[float, float, float]
    grazing_mm: float
    flying: float
    lost_at_edge: float
    multipath_mm: float
    least_signal: float


@dataclass(frozen=True)
class Sensor:
    """A depth sensor.

    Attributes:
        name: for `--sensor`.
        device: displayed name.
        camera: intrinsics.
        range_m: nearest and farthest reading.
        family: noise model; None = exact.
    """

    name: str
    device: str
    camera: DepthCamera
    range_m: tuple[float, float]
    family: StructuredLight | TimeOfFlight | None
    frames_per_second: float = 30.0


_TOF_BINNED = TimeOfFlight((1.0, 0.3, 0.62), 0.03, 0.30, 0.35, 18.0, 0.006)
_TOF_UNBINNED = TimeOfFlight((1.0, 0.5, 0.7), 0.07, 0.30, 0.35, 18.0, 0.012)

SENSORS: dict[str, Sensor] = {
    sensor.name: sensor
    for sensor in (
        Sensor("ideal", "ideal depth camera", DepthCamera(252.3, 252.3, 159.5, 143.5, 320, 288), (0.2, 8.0), None),
        Sensor(  # [MS-NUI], [Khoshelham 2012], [Nguyen 2012]
            "kinect-v1", "Kinect v1, 320 x 240", DepthCamera(285.63, 285.63, 159.5, 119.5, 320, 240), (0.8, 5.0),
            StructuredLight(0.075, 0.030, 0.0625, 0, 0.4, 0.4, True),
        ),
        Sensor(  # [Fankhauser 2015]
            "kinect-v2", "Kinect v2, 512 x 424",
            DepthCamera(365.5, 365.5, 256.2, 207.1, 512, 424, (0.0907, -0.2668, 0.0, 0.0, 0.0890)), (0.5, 4.5),
            TimeOfFlight((1.5, -0.5, 0.3), 0.1, 0.45, 0.25, 22.0, 0.010),
        ),
        Sensor(  # [K4A], [Toelgyessy 2021]
            "azure-kinect", "Azure Kinect, NFOV 2x2 binned, 320 x 288",
            DepthCamera(252.30, 252.37, 166.14, 174.16, 320, 288, _K4A_LENS), (0.5, 5.46), _TOF_BINNED,
        ),
        Sensor(
            "azure-kinect-unbinned", "Azure Kinect, NFOV unbinned, 640 x 576",
            DepthCamera(504.61, 504.73, 332.78, 348.83, 640, 576, _K4A_LENS), (0.5, 3.86), _TOF_UNBINNED,
        ),
        Sensor(  # [Orbbec]
            "femto-bolt", "Orbbec Femto Bolt, NFOV unbinned, 640 x 576",
            DepthCamera(504.0, 504.0, 320.5, 331.0, 640, 576, _K4A_LENS), (0.5, 3.86), _TOF_UNBINNED,
        ),
        Sensor(  # [Intel]
            "d435", "RealSense D435, 848 x 480", DepthCamera(424.0, 424.0, 423.5, 239.5, 848, 480), (0.3, 10.0),
            StructuredLight(0.050, 0.08, 0.03125, 6, 0.8, 0.3, False),
        ),
    )
}  # fmt: skip
"""The sensors by name."""


def find_sensor(name: str) -> Sensor:
    """Return the sensor with a name.

    Raises:
        SettingsError: unknown name.
    """
    if name not in SENSORS:
        raise SettingsError(unknown("sensor", name, SENSORS))
    return SENSORS[name]
