"""Assigns the bodies in every camera's frames to persons, frame by frame, as live needs it.

Persons and bodies are paired jointly (Hungarian method). A device's own number of a body is not needed: it changes
where bodies are lost, and may be exchanged where they overlap.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.identity.person import FollowedPerson

_FITS = 6.0
"""Largest deviation of a body from its person."""

_NEAR_M = 0.4
"""An unassigned body nearer than this to a person who is seen in the same frame is a device's ghost."""

_PROVES_S = 0.3
_PROVES_FRAMES = 8
_FORGETS_S = 0.5
_AWAY_S = 1.0
_RETURN_S = 1.0
"""Time until a person who was away is recognised by their bones, if these are clearly theirs."""

_WAITS_S = 2.0
"""Time before a person is identified whose bones fit nobody who is away, or two of them."""

_GUESSED_S = 3.0
"""Time in doubt of a person whose bones fit two who are away even then."""

_CUT_S = 0.1
"""A person who disappears at most this long after another appears may be the same one, after a cut."""
ALIKE_M = 0.025
CLEAR_M = 0.006
"""Bones are clearly one person's if those of any other differ by this much more, mean over the bones."""

_DOUBT = 1.5
"""Two persons are not told apart if exchanging their bodies costs less than this."""

_MEETS = 6.0
"""Two persons have met if exchanging their bodies costs less than this; the whole take then decides again."""

_NOBODY = 1e3


@dataclass(frozen=True)
class SeenBody:
    """A body in a frame: index of the frame among all added frames, and of the body in it."""

    frame: int
    body: int


@dataclass
class Someone:
    """A person of the crowd: their present state, and every body that was theirs.

    Attributes:
        sightings: their bodies, in the order of time.
        doubted: times at which the person was not told apart from another, stage time [s].
        met: by the index of another person, times at which they were so near that they may have been exchanged.
        leapt: times at which the person was found again at another place, or after being away.
        guessed_s: time at which the person came back with bones that fit two who were away [s].
    """

    person: FollowedPerson
    sightings: list[SeenBody] = field(default_factory=list)
    doubted: list[float] = field(default_factory=list)
    met: dict[int, list[float]] = field(default_factory=dict)
    leapt: list[float] = field(default_factory=list)
    guessed_s: float = -np.inf

    def goes_on_as(self, person: FollowedPerson) -> None:
        """Continue where the same person was found again."""
        person.remember(self.person)
        self.person = person

    def forget(self) -> None:
        """Forget the past except the last doubt."""
        self.sightings.clear()
        self.met.clear()
        self.leapt.clear()
        del self.doubted[:-1]


class Crowd:
    """Everybody on the stage; frames are added in the order of their stage times."""

    def __init__(self, people: Sequence[FollowedPerson] = (), *, remembers: bool = True) -> None:
        """Begin with persons who are known from before.

        Args:
            people: these persons.
            remembers: keep sightings, meetings and leaps, which whole takes need; else only the last doubt.
        """
        self.people = [Someone(person) for person in people]
        self._remembers = remembers
        self._new: list[Someone] = []
        self._frames = 0

    def add(self, stage_s: float, bodies: NDArray[np.float64]) -> list[int | None]:
        """Return the person of each body, an index of `people`; None = not known yet.

        A person is known after 0.3 s, or 1 to 2 s if known people are away. `Someone.sightings` then includes the
        earlier bodies.

        Args:
            stage_s: time of the frame [s].
            bodies: joints in the stage frame [m], shape (body_count, 21, 3); NaN = unseen.
        """
        from scipy.optimize import linear_sum_assignment  # slow to load, and one performer does not need it

        frame, self._frames = self._frames, self._frames + 1
        here = [k for k, one in enumerate(self.people) if stage_s - one.person.last_s < _AWAY_S]
        cost = _costs([self.people[k] for k in here], stage_s, bodies)
        found: list[int | None] = [None] * len(bodies)
        for row, body in zip(*linear_sum_assignment(cost), strict=True):
            if cost[row, body] < _FITS:
                found[body] = here[row]
        self._doubt(stage_s, here, cost, found)
        for body, who in enumerate(found):
            if who is not None:
                self._take_over(self.people[who], stage_s, bodies[body])
                self._goes_on(self.people[who], stage_s, bodies[body], SeenBody(frame, body))
                if stage_s - self.people[who].guessed_s < _GUESSED_S:
                    self.people[who].doubted.append(stage_s)
        for body, who in enumerate(found):
            if who is None and not self._is_ghost(bodies[body], found, stage_s):
                found[body] = self._unknown(stage_s, bodies[body], SeenBody(frame, body))
        self._new = [one for one in self._new if stage_s - one.person.last_s < _FORGETS_S]
        if not self._remembers:
            for one in (*self.people, *self._new):
                one.forget()
        return found

    @staticmethod
    def _goes_on(one: Someone, stage_s: float, joints: NDArray[np.float64], sighting: SeenBody) -> None:
        one.person.add(stage_s, joints)
        one.sightings.append(sighting)

    def _take_over(self, one: Someone, stage_s: float, joints: NDArray[np.float64]) -> None:
        """Give a person the sightings of somebody new at the same place: they were the same person, after a leap."""
        for other in self._new:
            began_s = other.person.first_s
            if one.person.last_s <= began_s and other.person.deviation(stage_s, joints[None])[0] < _FITS:
                one.sightings += other.sightings
                one.leapt.append(began_s)
                one.goes_on_as(other.person)
                self._new.remove(other)
                return

    def _doubt(
        self, stage_s: float, here: list[int], cost: NDArray[np.float64], found: list[int | None]
    ) -> None:
        """Register pairs of persons whose bodies may be exchanged."""
        of = {who: body for body, who in enumerate(found) if who is not None}
        for a, first in enumerate(here):
            for b, second in enumerate(here[:a]):
                if first in of and second in of:
                    i, j = of[first], of[second]
                    margin = cost[a, j] + cost[b, i] - cost[a, i] - cost[b, j]
                elif first in of or second in of:  # one of them is hidden here
                    body = of[first] if first in of else of[second]
                    margin = abs(cost[a, body] - cost[b, body])
                else:
                    continue
                if margin < _MEETS:
                    self.people[first].met.setdefault(second, []).append(stage_s)
                    self.people[second].met.setdefault(first, []).append(stage_s)
                if margin < _DOUBT:
                    self.people[first].doubted.append(stage_s)
                    self.people[second].doubted.append(stage_s)

    def _is_ghost(self, joints: NDArray[np.float64], found: list[int | None], stage_s: float) -> bool:
        """Whether a body is a second one of a person who is seen in the same frame, or has no joint."""
        seen = joints[np.isfinite(joints[:, 0])]
        if len(seen) == 0:
            return True
        middle = seen.mean(axis=0)
        people = [self.people[who].person for who in found if who is not None]
        return any(float(np.linalg.norm(one.middle() - middle)) < _NEAR_M for one in people)

    def _unknown(self, stage_s: float, joints: NDArray[np.float64], sighting: SeenBody) -> int | None:
        """Follow somebody new; return their person once they have proved to be there."""
        fits = [float(one.person.deviation(stage_s, joints[None])[0]) for one in self._new]
        if not fits or min(fits) >= _FITS:
            self._new.append(Someone(FollowedPerson(stage_s, joints), [sighting]))
            return None
        one = self._new[int(np.argmin(fits))]
        self._goes_on(one, stage_s, joints, sighting)
        known_s = stage_s - one.person.first_s
        away = [k for k, other in enumerate(self.people) if other.person.last_s < one.person.first_s + _CUT_S]
        if known_s < (_RETURN_S if away else _PROVES_S) or one.person.frames < _PROVES_FRAMES:
            return None
        back, clear = self._returned(one, away)
        if away and not clear and known_s < _WAITS_S:
            return None
        self._new.remove(one)
        if back is None:
            self.people.append(one)
            return len(self.people) - 1
        if not clear:
            self.people[back].guessed_s = stage_s
        self.people[back].leapt.append(one.person.first_s)
        self.people[back].goes_on_as(one.person)
        self.people[back].sightings += one.sightings
        return back

    def _returned(self, one: Someone, away: list[int]) -> tuple[int | None, bool]:
        """Return the absent person with this person's bones, None = nobody; and whether nobody else's fit as well."""
        bones = one.person.bones_m()
        far = sorted((apart_m(bones, self.people[k].person.bones_m()), k) for k in away)
        if not far or far[0][0] >= ALIKE_M:
            return None, False
        return far[0][1], len(far) == 1 or far[1][0] - far[0][0] > CLEAR_M


def _costs(people: list[Someone], stage_s: float, bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the deviation of each body from each person, shape (person_count, body_count)."""
    cost = np.full((len(people), len(bodies)), _NOBODY)
    for row, one in enumerate(people):
        cost[row] = np.minimum(one.person.deviation(stage_s, bodies), _NOBODY)
    return cost


def apart_m(bones: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    """Return the mean difference of two persons' bones [m]; infinite where they share too few."""
    apart = np.abs(bones - others)[1:]
    seen = np.isfinite(apart)
    return float(apart[seen].mean()) if seen.sum() >= 6 else np.inf
