"""The player: the replayed solve, its time, and the thread that advances it."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.api.stage.shown import ReplayedPerformer, ReplayStatus, SecondFigure
from studio.engine.base.errors import SettingsError, StudioError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.model.performers.colours import performer_colour
from studio.engine.model.poses import Poses, on_output_joints
from studio.offline.so_far import SoFar
from studio.take.folder.performers import performer_number
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.growing import GrowingClip, GrowingClips
from studio.web.playback.raw_clip import load_raw
from studio.web.playback.robots import NO_ROBOT, ReplayedRobot
from studio.web.playback.second import Second
from studio.web.playback.space import space_of
from studio.web.points.replayed import ReplayedDepth
from studio.web.scene.palette import as_hex

SPEEDS = (0.05, 4.0)
TICK_S = 1.0 / 60.0
TRAIL_FRAMES = 90
FRAMED_EVERY = 10
PART_S = (0.3, 1.2)
"""Time before and after the playhead in a preview [s]."""
GHOST_OFFSET_MS = 3_600_000.0
GHOST_APART_M = 5.0
"""Maximum offset of the second figure to the side [m]."""

_Key = tuple[int, int, int, int, float, float]


class Screen(Protocol):
    """The player's interface to the view."""

    def show_replay(
        self,
        result: StepResult,
        ghost: StepResult | None,
        trails: Mapping[int, NDArray[np.float64]],
        calibration: Calibration | None,
        depth: ReplayedDepth,
        names: Mapping[int, str],
        robots: tuple[str, Mapping[int, NDArray[np.float64]]],
    ) -> None:
        """Show a frame, another solve's next to it, and the joints' earlier places, shape (N, 52, 3); `depth`: where
        the take's depth images are; `robots`: a robot's name, and its configurations by the performer's number."""

    def show_live(self) -> None:
        """Return to the live stage."""


class Player:
    """Replays one clip, with a second figure on the same clock. All methods may be called from any thread."""

    def __init__(self, screen: Screen, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._screen = screen
        self._clock = clock
        self._changed = threading.Condition()
        self.growing = GrowingClips()
        self._clip: Clip | None = None
        self._ghost: Second | None = None
        self._robot = NO_ROBOT
        self._ghost_offset_ms = 0.0
        self._ghost_apart_m = 0.0
        self._playing = False
        self._loop = True
        self._speed = 1.0
        self._range = (0, 0)
        self._place = 0.0  # in frames, at `_since`
        self._since = 0.0
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)
        self._thread.start()

    @property
    def clip(self) -> Clip | None:
        """The replayed clip."""
        return self._clip

    def shown(self) -> tuple[Clip, tuple[Second | None, float]]:
        """Return the replayed clip, and the second figure with its lead [s].

        Raises:
            SettingsError: nothing is replayed.
        """
        with self._changed:
            return self._open(), (self._ghost, self._ghost_offset_ms * 1e-3)

    def show_robot(self, robot: ReplayedRobot) -> None:
        """Show a robot's motion if it belongs to the replayed solve."""
        with self._changed:
            self._robot = robot
            self._changed.notify()

    def open(self, clip: Clip, ghost: Second | None = None) -> None:
        """Replay a clip. The time is kept for another solve of the same take, and so is the offset of the same second
        figure.
        """
        with self._changed:
            same = self._clip is not None and self._clip.take == clip.take
            time_s = None if not same or self._clip is None else float(self._clip.poses.time_s[self._frame()])
            kept_range = (
                same and self._clip is not None and self._clip.poses.frame_count == clip.poses.frame_count
            )
            if ghost is None or self._ghost is None or self._ghost.name != ghost.name:
                self._ghost_offset_ms = 0.0
            self._clip, self._ghost = clip, ghost
            if not kept_range:
                self._range = (0, clip.poses.frame_count - 1)
            if not same:
                self._playing = False
            self._go(0 if time_s is None else clip.nearest(time_s))

    def space_m(self) -> NDArray[np.float64]:
        """Return outermost points of the replayed motion, and of the second one next to it, shape (N, 3) [m].

        Raises:
            SettingsError: nothing is replayed.
        """
        with self._changed:
            clip, ghost = self._open(), self._ghost
        return space_of(_places(clip, ghost))

    def part(self, take: str) -> tuple[float, float, str]:
        """Return the stage times around the playhead for a preview [s], and the performer of the curves, if several.

        Raises:
            SettingsError: this take is not replayed.
        """
        now_s, performer = self.playhead(take)
        return now_s - PART_S[0], now_s + PART_S[1], performer

    def playhead(self, take: str) -> tuple[float, str]:
        """Return the stage time at the playhead [s], and the performer of the curves, if several.

        Raises:
            SettingsError: this take is not replayed.
        """
        with self._changed:
            if self._clip is None or self._clip.take != take:
                raise SettingsError(
                    "replay.not_replayed",
                    "take {take} is not replayed; open it first, or leave draft out",
                    take=take,
                )
            return float(self._clip.poses.time_s[self._frame()]), self._clip.performer

    def show_part(self, take: str, poses: Poses, performer: str = "") -> None:
        """Show these poses of a performer at their times, until another solve is opened; does nothing if the take is
        not replayed, or with another performer for the curves."""
        with self._changed:
            clip = self._clip
            if clip is not None and (clip.take, clip.performer) == (take, performer):
                self._clip = clip.with_part(on_output_joints(poses))
                self._changed.notify()

    def grow(self, take: Take, solve: str, so_far: SoFar) -> None:
        """Add the next part of a solve that is being made. It is shown if this solve is replayed already, or the take
        without any solve."""
        clip = self.growing.add(take, solve, so_far)
        with self._changed:
            shown = self._clip
            if shown is not None and shown.take == clip.take and shown.solve in ("", solve):
                self.open(clip, self._ghost)

    def grown(self, take: Take, solve: str) -> None:
        """Handle the end of a solve: if its beginning was shown, show it, or what the cameras saw if it failed."""
        id_ = f"{take.path.parent.name}/{take.path.name}"
        self.growing.end(id_, solve)
        if not self._grows(id_, solve):
            return
        try:
            clip = Clip.load(take, solve) if solve in take.solve_names() else load_raw(take)
        except StudioError:  # the take is gone, or damaged
            clip = None
        with self._changed:
            if self._grows(id_, solve):
                self.close_clip() if clip is None else self.open(clip, self._ghost)

    def _grows(self, take: str, solve: str) -> bool:
        """Whether the beginning of this solve is shown."""
        clip = self._clip
        return isinstance(clip, GrowingClip) and (clip.take, clip.solve) == (take, solve)

    def let_go(self, take: str, reference: str) -> None:
        """Remove the second figure if it is this reference of a take, session/name."""
        with self._changed:
            if self._ghost is not None and self._ghost.name == SecondFigure(take, reference=reference):
                self._ghost = None
                self._changed.notify()

    def close_clip(self) -> None:
        """Show the live stage again."""
        with self._changed:
            self._clip = self._ghost = None
            self._playing = False
            self._changed.notify()

    def change(
        self,
        *,
        playing: bool | None = None,
        frame: int | None = None,
        step: int | None = None,
        speed: float | None = None,
        loop: bool | None = None,
        first: int | None = None,
        last: int | None = None,
        ghost_offset_ms: float | None = None,
        ghost_apart_m: float | None = None,
    ) -> None:
        """Play or pause, go to a frame or by some frames, set speed, loop and the played range; shift the second
        figure in time or to the side.

        Raises:
            SettingsError: nothing is replayed, or a value that is not allowed.
        """
        with self._changed:
            clip = self._open()
            end = clip.poses.frame_count - 1
            if speed is not None and not SPEEDS[0] <= speed <= SPEEDS[1]:
                raise SettingsError(
                    "replay.speed",
                    "speed={speed:g} is not allowed; allowed: {low:g} to {high:g}",
                    speed=speed,
                    low=SPEEDS[0],
                    high=SPEEDS[1],
                )
            low = self._range[0] if first is None else first
            high = self._range[1] if last is None else last
            if not 0 <= low <= high <= end:
                raise SettingsError(
                    "replay.range",
                    "first={first}, last={last} is no range; allowed: 0 to {most}, first up to last",
                    first=low,
                    last=high,
                    most=end,
                )
            _check_ghost(ghost_offset_ms, ghost_apart_m)
            place = self._now()
            self._ghost_offset_ms = self._ghost_offset_ms if ghost_offset_ms is None else ghost_offset_ms
            self._ghost_apart_m = self._ghost_apart_m if ghost_apart_m is None else ghost_apart_m
            self._range = (low, high)
            self._speed = self._speed if speed is None else speed
            self._loop = self._loop if loop is None else loop
            if step is not None:
                place, self._playing = float(self._frame() + step), False
            if frame is not None:
                place = float(frame)
            if playing is not None:
                if playing and place >= high:  # play at the end starts again
                    place = float(low)
                self._playing = playing
            self._go(min(max(place, 0.0), float(end)))

    def status(self) -> ReplayStatus:
        """Return the state of the replay; `open` is false while the live stage is shown."""
        with self._changed:
            clip = self._clip
            if clip is None:
                return ReplayStatus(open=False)
            ghost = self._ghost
            return ReplayStatus(
                open=True,
                take=clip.take,
                solve=clip.solve,
                performer=clip.performer,
                performers=[
                    ReplayedPerformer(one, name, as_hex(performer_colour(performer_number(one))))
                    for one, name in clip.names.items()
                ],
                ghost=None if ghost is None else ghost.name,
                ghost_offset_ms=self._ghost_offset_ms,
                ghost_apart_m=self._ghost_apart_m,
                begins_s=clip.poses.begins_s,
                frames=clip.poses.frame_count,
                rate_hz=clip.poses.frames_per_second,
                frame=self._frame(),
                time_s=float(clip.poses.time_s[self._frame()] - clip.poses.begins_s),
                playing=self._playing,
                speed=self._speed,
                loop=self._loop,
                first=self._range[0],
                last=self._range[1],
                has_trace=clip.trace is not None,
                holds=clip.holds,
                of_s=clip.of_s if isinstance(clip, GrowingClip) else None,
            )

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    # --- with `_changed` held

    def _open(self) -> Clip:
        if self._clip is None:
            raise SettingsError("replay.nothing", "nothing is replayed; open a take first")
        return self._clip

    def _go(self, place: float) -> None:
        self._place, self._since = place, self._clock()
        self._changed.notify()

    def _now(self) -> float:
        """The present position of the replay, in frames."""
        clip = self._clip
        if clip is None or not self._playing:
            return self._place
        first, last = self._range
        place = self._place + (self._clock() - self._since) * self._speed * clip.poses.frames_per_second
        if place <= last:
            return place
        return first + (place - first) % max(last - first + 1, 1) if self._loop else float(last)

    def _frame(self) -> int:
        clip = self._clip
        return 0 if clip is None else min(round(self._now()), clip.poses.frame_count - 1)

    def _key(self) -> "_Key | None":
        """The frame to show; None: the live stage."""
        if self._clip is None:
            return None
        beside = (self._ghost_offset_ms, self._ghost_apart_m)
        return id(self._clip), id(self._ghost), id(self._robot), self._frame(), *beside

    def _stop_at_the_end(self) -> None:
        if self._playing and not self._loop and self._now() >= self._range[1]:
            self._place, self._playing = float(self._range[1]), False

    # --- the thread

    def _run(self) -> None:
        key: _Key | None = None
        while True:
            with self._changed:
                seen = key
                if not self._closed and self._key() == seen:
                    self._changed.wait(TICK_S if self._playing else None)
                if self._closed:
                    return
                self._stop_at_the_end()
                key = self._key()
                clip, ghost, robot = self._clip, self._ghost, self._robot
            if key == seen:
                continue
            if clip is None or key is None:
                self._screen.show_live()
                continue
            frame, offset_ms, apart_m = key[3:]
            beside = None
            if ghost is not None:
                beside = ghost.step(float(clip.poses.time_s[frame]) + offset_ms * 1e-3, apart_m=apart_m)
            numbered = {performer_number(one): name for one, name in clip.names.items()}
            self._screen.show_replay(
                clip.step(frame),
                beside,
                clip.trails(frame, TRAIL_FRAMES),
                clip.calibration,
                clip.depth,
                numbered,
                (robot.name, robot.at(clip, frame)),
            )


def _places(clip: Clip, ghost: Second | None) -> NDArray[np.float64]:
    """Return joint positions in some frames of a clip, and of a second figure next to it, shape (N, 3) [m]."""
    motions = [one.poses.positions_m[::FRAMED_EVERY] for one in clip.everybody()]
    if ghost is not None and isinstance(ghost.shown, Clip):
        others = [one.poses.positions_m[::FRAMED_EVERY] for one in ghost.shown.everybody()]
        motions += [ghost.alignment.to_stage(places) for places in others]
    return np.concatenate([motion.reshape(-1, 3) for motion in motions])


def _check_ghost(offset_ms: float | None, apart_m: float | None) -> None:
    """Raise SettingsError if the second figure may not be shifted this far."""
    if offset_ms is not None and not abs(offset_ms) <= GHOST_OFFSET_MS:
        raise SettingsError(
            "replay.ghost_offset",
            "ghost_offset_ms={ms:g} is not allowed; allowed: an hour at most",
            ms=offset_ms,
        )
    if apart_m is not None and not abs(apart_m) <= GHOST_APART_M:
        raise SettingsError(
            "replay.ghost_apart",
            "ghost_apart_m={m:g} is not allowed; allowed: {most:g} at most",
            m=apart_m,
            most=GHOST_APART_M,
        )
