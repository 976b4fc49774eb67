"""Performers on the live stage, on the engine thread: who is there, what they are called, and who is whom."""

from abc import abstractmethod

from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.identity.known import KnownPerson
from studio.engine.identity.recognised import FIRST, OnStage
from studio.engine.model.calibration import Performer
from studio.live.calibration.in_use import CalibratedStage
from studio.live.calibration.performers import list_profiles, recognised_profile, save_profile
from studio.live.performers.cast import Cast, CastMember
from studio.live.performers.sightings import Sightings
from studio.take.folder.known_performers import performers_meta
from studio.take.folder.meta import TakePerformerMeta
from studio.take.folder.performers import performer_number
from studio.take.folder.take import Take
from studio.take.raw import live_log as log


class PerformedStage(CalibratedStage):
    """The part of the engine for several performers; all methods run on its thread.

    Attributes:
        cast: their names.
        members: who is on the stage, by number, for other threads; one performer alone has no entry.
        sightings: which camera sees whom.
    """

    _pipeline: log.LoggedPipeline

    def __init__(self) -> None:
        super().__init__()
        self.cast = Cast()
        self.members: dict[int, CastMember] = {}
        self.sightings = Sightings()

    @abstractmethod
    def _restart(self, *, moved: bool = False, people: list[KnownPerson] | None = None) -> None:
        """Start a fresh pipeline; see `Engine`."""

    def people(self) -> list[KnownPerson]:
        """The performers, where cameras show several bodies."""
        return [] if self._pipeline.pipeline is None else self._pipeline.pipeline.people()

    def on_stage(self) -> list[OnStage]:
        """Everybody on the stage; empty where cameras show one body."""
        return [] if self._pipeline.pipeline is None else self._pipeline.pipeline.on_stage()

    def refresh_members(self) -> None:
        """Update `members`, by which other threads know who is on the stage."""
        calibrated = None if self.stage_calibration is None else self.stage_calibration.performer
        self.members = {
            one.performer: CastMember(
                self.cast.name(one.performer), calibrated if one.proportions is None else one.proportions
            )
            for one in self.people()
        }

    def known_performers(self) -> list[TakePerformerMeta]:
        """The performers on a stage of several, as stored in a take."""
        return performers_meta(self.people())

    def given_names(self) -> dict[str, str]:
        """The names of performers on a stage of several, as stored in a take."""
        return self.cast.given() if self.people() else {}

    def restore_performers(self, take: Take) -> None:
        """Give performers the names of a resumed take."""
        named = take.meta.get("performer_names", {})
        self.cast.restore({performer_number(performer): name for performer, name in named.items()})

    def _numbers(self) -> list[int]:
        return [one.performer for one in self.people()]

    def _measured_stranger(self, person: int, performer: Performer | None) -> None:
        self.strangers.finish(person, performer)
        if performer is None:
            return
        before = self._numbers()
        self._perform(log.performer_event(person, performer))
        for number in set(self._numbers()) - set(before):
            profile = recognised_profile(list_profiles(self.folder), performer)
            if profile is not None and not self.cast.is_taken(profile.name, before):
                self.cast.rename(number, profile.name, before)

    def forget_performers(self, name: str | None = None) -> None:
        """Forget a performer, and start a fresh pipeline; None: forget all but the first.

        Raises:
            TakeError: a take is being recorded.
            SettingsError: there is no performer of that name.
            CalibrationError: it is the first performer.
        """
        if self.recording is not None:
            raise TakeError(
                "recording.performers_fixed", "a take is being recorded; stop it, then forget the performers"
            )
        people = self.people()
        if name is None:
            kept = people[:1]
        else:
            number = self.cast.number(name, self._numbers())
            if number == FIRST:
                raise CalibrationError(
                    "performers.first",
                    "{name} has the proportions of the calibration and cannot be forgotten; calibrate the stage with "
                    "somebody else",
                    name=name,
                )
            kept = [one for one in people if one.performer != number]
        self.cast.keep([FIRST, *(one.performer for one in kept)])
        self._restart(people=kept)

    def rename_performer(self, name: str, new: str) -> None:
        """Rename a performer, also within a recording.

        Raises:
            SettingsError: there is no performer of that name.
            TakeError: a name that is not allowed, or that another one has.
        """
        numbers = self._numbers()
        number = self.cast.number(name, numbers)
        self.cast.rename(number, new, [other for other in numbers if other != number])

    def exchange_performers(self, first: str, second: str) -> None:
        """Exchange the identities of two performers from now on, also within a recording.

        Raises:
            SettingsError: there is no performer of one of the names.
        """
        numbers = self._numbers()
        one, other = (self.cast.number(name, numbers) for name in (first, second))
        self._perform(log.ExchangedEvent(one, other))

    def keep_profile(self, name: str) -> None:
        """Store a performer's measured proportions as the profile of their name; an older one is replaced.

        Raises:
            SettingsError: there is no performer of that name.
            StudioError: the folder cannot be written.
        """
        self.refresh_members()
        member = self.members[self.cast.number(name, self._numbers())]
        if member.proportions is not None:
            save_profile(self.folder, name, member.proportions)
