"""Simulated performers: statures, builds, clothes, in separate sets for tuning and scoring.

A tracker's settings may be chosen on `TUNING`; reported figures come from `SCORING`. The sets share no name, hand,
build or seed.
"""

from dataclasses import dataclass

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import unknown


@dataclass(frozen=True)
class Actor:
    """A body, its clothes and its hands.

    Attributes:
        name: on the command line.
        height_m: stature.
        girth: of trunk and limbs, 1 = average.
        belly, bust: of these alone, 1 = average man.
        legs, arms: length relative to stature, 1 = average.
        shoulders, hips: breadth relative to stature, 1 = average.
        head: size relative to an adult's of this stature; larger for a child.
        hand: size of the hand relative to the distance from wrist to knuckles.
        finger: length of the fingers relative to the hand.
        hair: none, short, bob or tail.
        sleeve: end of the sleeves, 0 = shoulder, 1 = elbow, 2 = wrist.
        trouser: end of the trouser legs, 1 = knee, 2 = ankle.
        looseness_m: distance of the clothes from the body.
        skirt_m: length of the shirt below the hip joints.
        albedo: reflectivity of shirt, trousers, hair, skin and shoes at 850 nm, 0..1.
        seed: of clothes folds, head turns and hand changes.
    """

    name: str
    height_m: float = 1.75
    girth: float = 1.0
    belly: float = 1.0
    bust: float = 0.0
    legs: float = 1.0
    arms: float = 1.0
    shoulders: float = 1.0
    hips: float = 1.0
    head: float = 1.0
    hand: float = 1.0
    finger: float = 1.0
    hair: str = "short"
    sleeve: float = 1.8
    trouser: float = 1.9
    looseness_m: float = 0.014
    skirt_m: float = 0.04
    albedo: tuple[float, float, float, float, float] = (0.55, 0.40, 0.15, 0.60, 0.35)
    seed: int = 1


TUNING: tuple[Actor, ...] = (
    Actor("tuning-average", seed=11),
    Actor("tuning-slim", height_m=1.66, girth=0.88, belly=0.7, bust=0.8, shoulders=0.92, hips=1.04, hand=0.94,
              finger=1.05, hair="tail", sleeve=0.9, looseness_m=0.009, skirt_m=0.0,
              albedo=(0.7, 0.25, 0.12, 0.62, 0.5), seed=12),
    Actor("tuning-heavy", height_m=1.83, girth=1.15, belly=1.45, arms=1.03, legs=0.98, hand=1.06, finger=0.95,
              hair="none", sleeve=1.1, looseness_m=0.02, skirt_m=0.09, albedo=(0.35, 0.5, 0.3, 0.58, 0.3), seed=13),
    Actor("tuning-child", height_m=1.22, girth=0.97, head=1.2, legs=0.94, arms=0.97, hand=0.92, hair="bob",
              sleeve=0.8, trouser=1.1, looseness_m=0.011, albedo=(0.5, 0.6, 0.2, 0.65, 0.6), seed=14),
)  # fmt: skip
"""Performers for tuning a tracker's settings."""

SCORING: tuple[Actor, ...] = (
    Actor("scoring-average", height_m=1.77, girth=1.04, belly=1.1, legs=1.02, shoulders=1.03, hand=1.03,
              finger=1.02, hair="bob", sleeve=1.0, looseness_m=0.016, albedo=(0.6, 0.3, 0.17, 0.57, 0.4), seed=91),
    Actor("scoring-slim", height_m=1.71, girth=0.84, belly=0.65, bust=0.6, legs=1.03, arms=1.02, shoulders=0.95,
              hips=0.98, hand=0.97, finger=0.97, hair="short", sleeve=1.9, looseness_m=0.012, skirt_m=0.02,
              albedo=(0.3, 0.55, 0.1, 0.63, 0.25), seed=92),
    Actor("scoring-heavy", height_m=1.74, girth=1.2, belly=1.35, bust=0.5, legs=0.97, arms=0.97, hips=1.06,
              hand=1.01, finger=0.92, hair="tail", sleeve=1.6, looseness_m=0.022, skirt_m=0.1,
              albedo=(0.45, 0.35, 0.2, 0.6, 0.45), seed=93),
    Actor("scoring-tall", height_m=2.1, girth=0.95, legs=1.04, arms=1.05, hand=1.08, finger=1.06, hair="none",
              sleeve=0.8, trouser=1.1, looseness_m=0.018, albedo=(0.65, 0.45, 0.3, 0.55, 0.5), seed=94),
    Actor("scoring-child", height_m=0.9, girth=1.06, belly=1.15, head=1.45, legs=0.88, arms=0.92, hand=0.9,
              finger=0.9, hair="short", sleeve=1.8, looseness_m=0.01, skirt_m=0.01,
              albedo=(0.5, 0.45, 0.22, 0.66, 0.5), seed=95),
)  # fmt: skip
"""Performers for reported figures."""

PERFORMERS: dict[str, Actor] = {performer.name: performer for performer in (*TUNING, *SCORING)}
DEFAULT = TUNING[0]


def find_performer(name: str) -> Actor:
    """Return the performer with a name.

    Raises:
        SettingsError: unknown name.
    """
    if name not in PERFORMERS:
        raise SettingsError(unknown("performer", name, PERFORMERS))
    return PERFORMERS[name]
