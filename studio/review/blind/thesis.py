"""The pairs that the thesis showed, as a test of any take: the solves, and the pairs of solves.

Source: Ménard 2014, chapters 5.6 and 6.2. Each pair departs in one point from the settings that the thesis retained.
"""

from dataclasses import dataclass

from studio.review.blind.model import Interpolation, Pair, Side

QUESTION = "Which of the two movements looks better?"
PREFIX = "blind_"
KEYS_HZ = 15.0
"""Key rate of the pair about interpolation, low enough that held keys are visible."""


@dataclass(frozen=True)
class Solve:
    """A solve of a test: preset and changes."""

    preset: str
    changes: dict[str, str]


_RETAINED = "retained"
_VARIANTS: dict[str, Solve] = {
    _RETAINED: Solve("thesis", {}),
    "no_ik": Solve("thesis", {"ik": "none"}),
    "combined": Solve("thesis", {"ik": "combined_skeleton"}),
    "no_limits": Solve("thesis", {"human_limits": "off"}),
    "no_bone_length": Solve("thesis", {"bone_length_limit": "off"}),
    "no_displacement": Solve("thesis", {"displacement_limit": "none"}),
    "displacement_before": Solve("thesis", {"displacement_limit": "before"}),
    "no_look_at": Solve("thesis", {"look_at": "off", "hands": "off"}),
}
_ONE_CAMERA = "one_camera"

_PAIRS: tuple[tuple[str, tuple[str, str], tuple[str, str]], ...] = (
    ("inverse kinematics", ("no IK", "no_ik"), ("previous pose", _RETAINED)),
    ("inverse kinematics", ("no IK", "no_ik"), ("combined skeleton", "combined")),
    ("inverse kinematics", ("combined skeleton", "combined"), ("previous pose", _RETAINED)),
    ("human limits", ("limits off", "no_limits"), ("limits on", _RETAINED)),
    ("bone length limit", ("bone length off", "no_bone_length"), ("bone length on", _RETAINED)),
    ("displacement limit", ("displacement none", "no_displacement"), ("displacement after", _RETAINED)),
    ("displacement limit", ("displacement before", "displacement_before"), ("displacement after", _RETAINED)),
    ("head and hands", ("look-at and hands off", "no_look_at"), ("look-at and hands on", _RETAINED)),
    ("everything", ("one camera, raw", _ONE_CAMERA), ("everything", _RETAINED)),
)


def solves(cameras: tuple[str, ...]) -> dict[str, Solve]:
    """Return the solves of the test, by name, for a take of these cameras."""
    variants = {**_VARIANTS, _ONE_CAMERA: Solve("raw", {"cameras": cameras[0]})}
    return {PREFIX + name: solve for name, solve in variants.items()}


def pairs(take: str, *, start_s: float = 0.0, end_s: float = 0.0) -> tuple[Pair, ...]:
    """Return the pairs of a take, `session/name`, from its existing solves."""

    def side(condition: str, name: str) -> Side:
        return Side(condition=condition, take=take, solve=PREFIX + name)

    made = [Pair(a=side(*a), b=side(*b), start_s=start_s, end_s=end_s, title=title) for title, a, b in _PAIRS]
    kinds: tuple[tuple[str, Interpolation], ...] = (
        ("no interpolation", "held"),
        ("cubic interpolation", "cubic"),
    )
    held, cubic = (
        Side(condition=condition, take=take, solve=PREFIX + _RETAINED, key_hz=KEYS_HZ, interpolation=kind)
        for condition, kind in kinds
    )
    return (*made, Pair(a=held, b=cubic, start_s=start_s, end_s=end_s, title="interpolation"))
