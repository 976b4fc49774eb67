"""Every switch of a solve: its values, its default in each preset, and how `--set KEY=VALUE` is read."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

from studio.engine.errors import SettingsError
from studio.engine.joints import CANONICAL


@dataclass(frozen=True)
class Effector:
    """How the solve treats one joint, as HumanIK names it: how strongly it follows (`reach`), how far up the
    chain it may drag (`pull`), and how much it resists being dragged (`resist`); each 0..1."""

    reach: float = 1.0
    pull: float = 1.0
    resist: float = 0.0


def _effectors() -> dict[str, Effector]:
    """Elbows and knees follow less than what they carry, so that a straight limb never flips (thesis 5.5)."""
    less = {"elbow": 0.6, "knee": 0.6, "hand": 0.3, "toe": 0.5}
    return {
        name: Effector(reach=less.get(name.split("_")[-1], 0.5 if name in ("spine", "chest") else 1.0))
        for name in CANONICAL
    }


@dataclass(frozen=True)
class SolveSettings:
    """The switches of DESIGN.md. An instance is complete and valid; `parse_settings` makes one."""

    cameras: str = "all"
    tracker: str = "points"
    confidence_threshold: float = 0.75
    fusion: str = "robust"
    ik: str = "kalman_filter"
    human_limits: str = "on"
    flexibility: float = 1.0
    relax_pose: float = 0.0
    bone_length_limit: str = "off"
    displacement_limit: str = "none"
    displacement_limits_m_s: dict[str, float] = field(default_factory=dict)
    smoothing: str = "none"
    look_at: str = "measured"
    look_at_point_m: tuple[float, float, float] = (0.0, -2.0, 1.6)
    hands: str = "shape"
    floor_contact: str = "on"
    physics: str = "off"
    finish: str = "off"
    effectors: dict[str, Effector] = field(default_factory=_effectors)
    output_hz: int = 60

    def camera_names(self, available: tuple[str, ...]) -> tuple[str, ...]:
        """Return the cameras to use, in the order of `available`.

        Raises:
            SettingsError: a camera is named that the take does not have.
        """
        if self.cameras == "all":
            return available
        wanted = [name.strip() for name in self.cameras.split(",") if name.strip()]
        unknown = [name for name in wanted if name not in available]
        if unknown or not wanted:
            raise SettingsError(
                f"cameras={self.cameras!r}: no camera {', '.join(unknown) or 'named'}; "
                f"allowed: all, or some of {', '.join(available)}"
            )
        return tuple(name for name in available if name in wanted)

    @property
    def bone_length_tolerance(self) -> float | None:
        """Allowed deviation of a bone from its calibrated length as a fraction, or None where off."""
        return None if self.bone_length_limit == "off" else float(self.bone_length_limit) / 100.0

    @property
    def smoothing_filter(self) -> tuple[str, str] | None:
        """(filter, place) of the smoothing, or None."""
        if self.smoothing == "none":
            return None
        name, _, place = self.smoothing.partition(":")
        return name, place

    @property
    def solves_cameras_joints(self) -> bool:
        """Whether the solve takes the cameras' joints as they are: nothing is set that changes fused ones first."""
        before = self.displacement_limit == "before" or self.smoothing.endswith(":before")
        joints = self.fusion == "robust" and self.bone_length_limit == "off" and not before
        return self.ik == "kalman_filter" and joints

    @property
    def ahead_ns(self) -> int:
        """How far beyond a pose joints tell of it [ns]: an output frame where they are the cameras'."""
        return 1_000_000_000 // self.output_hz if self.solves_cameras_joints else 0

    def to_json(self) -> dict[str, Any]:
        """Return the settings as `settings.json` holds them."""
        value = {f.name: getattr(self, f.name) for f in fields(self)}
        value["look_at_point_m"] = list(self.look_at_point_m)
        value["displacement_limits_m_s"] = dict(self.displacement_limits_m_s)
        value["effectors"] = {name: vars(effector).copy() for name, effector in self.effectors.items()}
        return value

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> "SolveSettings":
        """Return the settings that `to_json` wrote, checked like those of a command line."""
        settings = cls()
        for key, item in value.items():
            if key == "effectors":
                for joint, effector in item.items():
                    for name, number in effector.items():
                        settings = set_switch(settings, f"effectors.{joint}.{name}", str(number))
            elif key == "displacement_limits_m_s":
                for joint, number in item.items():
                    settings = set_switch(settings, f"{key}.{joint}", str(number))
            elif key == "look_at_point_m":
                settings = set_switch(settings, key, ",".join(str(number) for number in item))
            else:
                settings = set_switch(settings, key, str(item))
        return settings


FILTERS = ("holt", "one_euro")
PLACES = ("before", "after")

CHOICES: dict[str, tuple[str, ...]] = {
    "tracker": ("client", "per_camera", "points"),
    "fusion": ("mean", "robust"),
    "ik": ("none", "previous_pose", "combined_skeleton", "kalman_filter"),
    "human_limits": ("on", "off"),
    "displacement_limit": ("none", "before", "after"),
    "smoothing": ("none", *(f"{name}:{place}" for name in FILTERS for place in PLACES)),
    "look_at": ("off", "hands", "far", "near", "point", "measured"),
    "hands": ("off", "circles", "shape"),
    "floor_contact": ("on", "off"),
    "physics": ("off", "on"),
    "finish": ("off", "on"),
    "output_hz": ("30", "60", "120"),
}
"""Switches with a fixed list of values."""

RANGES: dict[str, tuple[float, float]] = {
    "confidence_threshold": (0.0, 1.0),
    "flexibility": (0.0, 2.0),
    "relax_pose": (0.0, 1.0),
}
"""Switches that are a number, with their least and greatest value."""

EXPLANATIONS: dict[str, str] = {
    "cameras": "Which cameras are used: all, or names separated by commas.",
    "tracker": "Where skeletons come from: as received, or from depth, per camera or all points at once.",
    "confidence_threshold": "With mean fusion, a joint less sure than this is ignored.",
    "fusion": "How the cameras' skeletons become one: their mean, or weighed by distance, view and agreement.",
    "ik": "How the humanoid follows: not at all, from its last pose, from the fused skeleton, or as a Kalman filter.",
    "human_limits": "Keeps every joint within the range that a human can reach.",
    "flexibility": "Scales the human limits: 0 an old performer, 1 an adult, 2 a gymnast.",
    "relax_pose": "Blends the solved pose with the middle of each joint's range; the thesis used 0.1.",
    "bone_length_limit": "Holds bones within this many per cent of the calibrated length before the solve.",
    "displacement_limit": "Limits how far a joint may move per frame, before or after the solve.",
    "displacement_limits_m_s": "Per joint, the fastest movement relative to its parent [m/s].",
    "smoothing": "A filter over time, before or after the solve.",
    "look_at": "What the head looks at where its orientation is not measured.",
    "look_at_point_m": "The point that look_at=point looks at, x,y,z on the stage [m].",
    "hands": "Opens and closes the fingers by the hand states: the thesis's circles, or the hand's shape.",
    "floor_contact": "Keeps feet above the floor and holds a standing foot in place.",
    "physics": "Corrects a finished take so that forces can explain it, where that measures better (with finish).",
    "finish": "Solves the whole take at once, knowing the future; live poses are as without it.",
    "effectors": "Per joint: how strongly it follows (reach), drags (pull) and resists (resist).",
    "output_hz": "Frames per second of the result.",
}
"""What each switch does, in plain words, for the page and the documentation."""


def _number(key: str, value: str, low: float, high: float) -> float:
    try:
        number = float(value)
    except ValueError:
        number = float("nan")
    if not low <= number <= high:
        raise SettingsError(f"{key}={value!r} is not allowed; allowed: a number from {low:g} to {high:g}")
    return number


def _joint(key: str, joint: str) -> str:
    if joint not in CANONICAL:
        raise SettingsError(f"{key}: unknown joint {joint!r}; allowed: {', '.join(CANONICAL)}")
    return joint


def _set_nested(settings: SolveSettings, key: str, value: str) -> SolveSettings:
    head, *rest = key.split(".")
    if head == "displacement_limits_m_s" and len(rest) == 1:
        limits = settings.displacement_limits_m_s | {_joint(key, rest[0]): _number(key, value, 0.0, 1000.0)}
        return replace(settings, displacement_limits_m_s=limits)
    if head == "effectors" and len(rest) == 2 and rest[1] in ("reach", "pull", "resist"):
        joint = _joint(key, rest[0])
        effector = replace(settings.effectors[joint], **{rest[1]: _number(key, value, 0.0, 1.0)})
        return replace(settings, effectors=settings.effectors | {joint: effector})
    raise SettingsError(
        f"unknown setting {key!r}; allowed: effectors.<joint>.reach, .pull or .resist, "
        "displacement_limits_m_s.<joint>"
    )


def set_switch(settings: SolveSettings, key: str, value: str) -> SolveSettings:
    """Return `settings` with one switch changed.

    Raises:
        SettingsError: an unknown key or value; the message lists what is allowed.
    """
    if "." in key:
        return _set_nested(settings, key, value)
    if key in CHOICES:
        if value not in CHOICES[key]:
            raise SettingsError(f"{key}={value!r} is not allowed; allowed: {', '.join(CHOICES[key])}")
        return replace(settings, **{key: int(value) if key == "output_hz" else value})
    if key in RANGES:
        return replace(settings, **{key: _number(key, value, *RANGES[key])})
    if key == "bone_length_limit":
        if value != "off":
            _number(f"{key} (off, or per cent)", value, 0.0, 100.0)
        return replace(settings, bone_length_limit=value)
    if key == "cameras":
        if not value.strip():
            raise SettingsError(
                "cameras='' is not allowed; allowed: all, or camera names separated by commas"
            )
        return replace(settings, cameras=value)
    if key == "look_at_point_m":
        parts = value.split(",")
        if len(parts) != 3:
            raise SettingsError(f"{key}={value!r} is not allowed; allowed: x,y,z in metres")
        x, y, z = (_number(key, part, -1000.0, 1000.0) for part in parts)
        return replace(settings, look_at_point_m=(x, y, z))
    names = [f.name for f in fields(SolveSettings) if f.name not in ("effectors", "displacement_limits_m_s")]
    raise SettingsError(
        f"unknown setting {key!r}; allowed: {', '.join(names)}, effectors.<joint>.reach/.pull/.resist, "
        "displacement_limits_m_s.<joint>"
    )


PRESETS: dict[str, SolveSettings] = {
    "raw": SolveSettings(
        tracker="client", fusion="mean", ik="none", human_limits="off", bone_length_limit="off", look_at="off",
        hands="off", floor_contact="off",
    ),
    "thesis": SolveSettings(
        tracker="client", fusion="mean", ik="previous_pose", human_limits="on", bone_length_limit="2",
        displacement_limit="after", look_at="far", hands="circles", floor_contact="off",
    ),
    "studio": SolveSettings(),
    "finish": SolveSettings(finish="on"),
}  # fmt: skip
"""Named settings; `finish` joins them with the whole-take solve."""


def preset(name: str) -> SolveSettings:
    """Return a preset's settings.

    Raises:
        SettingsError: no such preset.
    """
    if name not in PRESETS:
        raise SettingsError(f"unknown preset {name!r}; allowed: {', '.join(PRESETS)}")
    return PRESETS[name]


def parse_settings(preset_name: str, assignments: list[str] | tuple[str, ...] = ()) -> SolveSettings:
    """Return a preset's settings with `KEY=VALUE` assignments applied in order.

    Raises:
        SettingsError: an unknown preset, key or value.
    """
    return changed(preset(preset_name), assignments)


def changed(settings: SolveSettings, assignments: list[str] | tuple[str, ...]) -> SolveSettings:
    """Return settings with `KEY=VALUE` assignments applied in order.

    Raises:
        SettingsError: an unknown key or value.
    """
    for assignment in assignments:
        key, separator, value = assignment.partition("=")
        if not separator:
            raise SettingsError(f"--set {assignment!r} is not KEY=VALUE, such as smoothing=one_euro:before")
        settings = set_switch(settings, key.strip(), value.strip())
    return settings
