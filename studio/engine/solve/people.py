"""The pipeline of everybody on the stage: from frames with several bodies to the poses of each performer.

As long as cameras show one body, it is the first performer, and there is one `Pipeline` for them. From the first
frame with several bodies on, `Crowd` decides which body is whose, and each performer has a pipeline of their own.
A person without proportions is a stranger and has no poses; `add_performer` makes them a performer.
Like `Pipeline` it is deterministic: the same calls in the same order give the same poses.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.identity.crowd import ALIKE_M, CLEAR_M, Crowd, apart_m
from studio.engine.identity.known import KnownPerson
from studio.engine.identity.person import FollowedPerson
from studio.engine.identity.recognised import FIRST, MOST_PERFORMERS, OnStage, Recognised, performer_key
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import CameraFrame, ClockModel, StepResult
from studio.engine.model.joints import PARENTS
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.pipeline import Pipeline

_RECENT_S = 1.0
_ALONE_S = 2.0
"""The first performer counts as alone when nobody else has been seen for this long."""

_LIKE_FIRST_M = 2.0 * ALIKE_M
"""Largest distance of a body's bones from the first performer's calibrated ones, where others are known too."""

_DOUBT_S = 0.1
_HERE_S = 0.5


@dataclass(frozen=True)
class _Followed:
    number: int
    proportions: Performer
    pipeline: Pipeline


class PeoplePipeline:
    """Turns camera frames into the poses of all performers, one output frame per `step`."""

    def __init__(
        self, calibration: Calibration, settings: SolveSettings, people: Sequence[KnownPerson] = ()
    ) -> None:
        """Start without any frame.

        Args:
            calibration: its performer is the first one.
            settings: of every performer, with the differences between them.
            people: performers known from before; ignored if the first one is not among them.

        Raises:
            CalibrationError: the calibration has no performer.
            SettingsError: the settings name a camera that the calibration lacks.
        """
        self._clocks: dict[str, ClockModel] = {}
        self._calibration, self._settings = calibration, settings
        self._start(people)

    def _start(self, people: Sequence[KnownPerson]) -> None:
        self._names = self._settings.camera_names(tuple(self._calibration.cameras))
        self._first = Pipeline(self._calibration, self._settings_of(FIRST))
        for camera, clock in self._clocks.items():
            self._first.set_clock(camera, clock)
        self._crowd: Crowd | None = None
        self._followed: dict[int, _Followed] = {}
        self._last_s, self._several_s = -np.inf, -np.inf
        self._last: StepResult | None = None
        if any(one.performer == FIRST for one in people):
            self._crowd = Crowd([one.person() for one in people], remembers=False)
            for index, one in enumerate(people):
                if one.performer == FIRST:
                    self._follow_first(index)
                elif one.proportions is not None:
                    self._follow(index, one.performer, one.proportions)

    def _follow_first(self, index: int) -> None:
        proportions = self._calibration.performer
        assert proportions is not None  # Pipeline refuses a calibration without
        self._followed[index] = _Followed(FIRST, proportions, self._first)

    def _follow(self, index: int, number: int, proportions: Performer) -> None:
        own = replace(self._calibration, performer=proportions)
        pipeline = Pipeline(own, self._settings_of(number))
        for camera, clock in self._clocks.items():
            pipeline.set_clock(camera, clock)
        pipeline.stand_beside(self._first)
        self._followed[index] = _Followed(number, proportions, pipeline)

    def _settings_of(self, number: int) -> SolveSettings:
        return self._settings.of_performer(performer_key(number))

    def _pipelines(self) -> list[Pipeline]:
        own = [one.pipeline for one in self._followed.values() if one.number != FIRST]
        return [self._first, *own]

    # --- frames

    def add_frame(self, frame: CameraFrame) -> list[Recognised]:
        """Add a camera's frame; return the persons whose bodies it shows.

        In frames of cameras without depth, the first body is the first performer's.
        """
        if frame.picture is not None or (self._crowd is None and not frame.others):
            self._first.add_frame(frame)
            return [Recognised(0, FIRST, frame)]
        if frame.camera not in self._names:
            return []
        camera = self._calibration.cameras[frame.camera]
        clock = self._clocks.get(frame.camera, camera.clock)
        stage_s = clock.stage_ns(frame.device_time_ns) * 1e-9
        if self._crowd is None:
            self._crowd = self._begin(stage_s)
        bodies = frame.bodies()
        joints = np.array([body.positions for body in bodies])
        found = self._crowd.add(
            stage_s, transform_points(camera.T_stage_camera, unbiased(joints, camera.depth_bias_m))
        )
        self._welcome(self._crowd, found)
        out: list[Recognised] = []
        for body, who in zip(bodies, found, strict=True):
            if who is None:
                continue
            followed = self._followed.get(who)
            if followed is not None:
                followed.pipeline.add_frame(body)
            out.append(Recognised(who, None if followed is None else followed.number, body))
        if len(bodies) > 1:
            self._several_s = stage_s
        if self._is_alone(self._crowd, stage_s):
            self._crowd = None
            self._followed.clear()
        return out

    def _begin(self, stage_s: float) -> Crowd:
        """Return a crowd that knows the first performer, and where they were in the last step."""
        last, first = self._last, _bones_of(self._calibration.performer)
        self._follow_first(0)
        if last is None or stage_s - last.frame_set.stage_time_ns * 1e-9 > _RECENT_S:
            return Crowd([FollowedPerson.known(first)], remembers=False)
        at_s = last.frame_set.stage_time_ns * 1e-9
        return Crowd([FollowedPerson.known(first, last.fused.positions, at_s)], remembers=False)

    def _welcome(self, crowd: Crowd, found: list[int | None]) -> None:
        """Take the first new person for the first performer, if that one has not been here before.

        Where others are known too, the person's bones must be like the first one's, and unlike those of anybody else
        who is away.
        """
        first = next(index for index, one in self._followed.items() if one.number == FIRST)
        if np.isfinite(crowd.people[first].person.last_s):
            return
        bones = crowd.people[first].person.bones_m()
        new = [who for who in found if who is not None and who not in self._followed]
        if not new:
            return
        seen = {who: crowd.people[who].person.bones_m() for who in new}
        who = min(new, key=lambda who: apart_m(bones, seen[who]))
        apart = apart_m(bones, seen[who])
        others = [
            apart_m(crowd.people[index].person.bones_m(), seen[who])
            for index in self._followed
            if index != first and self._last_s - crowd.people[index].person.last_s > _HERE_S
        ]
        known = len(self._followed) > 1
        if known and (apart > _LIKE_FIRST_M or min(others, default=np.inf) - apart < CLEAR_M):
            return
        del self._followed[first]
        self._follow_first(who)

    def _is_alone(self, crowd: Crowd, stage_s: float) -> bool:
        others = [one.person.last_s for index, one in enumerate(crowd.people) if index not in self._followed]
        return len(self._followed) == 1 and stage_s - max([self._several_s, *others]) > _ALONE_S

    def add_performer(self, person: int, proportions: Performer) -> None:
        """Make a stranger the next performer; nothing changes without this stranger, or with eight performers."""
        if self._crowd is None or person in self._followed or person >= len(self._crowd.people):
            return
        if len(self._followed) == MOST_PERFORMERS:
            return
        number = 1 + max(one.number for one in self._followed.values())
        self._follow(person, number, proportions)

    def exchange(self, first: int, second: int) -> None:
        """Exchange the identities of two performers, by number, from now on, and reset their motion.

        Nothing changes where one of them is unknown.
        """
        index = {one.number: index for index, one in self._followed.items()}
        if first not in index or second not in index or first == second:
            return
        a, b = index[first], index[second]
        self._followed[a], self._followed[b] = self._followed[b], self._followed[a]
        self._begin_anew([self._followed[a], self._followed[b]])

    # --- settings

    def set_clock(self, camera: str, clock: ClockModel) -> None:
        """Use this clock for the camera's frames from now on."""
        self._clocks[camera] = clock
        for pipeline in self._pipelines():
            pipeline.set_clock(camera, clock)

    def set_calibration(self, calibration: Calibration) -> None:
        """Use another calibration from now on, and reset the motion; only the first performer is known then."""
        self._clocks, self._calibration = {}, calibration
        self._start(())

    def set_settings(self, settings: SolveSettings) -> None:
        """Use other settings from now on, and reset the motion."""
        self._settings, self._names = settings, settings.camera_names(tuple(self._calibration.cameras))
        if self._crowd is None:
            self._first.set_settings(self._settings_of(FIRST))
        self._begin_anew(self._followed.values())

    def _begin_anew(self, performers: Iterable[_Followed]) -> None:
        """Reset the motion of performers, each with their own settings; all stand on the first one's floor."""
        for one in performers:
            one.pipeline.set_settings(self._settings_of(one.number))
        for one in self._followed.values():
            if one.number != FIRST:
                one.pipeline.stand_beside(self._first)

    # --- poses

    def step(
        self, stage_time_ns: int, pinned: Mapping[str, Mapping[str, Sequence[float]]] | None = None
    ) -> StepResult | None:
        """Return the output frame at a stage time, or None until a camera has seen a performer.

        A time before that of the last step counts as no time passed.

        Args:
            pinned: by performer (`performer_1`) and joint, the place that rigid bodies give it now [m].
        """
        self._last_s = stage_time_ns * 1e-9
        told = pinned or {}
        result = self._first.step(stage_time_ns, told.get(performer_key(FIRST)))
        self._last = result
        if self._crowd is None:
            return result
        steps: list[StepResult] = []
        for index, one in sorted(self._followed.items(), key=lambda item: item[1].number):
            mine = told.get(performer_key(one.number))
            own = result if one.number == FIRST else one.pipeline.step(stage_time_ns, mine)
            if own is not None:
                steps.append(
                    replace(own, performer=one.number, undecided=self._undecided(self._crowd, index))
                )
        return replace(steps[0], others=tuple(steps[1:])) if steps else None

    def _undecided(self, crowd: Crowd, index: int) -> bool:
        doubted = crowd.people[index].doubted
        return bool(doubted) and self._last_s - doubted[-1] < _DOUBT_S

    def on_stage(self) -> list[OnStage]:
        """Return the performers in the order of their numbers, then the strangers present; empty where cameras show
        one body."""
        if self._crowd is None:
            return []
        out: list[OnStage] = []
        for index, one in enumerate(self._crowd.people):
            here, followed = self._last_s - one.person.last_s < _HERE_S, self._followed.get(index)
            if followed is not None or here:
                number = None if followed is None else followed.number
                height = None if followed is None else followed.proportions.height_m
                out.append(OnStage(number, height, here, self._undecided(self._crowd, index)))
        return sorted(out, key=lambda one: (one.performer is None, one.performer or 0))

    def strangers(self) -> dict[int, NDArray[np.float64]]:
        """Return the joints of the strangers present [m], shape (21, 3), by index of person; empty where eight
        performers are followed."""
        full = len(self._followed) >= MOST_PERFORMERS
        people = [] if self._crowd is None or full else self._crowd.people
        return {
            index: one.person.joints_m()
            for index, one in enumerate(people)
            if index not in self._followed and self._last_s - one.person.last_s < _HERE_S
        }

    def people(self) -> list[KnownPerson]:
        """Return the performers, for a pipeline that continues; empty where cameras show one body."""
        if self._crowd is None:
            return []
        return [
            _known(one, self._crowd.people[index].person)
            for index, one in sorted(self._followed.items(), key=lambda item: item[1].number)
        ]


def _known(one: _Followed, person: FollowedPerson) -> KnownPerson:
    seen = np.isfinite(person.last_s)
    return KnownPerson(
        one.number,
        None if one.number == FIRST else one.proportions,
        person.bones_m(),
        person.joints_m(),
        float(person.last_s) if seen else None,
    )


def _bones_of(proportions: Performer | None) -> NDArray[np.float64]:
    """Return the lengths of a performer's bones as `FollowedPerson.bones_m` has them."""
    assert proportions is not None  # Pipeline refuses a calibration without
    lengths = np.linalg.norm(proportions.offsets_m, axis=1)
    return np.where(PARENTS < 0, 0.0, lengths)
