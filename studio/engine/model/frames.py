"""The data of the pipeline: a camera's frame, its clock, aligned frames, the fused skeleton, the result of a step."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import LIMB_ROOTS, on_trunk
from studio.engine.model.rigid_body import PlacedBody, PlacedMarkers
from studio.engine.timecode.timecode import Timecode


@dataclass(frozen=True)
class HandSeen:
    """One hand's state from one camera: side `left` or `right`, method, probability of being open."""

    side: str
    method: str
    open_probability: float


@dataclass(frozen=True)
class PictureJoints:
    """Canonical joints in a picture of a camera without depth.

    Attributes:
        width, height: size of the picture [pixels].
        pixels: column and row, shape (21, 2); NaN = unseen. The centre of the first pixel is (0, 0).
        world_m: the joints relative to the middle of the hips, in the picture's axes (x right, y down, z away),
            guessed from one picture, shape (21, 3); NaN = not guessed.
        hands: pixels of the 21 landmarks of the left and the right hand, shape (2, 21, 2), NaN = not seen; None =
            neither is.
        face: pixels of the face's landmarks (`human.face`), shape (11, 2), NaN = not seen; None = none is.
    """

    width: int
    height: int
    pixels: NDArray[np.float64]
    world_m: NDArray[np.float64]
    hands: NDArray[np.float64] | None = None
    face: NDArray[np.float64] | None = None

    def of_body(self, trunk: tuple[float, float]) -> "PictureJoints":
        """Return it with the hips and neck of a body, which pictures do not show; see `joints.on_trunk`."""
        return replace(self, pixels=on_trunk(self.pixels, trunk), world_m=on_trunk(self.world_m, trunk))


@dataclass(frozen=True)
class CameraFrame:
    """One camera's skeleton in canonical joints, in the camera frame (OpenCV axes, metres).

    Attributes:
        camera: name of the camera.
        sequence: number that the client gave the frame.
        device_time_ns: capture time on the camera's own clock [ns].
        positions: shape (21, 3); NaN = unseen.
        confidence: shape (21,), 0..1; 0 = unseen.
        hands: hand states that came with the frame.
        head_wxyz: measured head orientation in the camera frame, where known.
        picture: the joints of a camera without depth, whose `positions` are NaN; `confidence` is their visibility.
        body: the device's own number of the body, which changes when the device loses it.
        others: further bodies that the camera saw at the same moment.
    """

    camera: str
    sequence: int
    device_time_ns: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    hands: tuple[HandSeen, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None
    picture: PictureJoints | None = None
    body: int = 0
    others: "tuple[CameraFrame, ...]" = ()

    def bodies(self) -> "tuple[CameraFrame, ...]":
        """Return every body as a frame of its own."""
        return (replace(self, others=()), *self.others) if self.others else (self,)


@dataclass(frozen=True)
class ClockModel:
    """Maps a camera's clock to the stage clock by an offset at a reference time and a drift.

    stage_ns = device_ns + offset_ns + drift_ppm * 1e-6 * (device_ns - reference_ns)
    """

    offset_ns: int = 0
    drift_ppm: float = 0.0
    reference_ns: int = 0

    def stage_ns(self, device_ns: int) -> int:
        """Return the stage time [ns] of a device time [ns]."""
        return device_ns + self.offset_ns + round(self.drift_ppm * 1e-6 * (device_ns - self.reference_ns))

    def stage_s(self, device_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return stage times [s] of device times [s], any shape."""
        return (
            device_s + self.offset_ns * 1e-9 + self.drift_ppm * 1e-6 * (device_s - self.reference_ns * 1e-9)
        )


@dataclass(frozen=True)
class Reading:
    """One camera's joints at their own time, in the stage frame.

    Attributes:
        camera: index of the camera in its frame set.
        offset_s: its time minus that of the frame set [s].
        positions: shape (21, 3) [m]; NaN = unseen.
        confidence: shape (21,).
        along_m: standard deviation of the positions along the rays of a camera without depth [m]; the positions only
            give the ray of each joint. None = a depth camera.
        behind_m: distance of each joint behind the hips, guessed from the picture of a camera without depth [m],
            shape (21,); NaN = not guessed. None = nothing is guessed.
    """

    camera: int
    offset_s: float
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    along_m: float | None = None
    behind_m: NDArray[np.float64] | None = None


DRAWN = 1.1
"""A place at this multiple of a limb's reach moves only the limb."""

CARRIES_M = 1e-3
"""A hinge carries a shoulder or hip that it moves by more than this [m/rad]; the joint's own axes pass through it."""


@dataclass(frozen=True)
class Pinned:
    """Joints whose place an operator knows, at one or more instants.

    Attributes:
        place_m: stage frame [m], shape (..., 21, 3); 0 where there is none.
        radius_m: largest allowed distance from it [m], shape (..., 21).
        information: inverse variance [1/m2], shape (..., 21); 0 = not pinned.
        reach_m: reach of each joint from its shoulder or hip [m], shape (21,); infinite for the trunk's. A place out
            of reach is approached up to it.
    """

    place_m: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    information: NDArray[np.float64]
    reach_m: NDArray[np.float64]

    def part(self, rows: slice | NDArray[np.int64]) -> "Pinned":
        """Return some of the instants."""
        return Pinned(self.place_m[rows], self.radius_m[rows], self.information[rows], self.reach_m)

    def at(self, row: int) -> "Pinned":
        """Return one of the instants, without an axis of instants."""
        return Pinned(self.place_m[row], self.radius_m[row], self.information[row], self.reach_m)

    def of_frames(self) -> "Pinned":
        """Return the same with an axis of one instant."""
        return Pinned(self.place_m[None], self.radius_m[None], self.information[None], self.reach_m)

    def raised(self, up_m: float) -> "Pinned":
        """Return the places raised."""
        return replace(self, place_m=self.place_m + np.array([0.0, 0.0, up_m]))

    def rows(self, sites: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the information on joints [1/m2], shape (..., 21), 0 within the radius; and the vector from them to
        the nearest allowed place [m], shape (..., 21, 3).

        Args:
            sites: the joints of a pose [m], shape (..., 21, 3).
        """
        roots = sites[..., LIMB_ROOTS, :]
        out = self.place_m - roots
        beyond = np.linalg.norm(out, axis=-1) / self.reach_m
        away = roots + out / np.maximum(beyond, 1.0)[..., None] - sites
        distance = np.linalg.norm(away, axis=-1)
        beyond = np.maximum(distance - self.radius_m, 0.0)
        active = (self.radius_m == 0.0) | (beyond > 0.0)
        left = beyond / np.maximum(distance, 1e-9)
        return self.information * active, left[..., None] * away

    def moving(self, sites: NDArray[np.float64], jacobians: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the joints' Jacobians, shape (..., 63, nv), for the pull to the places. The further a place is out
        of reach, the less the rest of the body follows, until only the limb does.

        Args:
            sites: as in `rows`.
            jacobians: of these joints.
        """
        beyond = np.linalg.norm(self.place_m - sites[..., LIMB_ROOTS, :], axis=-1) / self.reach_m
        share = np.clip((DRAWN - beyond) / (DRAWN - 1.0), 0.0, 1.0)
        far = (share < 1.0) & (self.information > 0.0)
        if not far.any():
            return jacobians
        each = jacobians.reshape(*sites.shape, -1)
        carries = (
            np.abs(each[..., LIMB_ROOTS, :, :]).max(axis=-2) > CARRIES_M
        )  # degrees of freedom that move the shoulder or hip
        kept = np.where(far[..., None] & carries, share[..., None], 1.0)
        return (each * kept[..., None, :]).reshape(jacobians.shape)


@dataclass(frozen=True)
class FrameSet:
    """All cameras' skeletons at one stage time, in the stage frame.

    Attributes:
        stage_time_ns: the instant.
        cameras: names of the participating cameras, shape (camera_count,).
        positions: shape (camera_count, 21, 3) [m]; NaN = unseen.
        confidence: shape (camera_count, 21).
        camera_positions: optical centres in the stage frame [m], shape (camera_count, 3).
        hands: hand states of the newest frame of each camera.
        head_wxyz: head orientation in the stage frame, from the first camera that measured it.
        readings: cameras' frames around the instant that no earlier frame set contains.
        rays: cameras that see no depth, shape (camera_count,); their `positions` lie on their rays where the cameras
            together place the joint, and are NaN where they cannot. Empty = none.
        hand_rays: points on the rays of the hands' landmarks, left and right, shape (camera_count, 2, 21, 3) [m],
            NaN = unseen; None = no camera sees a hand's landmarks.
        face_rays: points on the rays of the face's landmarks, shape (camera_count, 11, 3) [m]; else as `hand_rays`.
        pinned: joints whose place an operator knows, at this instant; None = none.
        touches: contacts of other joints, set by an operator: joint, touched joint or None for the floor, and inverse
            variance [1/m2].
        stands: feet that stand (1) or do not (-1), set by an operator: left ankle and toe, right ankle and toe, shape
            (4,); None = none set.
    """

    stage_time_ns: int
    cameras: tuple[str, ...]
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    camera_positions: NDArray[np.float64]
    hands: tuple[HandSeen, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None
    readings: tuple[Reading, ...] = ()
    rays: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    hand_rays: NDArray[np.float64] | None = None
    face_rays: NDArray[np.float64] | None = None
    pinned: Pinned | None = None
    touches: tuple[tuple[int, int | None, float], ...] = ()
    stands: NDArray[np.int8] | None = None


@dataclass(frozen=True)
class FusedSkeleton:
    """The skeleton fused from all cameras.

    Attributes:
        positions: shape (21, 3), stage frame [m]; NaN = no camera sees the joint.
        confidence: shape (21,).
        sigma: standard deviation of each joint's position [m], shape (21,); NaN = unseen.
        used: whether a camera's joint was used, shape (camera_count, 21).
        reasons: why a camera's joint was not used, by (camera index, joint index); see `fusion`.
    """

    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    sigma: NDArray[np.float64]
    used: NDArray[np.bool_]
    reasons: dict[tuple[int, int], str] = field(default_factory=dict)


@dataclass(frozen=True)
class StepResult:
    """The result of one step of the pipeline, for the view, the take and the metrics.

    `positions_m`, `rotations_wxyz`, `confidence` and `uncertainty_mm` are one frame of `Poses`:
    shapes (52, 3), (52, 4), (52,), (52,). `configuration` is the humanoid's, before completion, shape (nq,);
    None without inverse kinematics. `root_height_m` is as in `Poses`, set where finishing has put the take on its
    soles. `performer` is the number of the performer, from 1 in the order in which they came in; `undecided`: they
    could not be told apart from another. `others` are the steps of further performers at the same instant.
    `strangers` are the joints of persons who are not performers, shape (21, 3) each, stage frame [m]. `timecode` is
    that of the instant, if timecode arrives. `bodies` and `markers` are those of another system at the instant.
    """

    frame_set: FrameSet
    fused: FusedSkeleton
    positions_m: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    confidence: NDArray[np.float64]
    uncertainty_mm: NDArray[np.float64]
    configuration: NDArray[np.float64] | None = None
    root_height_m: float | None = None
    performer: int = 1
    undecided: bool = False
    others: "tuple[StepResult, ...]" = ()
    strangers: tuple[NDArray[np.float64], ...] = ()
    timecode: Timecode | None = None
    bodies: tuple[PlacedBody, ...] = ()
    markers: PlacedMarkers | None = None

    def each(self) -> "tuple[StepResult, ...]":
        """Return the step of every performer."""
        return (self, *self.others)
