"""Finishing of a take: takes the pipeline's results in time order, and returns them refined once all are there.

Every Gauss-Newton step covers the whole take before the next begins, window by window. A window is solved together
with `MARGIN` frames on either side, whose far ends are fixed. Only the window's own frames are kept
(the restricted additive Schwarz method: Cai, Sarkis, SIAM J. Sci. Comput. 21, 1999). All decisions (standing joints,
their heights, hinges at a limit, accepted measurements) depend only on the take before the step. The division into
windows therefore does not change the result, and memory does not grow with the take.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.base.errors import SettingsError
from studio.engine.edits.pins import Pins
from studio.engine.edits.touches import Touches
from studio.engine.model.calibration import Performer
from studio.engine.model.frames import StepResult
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.solve.touching import HeldJoint
from studio.engine.whole_take.edited import Edited
from studio.engine.whole_take.finish.contact.contacts import JOINTS, Contacts, find_contacts, wander_of
from studio.engine.whole_take.finish.contact.others import Surfaces, meet
from studio.engine.whole_take.finish.contact.soles import Soles, feet_of, lift_m, without_dips
from studio.engine.whole_take.finish.known import Known
from studio.engine.whole_take.finish.lost_limbs import bring_back
from studio.engine.whole_take.finish.measurements import posture_share
from studio.engine.whole_take.finish.posing import Posing
from studio.engine.whole_take.finish.readings import Readings
from studio.engine.whole_take.finish.smoother import Smoother
from studio.engine.whole_take.finish.store import Store
from studio.engine.whole_take.finish.trajectory import Kinematics, moved, steps_between
from studio.engine.whole_take.finish.windows import MARGIN, WINDOW
from studio.engine.whole_take.physics.correction import ITERATIONS as PHYSICS_ITERATIONS
from studio.engine.whole_take.physics.whole_take import Physics
from studio.engine.whole_take.stepping import HELD, Passes, Steps

ITERATIONS = 3
SCALED_ITERATIONS = 1
CONTACT_ITERATIONS = 3
"""Iterations: before standing feet are known, with the estimated noise, and with contacts."""


@dataclass(frozen=True)
class _Refined:
    """A take before physics.

    Attributes:
        q: configurations, shape (frame_count, nq).
        pieces: begin and end of each piece without a gap [frames].
        contacts: stances; None = unknown.
        edited: frames that were solved again with edits, shape (frame_count,).
        before: configurations of these frames, and all stances, without edits.
    """

    q: NDArray[np.float64]
    pieces: list[tuple[int, int]]
    contacts: Contacts | None
    edited: NDArray[np.bool_]
    before: tuple[NDArray[np.float64], Contacts | None]


class Finisher:
    """Refines results: `add` all of them in time order, then read `results`.

    Several performers first `refine`, and then make room for one another (`step_beside`).

    Attributes:
        floor_given: as in `Calibration`.
        lifted_m: how far the results were raised onto the floor [m].
    """

    def __init__(
        self,
        performer: Performer,
        settings: SolveSettings,
        *,
        floor_given: bool = False,
        pins: Pins | None = None,
        edited: Edited | None = None,
    ) -> None:
        """Prepare for a performer.

        Args:
            floor_given: as in `Calibration`: the take stays on its floor.
            pins: places of joints that are known.
            edited: changes by edits in some stretches; None = nothing.

        Raises:
            SettingsError: `ik=none` has no humanoid to refine.
        """
        if settings.ik == "none":
            raise SettingsError(
                "settings.finish_needs_pose",
                "finish=on needs a solved pose; allowed with it: ik=previous_pose, "
                "combined_skeleton, kalman_filter",
            )
        limited = settings.human_limits == "on"
        humanoid = build_humanoid(
            Skeleton.of(performer), human_limits=limited, flexibility=settings.flexibility
        )
        self._dt = 1.0 / settings.output_hz
        self._humanoid, self._kinematics = humanoid, Kinematics(humanoid)
        effectors, usual = settings.effectors, SolveSettings().effectors
        self._reach = np.array([effectors[name].reach / usual[name].reach for name in CANONICAL])
        self._first, self._smoother = (
            Smoother(humanoid, self._dt, limited=limited, lively=lively, effectors=effectors)
            for lively in (False, True)
        )
        self._physics = Physics(humanoid, self._dt, limited=limited) if settings.physics == "on" else None
        self._with_contacts = settings.floor_contact == "on"
        rest = humanoid.skeleton.rest_positions_m
        self._rest_heights_m = rest[OUTPUT_OF_CANONICAL_INDEX[list(JOINTS)], 2]
        self._last_feet = np.empty((0, 0)), Soles(np.empty((0, len(JOINTS), 3)), np.empty((0, len(JOINTS))))
        self._floor_given = floor_given
        self._root_height_m = performer.root_height_m if floor_given else None
        self.floor_given, self.lifted_m = floor_given, 0.0
        self._beside: Finisher | None = None
        self._refined: _Refined | None = None
        self._posing = Posing(performer, settings, humanoid.skeleton)
        self._store: Store | None = None
        self._cuts: list[int] = []
        self._pins, self._edited = pins or None, edited
        self._stretches: list[tuple[int, Store]] = []  # the first frame of each, and its steps with edits

    @property
    def physics_report(self) -> SolveMetrics:
        """Effect of physics, for `metrics.json`; empty without physics and before `results`."""
        return {} if self._physics is None else self._physics.report

    @property
    def touches(self) -> Touches | None:
        """Contacts set by an operator; None = none."""
        pins = self._pins if self._edited is None else self._edited.pins
        return None if pins is None else pins.touches

    @property
    def has_results(self) -> bool:
        """Whether there is anything to refine."""
        return self._store is not None

    def add(self, result: StepResult) -> None:
        """Add a result."""
        if self._store is None:
            self._store = Store(result)
        self._store.add(result)

    def add_edited(self, result: StepResult) -> None:
        """Add the version with edits of the result that was added last."""
        assert self._store is not None
        frame = len(self._store) - 1
        if not self._stretches or sum((self._stretches[-1][0], len(self._stretches[-1][1]))) != frame:
            self._stretches.append((frame, Store(result)))
        self._stretches[-1][1].add(result)

    def cut(self) -> None:
        """Begin a piece: the next result does not continue from the last one."""
        if self._store is not None:
            self._cuts.append(len(self._store))

    def refine(self, progress: Callable[[float], None] = lambda share: None, *, beside: int = 0) -> None:
        """Make all steps except those with other performers and those of physics.

        Args:
            progress: receives the share done, here and in the following steps.
            beside: number of steps with other performers that follow.
        """
        assert self._store is not None
        self._passes = Passes(progress, self._pass_count() + beside)
        self._readings = Readings(self._store, self._kinematics, self._dt, self._reach)
        self._steps = self._steps_with(self._pins)
        q, pieces = self._readings.first.copy(), self._pieces(self._store)
        for first, last in pieces:
            bring_back(q[first:last], self._readings.far[first:last], self._dt)
        for _ in range(ITERATIONS):
            self._step(q, pieces, None, self._first)
        self._readings.weigh(q, pieces)
        alike = self._readings.alike
        for smoother in (
            [self._smoother] if self._physics is None else [self._smoother, self._physics.correction]
        ):
            smoother.posture_share, smoother.calm = posture_share(alike), wander_of(alike)
        contacts = self._settled(q, pieces, pieces)
        nowhere = np.zeros(len(q), dtype=bool)
        self._refined = _Refined(q, pieces, contacts, nowhere, (q[:0], contacts))
        if self._edited is not None:
            self._refined = self._refined_again(self._refined, self._edited)

    def _settled(
        self,
        q: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        rows: list[tuple[int, int]],
        lifted_m: float | None = None,
    ) -> Contacts | None:
        """Make the steps with known noise over some stretches, in place; return the take's stances."""
        for _ in range(SCALED_ITERATIONS):
            self._step(q, rows, None)
        contacts = None
        if self._with_contacts:
            feet = self._feet(q)
            found = find_contacts(
                feet.joints_m, pieces, self._dt, self._rest_heights_m,
                floor_given=self._floor_given, wander=self._readings.wander,
            )  # fmt: skip
            contacts = self._steps.known.standing(
                found, feet, pieces, self._rest_heights_m, floor_given=self._floor_given, lifted_m=lifted_m
            )
        known = self._steps.known
        touches = bool(known.touches)
        for iteration in range(CONTACT_ITERATIONS if contacts is not None or touches else 0):
            if contacts is not None and iteration > 0:
                feet = self._feet(q)
                contacts = contacts.at_places_of(feet.joints_m, pieces, self._dt)
                if not self._floor_given:
                    contacts = without_dips(feet, contacts)
                    known.raise_feet(feet, contacts)
            if touches:
                floor_m = 0.0 if contacts is None else contacts.floor_m
                known.touch(self._kinematics, q, pieces, floor_m)
            self._step(q, rows, contacts)
        return contacts

    def _refined_again(self, refined: _Refined, edited: Edited) -> _Refined:
        """Return a refined take, solved again where edits change it; the rest stays as it is."""
        assert self._store is not None
        q, pieces, contacts = refined.q.copy(), refined.pieces, refined.contacts
        lifted_m = None if contacts is None else lift_m(self._feet(q), contacts)
        also = np.zeros(len(q), dtype=bool)
        if contacts is not None and edited.pins.stances:
            also = (edited.pins.stances.asked(self._times_s, contacts.hold, pieces) != 0).any(axis=1)
        share = edited.share(self._times_s, also)[:, None]
        for first, steps in self._stretches:
            self._store.lay_over(first, steps)
            again = Readings(steps, self._kinematics, self._dt, self._reach)
            bring_back(again.first, again.far, self._dt)
            self._readings.lay_over(first, again)
            part = slice(first, first + len(steps))
            q[part] = moved(q[part], share[part] * steps_between(q[part], again.first))
        moves = share[:, 0] > 0.0
        self._steps = self._steps_with(edited.pins, ~moves)
        rows = [
            (max(begin - HELD, first), min(end + HELD, last))
            for first, last in pieces
            for begin, end in runs(moves[first:last], first)
        ]
        for _ in range(ITERATIONS):
            self._step(q, rows, None, self._first)
        stands = self._settled(q, pieces, rows, lifted_m)
        self._steps = Steps(self._readings, self._steps.known, self._passes)
        before = refined.q[moves]
        q[moves] = moved(before, share[moves] * steps_between(before, q[moves]))
        if contacts is not None and stands is not None:
            stands = contacts.with_rows(moves, stands)
        return _Refined(q, pieces, stands, moves, (before, contacts))

    def _steps_with(self, pins: Pins | None, fixed: NDArray[np.bool_] | None = None) -> Steps:
        known = Known(pins or None, self._times_s, self._dt, self._humanoid.skeleton.height_m)
        return Steps(self._readings, known, self._passes, fixed)

    @property
    def _times_s(self) -> NDArray[np.float64]:
        assert self._store is not None
        return 1e-9 * self._store.times_ns.astype(np.float64)

    def surfaces(self) -> Surfaces:
        """Return the refined performer's surfaces."""
        assert self._refined is not None and self._store is not None
        sites = self._kinematics.sites(self._refined.q)
        return Surfaces(self._store.times_ns, sites, self._humanoid.skeleton.height_m)

    def step_beside(self, own: Surfaces, others: Sequence[Surfaces], held: Sequence[HeldJoint] = ()) -> None:
        """Make a step that makes room for other performers, and brings together hands that hold each other.

        Args:
            own: this performer's surfaces before the step.
            others: those of all others.
            held: joints that touch others, as set by an operator.
        """
        assert self._refined is not None
        self._steps.known.hold(held)
        met = [meet(own, other, self._dt) for other in others]
        refined = self._refined
        self._steps.step(refined.q, refined.pieces, refined.contacts, self._smoother, met)

    def stand_beside(self, other: "Finisher") -> None:
        """Raise the results as far as those of another performer, whose feet placed the floor. Their results must be
        read first."""
        self._beside = other

    def results(self, progress: Callable[[float], None] = lambda share: None) -> Iterator[StepResult]:
        """Yield all results, finished; `progress` receives the share done."""
        if self._store is None:
            return
        if self._refined is None:
            self.refine(progress)
        assert self._refined is not None
        q, pieces, contacts = self._refined.q, self._refined.pieces, self._refined.contacts
        for begin in range(0, len(q), WINDOW):
            q[begin : begin + WINDOW] = self._smoother.within_limits(q[begin : begin + WINDOW])
        if self._physics is not None:
            q = self._with_physics(self._physics, q, pieces, contacts)
        if self._beside is not None:
            self.lifted_m = self._beside.lifted_m
            if self._root_height_m is not None:  # measured over the calibrated floor, not the true one
                self._root_height_m += self.lifted_m
        elif contacts is not None and not self._floor_given:
            self.lifted_m = self._lift_m(q, self._refined)
        squared_radii = self._squared_radii(q, pieces)
        q[:, 2] += self.lifted_m
        posed = self._posing.results(
            self._store, q, squared_radii, lifted_m=self.lifted_m, root_height_m=self._root_height_m
        )
        for k, result in enumerate(posed):
            if k % WINDOW == 0:
                self._passes.tell(k / len(q))
            yield result
        self._store.close()

    def _lift_m(self, q: NDArray[np.float64], refined: _Refined) -> float:
        """Distance by which the take is raised: that without edits, because edits would move the whole take."""
        before, contacts = refined.before
        assert contacts is not None
        if len(before):
            q = q.copy()
            q[refined.edited] = self._smoother.within_limits(before)
        return lift_m(self._feet(q), contacts)

    def _pass_count(self) -> int:
        """Number of passes over the take: all steps, and the poses at the end."""
        contacts = CONTACT_ITERATIONS if self._with_contacts else 0
        physics = PHYSICS_ITERATIONS if self._physics is not None else 0
        times = 1 if self._edited is None else 2
        return times * (ITERATIONS + SCALED_ITERATIONS + contacts) + physics + 1

    def _pieces(self, store: Store) -> list[tuple[int, int]]:
        """Begin and end of each piece of the take without a gap or cut [frames]."""
        gaps = np.flatnonzero(np.diff(store.times_ns) * 1e-9 > 1.5 * self._dt) + 1
        inner = {*gaps.tolist(), *self._cuts} - {0, len(store)}
        return list(pairwise([0, *sorted(inner), len(store)]))

    def _with_physics(
        self,
        physics: Physics,
        q: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        contacts: Contacts | None,
    ) -> NDArray[np.float64]:
        """The take corrected by physics where that improves its figures."""
        assert self._store is not None
        store, corrected = self._store, q.copy()
        for _ in range(PHYSICS_ITERATIONS):
            self._step(corrected, pieces, contacts, physics.correction)

        def fused(begin: int, end: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            records = store.read(begin, end)
            return records["fused"].astype(np.float64), records["sigma"].astype(np.float64)

        return physics.joined(q, self._smoother.within_limits(corrected), pieces, contacts, fused)

    def _step(
        self,
        q: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        contacts: Contacts | None,
        smoother: Smoother | None = None,
    ) -> None:
        """Apply one step to the take, in place; `smoother` None = finishing's."""
        self._steps.step(q, pieces, contacts, smoother or self._smoother)

    def _feet(self, q: NDArray[np.float64]) -> Soles:
        """Return the feet; those of configurations that have not changed since the last call are reused."""
        was, feet = self._last_feet
        if len(was) != len(q):
            feet = feet_of(self._humanoid, q, self._rest_heights_m)
        else:
            new = (q != was).any(axis=1)
            feet = feet.changed(new, feet_of(self._humanoid, q[new], self._rest_heights_m))
        self._last_feet = q.copy(), feet
        return feet

    def _squared_radii(self, q: NDArray[np.float64], pieces: list[tuple[int, int]]) -> NDArray[np.float64]:
        """Squared radii of the canonical joints' 90 % balls [m2], shape (frame_count, 21)."""
        out = np.empty((len(q), JOINT_COUNT))
        for first, last in pieces:
            for begin in range(first, last, WINDOW):
                end = min(begin + WINDOW, last)
                low, high = max(begin - MARGIN, first), min(end + MARGIN, last)
                found = self._smoother.squared_radii(q[low:high], self._readings.of(low, high))
                out[begin:end] = found[begin - low : end - low]
        return out
