"""Storage of a take's steps for finishing, in temporary files, so that memory does not grow with the take."""

from array import array
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.records import Records
from studio.engine.model.frames import FrameSet, FusedSkeleton, HandSeen, Reading, StepResult
from studio.engine.model.human.face import LANDMARKS as FACE_LANDMARKS
from studio.engine.model.human.hand import LANDMARKS as HAND_LANDMARKS
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.triangulation.rays import FREE_M, nearest_on_rays

NEAREST = 0.75
"""A camera's frame belongs to its nearest step, if that is within this many steps."""


BORDER = 2
"""Steps at either end of a stretch whose nearest readings may belong to a step outside it."""


class StoredReadings(NamedTuple):
    """The cameras' readings at some steps.

    Attributes:
        positions: stage frame [m], shape (step_count, camera_count, 21, 3); NaN = unseen.
        confidence: shape (step_count, camera_count, 21).
        late: time of the reading minus that of the step [steps], shape (step_count, camera_count).
        behind_m: as in `Reading`, shape (step_count, camera_count, 21); NaN = not guessed.
    """

    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    late: NDArray[np.float64]
    behind_m: NDArray[np.float64]


class Store:
    """Steps of a pipeline in time order: `add` them all, then `read` any of them.

    Attributes:
        cameras: names of the cameras, in the order of the records.
        camera_positions: optical centres in the stage frame [m], shape (camera_count, 3).
        along_m: standard deviation along their rays of cameras that see no depth [m], shape (camera_count,); NaN = of
            the others. Their readings are kept at the point of each ray nearest to the first solve's joint.
    """

    def __init__(self, first: StepResult) -> None:
        """Make an empty store; `first` gives the number of cameras."""
        frames = first.frame_set
        self.cameras, self.camera_positions = frames.cameras, frames.camera_positions
        count = len(frames.cameras)
        self.along_m = np.full(count, np.nan)
        assert first.configuration is not None
        self._dtype = np.dtype(
            [
                ("time_ns", "i8"),
                ("q", "f8", first.configuration.shape),
                ("positions", "f4", (count, JOINT_COUNT, 3)),
                ("confidence", "f4", (count, JOINT_COUNT)),
                ("used", "?", (count, JOINT_COUNT)),
                ("fused", "f4", (JOINT_COUNT, 3)),
                ("fused_confidence", "f4", (JOINT_COUNT,)),
                ("sigma", "f4", (JOINT_COUNT,)),
                ("head_wxyz", "f8", (4,)),
            ]
        )
        self._steps = Records(self._dtype)
        self._hand_rays = _SomeRays((count, 2, HAND_LANDMARKS, 3))
        self._face_rays = _SomeRays((count, FACE_LANDMARKS, 3))
        self._times_ns = array("q")
        self._readings = Records(
            np.dtype(
                [
                    ("positions", "f4", (JOINT_COUNT, 3)),
                    ("confidence", "f4", (JOINT_COUNT,)),
                    ("behind", "f4", (JOINT_COUNT,)),
                ]
            )
        )
        self._reading_times_ns, self._reading_cameras = array("q"), array("h")
        self._slots: NDArray[np.int64] | None = None  # the step of each reading; -1 = none
        self._hands: dict[int, tuple[HandSeen, ...]] = {}  # by frame, where there are any
        self._over: list[tuple[int, Store]] = []  # first step, and the store that replaces this one

    def __len__(self) -> int:
        return len(self._steps)

    @property
    def times_ns(self) -> NDArray[np.int64]:
        """Stage times of the steps [ns]."""
        return np.array(self._times_ns, dtype=np.int64)

    def lay_over(self, first: int, other: "Store") -> None:
        """Read steps from `first` on from another store of the same cameras, whose steps are at the same times."""
        self._over.append((first, other))

    def _laid_over(self, begin: int, end: int) -> Iterator[tuple[slice, "Store", int, int]]:
        """Stores that replace steps from `begin` up to `end`: the rows among them, the store, and its own begin and
        end."""
        for first, other in self._over:
            last = first + len(other)
            low = max(begin, first + BORDER * (first > 0))
            high = min(end, last - BORDER * (last < len(self)))
            if low < high:
                yield slice(low - begin, high - begin), other, low - first, high - first

    def add(self, result: StepResult) -> None:
        """Store a step.

        Raises:
            TakeError: the disk of the temporary folder is full.
        """
        frames, fused = result.frame_set, result.fused
        count = len(self)
        self._steps.add((
            frames.stage_time_ns, result.configuration, frames.positions, frames.confidence, fused.used,
            fused.positions, fused.confidence, fused.sigma,
            np.nan if frames.head_wxyz is None else frames.head_wxyz,
        ))  # fmt: skip
        self._times_ns.append(frames.stage_time_ns)
        self._hand_rays.add(frames.hand_rays)
        self._face_rays.add(frames.face_rays)
        for reading in frames.readings:
            behind_m = np.nan if reading.behind_m is None else reading.behind_m
            self._readings.add((self._placed(reading, result), reading.confidence, behind_m))
            self._reading_times_ns.append(frames.stage_time_ns + round(reading.offset_s * 1e9))
            self._reading_cameras.append(reading.camera)
        if frames.hands:
            last = self._hands.get(count - 1, frames.hands)
            self._hands[count] = last if last == frames.hands else frames.hands

    def _placed(self, reading: Reading, result: StepResult) -> NDArray[np.float64]:
        """A reading's joints [m], shape (21, 3); those known only across their rays are put near the solve's."""
        if reading.along_m is None:
            return reading.positions
        self.along_m[reading.camera] = reading.along_m
        if reading.along_m < FREE_M:
            return reading.positions
        solved = result.positions_m[OUTPUT_OF_CANONICAL_INDEX]
        return nearest_on_rays(reading.positions, self.camera_positions[reading.camera], solved)

    @property
    def depthless(self) -> NDArray[np.bool_]:
        """Cameras that see no depth, shape (camera_count,)."""
        return ~np.isnan(self.along_m)

    @property
    def sees_depth(self) -> bool:
        """Whether a camera with depth has sent anything."""
        return not self.depthless[np.unique(self._reading_cameras)].all()

    def read(self, begin: int, end: int) -> NDArray[np.void]:
        """Return the records of steps from `begin` up to, but not including, `end`."""
        records = self._steps.read(begin, end)
        for rows, other, low, high in self._laid_over(begin, end):
            records[rows] = other.read(low, high)
        return records

    def readings(self, begin: int, end: int, dt: float) -> StoredReadings:
        """Return the cameras' readings, each with the nearest step, for steps `begin` up to `end`.

        Of a camera that is faster than the steps, the reading nearest to each step is returned.

        Args:
            begin: first step.
            end: step after the last.
            dt: time between steps [s].
        """
        if self._slots is None:
            self._slots = self._slots_of_readings(dt)
        shape = (end - begin, len(self.cameras))
        found = StoredReadings(
            np.full((*shape, JOINT_COUNT, 3), np.nan),
            np.zeros((*shape, JOINT_COUNT)),
            np.zeros(shape),
            np.full((*shape, JOINT_COUNT), np.nan),
        )
        which = np.flatnonzero((self._slots >= begin) & (self._slots < end))
        if len(which):
            records = self._readings.read(int(which[0]), int(which[-1]) + 1)[which - which[0]]
            at = self._slots[which] - begin, np.array(self._reading_cameras)[which]
            found.positions[at], found.confidence[at] = records["positions"], records["confidence"]
            found.behind_m[at] = records["behind"]
            after_ns = np.array(self._reading_times_ns)[which] - self.times_ns[self._slots[which]]
            found.late[at] = after_ns * (1e-9 / dt)
        for rows, other, low, high in self._laid_over(begin, end):
            for mine, its in zip(found, other.readings(low, high, dt), strict=True):
                mine[rows] = its
        return found

    def frames_within(self, span_s: float) -> NDArray[np.float64]:
        """Return the number of frames of each camera within a time, shape (camera_count,); NaN = unknown."""
        times, cameras = np.array(self._reading_times_ns), np.array(self._reading_cameras)
        apart_s = [np.diff(np.sort(times[cameras == c])) * 1e-9 for c in range(len(self.cameras))]
        return np.array([span_s / max(np.median(one), 1e-3) if len(one) else np.nan for one in apart_s])

    def _slots_of_readings(self, dt: float) -> NDArray[np.int64]:
        """The nearest step of each reading; -1 = none, or another reading of its camera is nearer."""
        steps, times = self.times_ns, np.array(self._reading_times_ns, dtype=np.int64)
        after = np.clip(np.searchsorted(steps, times), 1, max(len(steps) - 1, 1))
        before = after - 1
        after = np.minimum(after, len(steps) - 1)
        slots = np.where(times - steps[before] <= steps[after] - times, before, after)
        away = np.abs(times - steps[slots])
        keys = slots * len(self.cameras) + np.array(self._reading_cameras, dtype=np.int64)
        order = np.lexsort((away, keys))
        second = np.concatenate([[False], keys[order][1:] == keys[order][:-1]])
        slots[order[second]] = -1
        slots[away > NEAREST * dt * 1e9] = -1
        return slots

    def frames(self, begin: int, records: NDArray[np.void]) -> Iterable[tuple[FrameSet, FusedSkeleton]]:
        """Yield the measured and fused joints of each step of `records`, which begin at step `begin`."""
        for k, record in enumerate(records):
            store, place = self._of_step(begin + k)
            head = record["head_wxyz"]
            w, x, y, z = (float(v) for v in head)
            yield (
                FrameSet(
                    int(record["time_ns"]),
                    self.cameras,
                    record["positions"].astype(np.float64),
                    record["confidence"].astype(np.float64),
                    self.camera_positions,
                    store._hands.get(place, ()),
                    None if np.isnan(w) else (w, x, y, z),
                    rays=self.depthless,
                    hand_rays=store._hand_rays.at(place),
                    face_rays=store._face_rays.at(place),
                ),
                FusedSkeleton(
                    record["fused"].astype(np.float64),
                    record["fused_confidence"].astype(np.float64),
                    record["sigma"].astype(np.float64),
                    record["used"],
                ),
            )

    def _of_step(self, step: int) -> "tuple[Store, int]":
        """The store that has a step, and its place there."""
        over = next(self._laid_over(step, step + 1), None)
        return (self, step) if over is None else (over[1], over[2])

    @property
    def has_parts(self) -> bool:
        """Whether any camera saw the landmarks of a hand or of the face."""
        return any(one._hand_rays.any or one._face_rays.any for one in [self, *(o for _, o in self._over)])

    def close(self) -> None:
        """Delete the temporary files."""
        self._steps.close()
        self._hand_rays.close()
        self._face_rays.close()
        self._readings.close()
        for _, other in self._over:
            other.close()


class _SomeRays:
    """Points on rays of the steps that have any."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._rays, self._places = Records(np.dtype(("f4", shape))), array("q")  # of each step; -1 = none

    @property
    def any(self) -> bool:
        return len(self._rays) > 0

    def add(self, rays: NDArray[np.float64] | None) -> None:
        self._places.append(-1 if rays is None else len(self._rays))
        if rays is not None:
            self._rays.add(rays)

    def at(self, step: int) -> NDArray[np.float64] | None:
        place = self._places[step]
        return None if place < 0 else self._rays.read(place, place + 1)[0].astype(np.float64)

    def close(self) -> None:
        self._rays.close()
