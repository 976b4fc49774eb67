"""The figures of the thesis's tables 5.1 to 5.6 and 6.1, and the solves that reproduce them.

Source: Ménard, "Génération d'animations par capture de mouvements avec multiples caméras 3D", École Polytechnique de
Montréal 2014.
"""

from dataclasses import dataclass

FOUR: tuple[str, ...] = ("absolute_difference_cm", "shortest_distance_cm", "spike_difference", "deviations")
"""The thesis's figures, in the order of its tables."""

LABELS: dict[str, str] = {
    "absolute_difference_cm": "absolute difference, cm",
    "shortest_distance_cm": "shortest distance, cm",
    "spike_difference": "spike difference",
    "deviations": "deviations",
    "mpjpe_mm": "joint error, mm",
    "cleanup_events_per_min": "clean-up events a minute",
}
"""All figures of the tables; the last two are not in the thesis."""


@dataclass(frozen=True)
class Condition:
    """A column of a table.

    Attributes:
        title: heading.
        variant, cameras, interference: key of its cells.
        thesis: the thesis's four figures; None if it lacks this column.
    """

    title: str
    variant: str
    cameras: int
    interference: bool
    thesis: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Table:
    """A table of the thesis; changes are relative to the first condition."""

    number: str
    title: str
    conditions: tuple[Condition, ...]

    @property
    def base(self) -> Condition:
        return self.conditions[0]


_BASE = Condition("previous pose alone", "previous_pose", 1, False, (12.6, 4.3, 9, 2))


def _one(title: str, variant: str, thesis: tuple[float, float, float, float] | None = None) -> Condition:
    return Condition(title, variant, 1, False, thesis)


TABLES: tuple[Table, ...] = (
    Table(
        "5.1",
        "One to four cameras, fused skeleton without any solve",
        (
            _one("1 camera", "raw", (14.4, 6.9, 7, 3)),
            Condition("2 cameras", "raw", 2, True, (13.2, 4.4, 2, 2)),
            Condition("3 cameras", "raw", 3, True, (15.7, 5.1, 11, 3)),
            Condition("4 cameras", "raw", 4, True),
            Condition("2, no interference", "raw", 2, False),
            Condition("3, no interference", "raw", 3, False),
            Condition("4, no interference", "raw", 4, False),
        ),
    ),
    Table(
        "5.2",
        "Inverse kinematics, one camera",
        (
            _one("none", "raw", (14.2, 6.5, 7, 3)),
            _one("previous pose", "previous_pose", (12.6, 4.3, 9, 2)),
            _one("combined skeleton", "combined_skeleton", (11.2, 3.3, 3, 2)),
            _one("Kalman filter", "kalman_filter"),
        ),
    ),
    Table(
        "5.3",
        "Human limits and relax pose, one camera",
        (
            _BASE,
            _one("limits and relax pose", "limits_relax", (10.3, 3.8, 6, 2)),
            _one("limits alone", "limits"),
            _one("relax pose alone", "relax"),
        ),
    ),
    Table(
        "5.4",
        "Bone length limit, one camera",
        (_BASE, _one("bone length limit", "bone_length", (12.4, 4.6, 8, 2))),
    ),
    Table(
        "5.5",
        "Displacement limit and smoothing, one camera",
        (
            _BASE,
            _one("limit before", "displacement_before", (14.0, 4.9, 5, 2)),
            _one("limit after", "displacement_after", (13.5, 5.5, 7, 2)),
            _one("Holt before", "holt_before"),
            _one("Holt after", "holt_after"),
            _one("One-Euro before", "one_euro_before"),
            _one("One-Euro after", "one_euro_after"),
        ),
    ),
    Table(
        "5.6",
        "One raw camera against the retained combination with two",
        (
            _one("1 camera, raw", "raw", (14.2, 6.5, 7, 3)),
            Condition("2 cameras, preset thesis", "thesis", 2, True, (9.8, 3.1, 4, 2)),
            Condition("2 cameras, preset studio", "studio", 2, True),
            Condition("2 cameras, preset finish", "finish", 2, True),
            _one("1 camera, preset finish", "finish"),
        ),
    ),
)

MOVED_SHARE = (3437, 6227)
"""Frames in which limits and relax pose moved a joint by at least 10 cm, and all frames (5.6.3)."""

HEADLINE: dict[str, float] = {"absolute_difference_cm": -0.309, "shortest_distance_cm": -0.477}
"""Change from one raw camera to the retained combination (5.6.7)."""


@dataclass(frozen=True)
class Component:
    """A row of table 6.1.

    Attributes:
        title: name.
        condition: with the component; `base`: the baseline.
        thesis: the thesis's four figures; votes: for it, of 66; kept: the thesis's decision.
        sides: conditions of a blind test, for and against it.
    """

    title: str
    condition: Condition
    base: Condition
    thesis: tuple[float, float, float, float] | None
    votes: str
    kept: str
    sides: tuple[str, str] | None = None


_RAW = _one("1 camera, raw", "raw")
COMPONENTS: tuple[Component, ...] = (
    Component("two cameras", Condition("", "raw", 2, True), _RAW, (13.3, 4.4, 2, 2), "-", "yes"),
    Component("three cameras", Condition("", "raw", 3, True), _RAW, (15.7, 5.1, 11, 3), "-", "no"),
    Component(
        "IK from the previous pose", _BASE, _RAW, (12.6, 4.3, 9, 2), "50", "yes",
        ("previous pose", "combined skeleton"),
    ),
    Component(
        "IK from the current pose", _one("", "combined_skeleton"), _RAW, (11.2, 3.3, 3, 2), "16", "no",
        ("combined skeleton", "previous pose"),
    ),
    Component(
        "human limits and relax pose", _one("", "limits_relax"), _BASE, (10.3, 3.8, 6, 2), "34", "yes",
        ("limits on", "limits off"),
    ),
    Component(
        "bone length limit", _one("", "bone_length"), _BASE, (12.4, 4.6, 8, 2), "38", "yes",
        ("bone length on", "bone length off"),
    ),
    Component(
        "displacement limit before", _one("", "displacement_before"), _BASE, (14.0, 4.9, 5, 2), "18", "yes",
        ("displacement before", "displacement after"),
    ),
    Component(
        "displacement limit after", _one("", "displacement_after"), _BASE, (13.5, 5.5, 7, 2), "48", "no",
        ("displacement after", "displacement before"),
    ),
    Component(
        "hands and look-at", Condition("", "thesis", 2, True),
        Condition("", "thesis:hands=off", 2, True), None, "64", "yes",
        ("look-at and hands on", "look-at and hands off"),
    ),
    Component(
        "preset thesis, 2 cameras", Condition("", "thesis", 2, True), _RAW, (9.8, 3.1, 4, 2), "66", "-",
        ("everything", "one camera, raw"),
    ),
    Component("preset studio, 2 cameras", Condition("", "studio", 2, True), _RAW, None, "-", "-"),
    Component("preset finish, 2 cameras", Condition("", "finish", 2, True), _RAW, None, "-", "-"),
)  # fmt: skip
"""Table 6.1; the last two rows and the clean-up are not in the thesis."""
