# What is public. Each name is imported from its place when it is first asked for.
from .camera.client.run import run_camera
from .camera.devices.azure_kinect import AzureKinectConfig
from .camera.devices.kinect_v2 import KinectV2Config
from .camera.devices.openni import OpenNIConfig
from .camera.devices.orbbec import OrbbecConfig
from .camera.devices.realsense import RealSenseConfig
from .camera.devices.webcam import WebcamConfig
from .camera.simulated.depth_config import SimulatedDepthConfig
from .camera.simulated.landmarks import SimulatedRgbConfig
from .camera.simulated.skeletons import SimulatedConfig
from .camera.sources.config import DeviceConfig, SourceConfig
from .camera.sources.depth_source import DepthSource
from .camera.sources.recording import RecordingConfig
from .camera.sources.registry import SOURCES, Kind, add_source, open_source
from .camera.sources.source import Source, SourceFrame
from .camera.sources.video import VideoConfig
from .engine.animation.clip.options import ExportOptions
from .engine.base.errors import (
    CalibrationError,
    FormatError,
    NotAvailableError,
    SettingsError,
    StudioError,
    TakeError,
)
from .engine.edits.edit import (
    ContactEdit,
    DirectionEdit,
    Edit,
    ExchangeEdit,
    LeaveOutEdit,
    OffsetEdit,
    PinEdit,
    RetimeEdit,
    TrimEdit,
)
from .engine.model.calibration import Calibration, CameraCalibration, Performer
from .engine.model.cameras.depth import DepthCamera
from .engine.model.frames import CameraFrame, ClockModel, FusedSkeleton, StepResult
from .engine.model.joints import CANONICAL, OUTPUT_JOINTS
from .engine.model.poses import Poses
from .engine.model.settings.settings import PRESETS, SWITCHES, SolveSettings
from .engine.solve.conditioning.filters import FILTERS, Filter, add_filter
from .engine.solve.pipeline import Pipeline
from .engine.solve.stream import Stream
from .engine.whole_take.collect import collect_poses
from .library import (
    calibrate,
    evaluate,
    export,
    import_take,
    load_poses,
    open_take,
    settings,
    simulate,
    solve,
    splice,
)
from .offline.edits.take_parts import TakePart
from .take.edits.change import StaleEditsError, change_edits, redo_edits, undo_edits
from .take.edits.kept import TakeEdits, read_edits
from .take.folder.take import Take
from .take.raw.frames import camera_frames

__all__ = [
    "CANONICAL",
    "FILTERS",
    "OUTPUT_JOINTS",
    "PRESETS",
    "SOURCES",
    "SWITCHES",
    "AzureKinectConfig",
    "Calibration",
    "CalibrationError",
    "CameraCalibration",
    "CameraFrame",
    "ClockModel",
    "ContactEdit",
    "DepthCamera",
    "DepthSource",
    "DeviceConfig",
    "DirectionEdit",
    "Edit",
    "ExchangeEdit",
    "ExportOptions",
    "Filter",
    "FormatError",
    "FusedSkeleton",
    "Kind",
    "KinectV2Config",
    "LeaveOutEdit",
    "NotAvailableError",
    "OffsetEdit",
    "OpenNIConfig",
    "OrbbecConfig",
    "Performer",
    "PinEdit",
    "Pipeline",
    "Poses",
    "RealSenseConfig",
    "RecordingConfig",
    "RetimeEdit",
    "SettingsError",
    "SimulatedConfig",
    "SimulatedDepthConfig",
    "SimulatedRgbConfig",
    "SolveSettings",
    "Source",
    "SourceConfig",
    "SourceFrame",
    "StaleEditsError",
    "StepResult",
    "Stream",
    "StudioError",
    "Take",
    "TakeEdits",
    "TakeError",
    "TakePart",
    "TrimEdit",
    "VideoConfig",
    "WebcamConfig",
    "add_filter",
    "add_source",
    "calibrate",
    "camera_frames",
    "change_edits",
    "collect_poses",
    "evaluate",
    "export",
    "import_take",
    "load_poses",
    "open_source",
    "open_take",
    "read_edits",
    "redo_edits",
    "run_camera",
    "settings",
    "simulate",
    "solve",
    "splice",
    "undo_edits",
]

__version__: str
