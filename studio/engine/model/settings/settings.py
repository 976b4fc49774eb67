"""The settings of a solve: the table of all switches, the presets, and the parser of `--set KEY=VALUE`."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import CANONICAL
from studio.engine.model.settings.by_performer import ByPerformer, is_performer
from studio.engine.model.settings.switches import (
    Choice,
    Defaults,
    Effector,
    Effectors,
    Names,
    Number,
    Percent,
    PerJoint,
    Point,
    Switch,
    unknown_part,
)


def _effectors() -> dict[str, Effector]:
    """Elbows and knees have less reach than hands and feet, so that a straight limb never flips (Ménard 2014,
    5.5)."""
    less = {"elbow": 0.6, "knee": 0.6, "hand": 0.3, "toe": 0.5}
    return {
        name: Effector(reach=less.get(name.split("_")[-1], 0.5 if name in ("spine", "chest") else 1.0))
        for name in CANONICAL
    }


FILTERS = ("holt", "one_euro")
PLACES = ("before", "after")
_ON_OFF = ("on", "off")
_every = Defaults.everywhere

_TABLE: tuple[Switch, ...] = (
    Names(
        "cameras",
        _every("all"),
        "Which cameras are used: all, or names separated by commas.",
        "nothing; fewer cameras are faster",
    ),
    Choice(
        "tracker",
        Defaults("client", "client", "points", "points"),
        "Source of the skeletons: as received, tracked from each camera's depth, or from all points at once.",
        "client nothing; per_camera 11 ms an image; points 16 ms an instant of three cameras",
        values=("client", "per_camera", "points"),
    ),
    Choice(
        "refine_cameras",
        Defaults("off", "off", "given", "given"),
        "With tracker=points, moves cameras until they agree on body and floor: those that were given, or all.",
        "a tenth to twice the time of tracking, once a take",
        values=("off", "given", "all"),
    ),
    Number(
        "confidence_threshold",
        _every(0.75),
        "With mean fusion, joints of lower confidence are ignored.",
    ),
    Choice(
        "fusion",
        Defaults("mean", "mean", "robust", "robust"),
        "Fusion of the cameras' skeletons: their mean, or weighted by distance, view and agreement.",
        values=("mean", "robust"),
    ),
    Choice(
        "ik",
        Defaults("none", "previous_pose", "kalman_filter", "kalman_filter"),
        "Solver of the humanoid: none, from the last pose, from the fused skeleton, or a Kalman filter.",
        "previous_pose 0.2 ms a frame; kalman_filter 0.5 ms a frame",
        values=("none", "previous_pose", "combined_skeleton", "kalman_filter"),
    ),
    Choice(
        "human_limits",
        Defaults("off", "on", "on", "on"),
        "Keeps every joint within the human range of motion.",
        values=_ON_OFF,
    ),
    Number(
        "flexibility",
        _every(1.0),
        "Scales the human limits: 0 is an old performer, 1 an adult, 2 a gymnast.",
        high=2.0,
    ),
    Number(
        "relax_pose",
        _every(0.0),
        "Blends the solved pose with the middle of each joint's range; the thesis used 0.1.",
    ),
    Percent(
        "bone_length_limit",
        Defaults("off", "2", "off", "off"),
        "Holds bones within this many per cent of the calibrated length before the solve.",
    ),
    Choice(
        "displacement_limit",
        Defaults("none", "after", "none", "none"),
        "Limits the speed of the joints, before or after the solve.",
        "0.1 ms a frame, 2 ms in a frame that it holds back",
        values=("none", *PLACES),
    ),
    PerJoint(
        "displacement_limits_m_s",
        _every({}),
        "Per joint, its largest speed relative to its parent [m/s].",
        high=1000.0,
    ),
    Choice(
        "smoothing",
        _every("none"),
        "A filter over time, before or after the solve.",
        "9 to 23 ms of lag",
        values=("none", *(f"{name}:{place}" for name in FILTERS for place in PLACES)),
    ),
    Choice(
        "look_at",
        Defaults("off", "far", "measured", "measured"),
        "Target of the head; measured: by a device, or by the face that ordinary cameras see, else far.",
        values=("off", "hands", "far", "near", "point", "measured"),
    ),
    Point(
        "look_at_point_m",
        _every((0.0, -2.0, 1.6)),
        "Target of look_at=point, x,y,z on the stage [m].",
    ),
    Choice(
        "hands",
        Defaults("off", "circles", "shape", "shape"),
        "Method of the hand states that open and close the fingers: the thesis's circles, or the hand's shape.",
        values=("off", "circles", "shape"),
    ),
    Choice(
        "fingers",
        Defaults("off", "off", "on", "on"),
        "Fingers and wrists follow the landmarks of the hands that two or more ordinary cameras see.",
        "0.3 ms a frame and hand that is seen",
        values=_ON_OFF,
    ),
    Choice(
        "floor_contact",
        Defaults("off", "off", "on", "on"),
        "Keeps feet above the floor and holds a standing foot in place.",
        "0.2 ms a frame",
        values=_ON_OFF,
    ),
    Choice(
        "physics",
        _every("off"),
        "Corrects a finished take so that contact forces can explain it, where that improves it (with finish).",
        "2 ms a frame, after the take",
        values=("off", "on"),
    ),
    Choice(
        "finish",
        Defaults("off", "off", "off", "on"),
        "Solves the whole take at once, from past and future frames; live poses do not change.",
        "1.8 ms a frame, after the take",
        values=("off", "on"),
    ),
    Effectors(
        "effectors",
        _every(_effectors()),
        "Per joint: weight of its target (reach), influence on other joints (pull), resistance to theirs (resist).",
    ),
    Choice(
        "output_hz",
        _every(60),
        "Frames per second of the result.",
        values=(30, 60, 120),
    ),
    Choice(
        "bystanders",
        _every("ignored"),
        "Of several people, those who held no T-pose: ignored, or performers who are measured over the take.",
        "a solve for each of them",
        values=("ignored", "performers"),
    ),
    ByPerformer(
        "performers",
        _every({}),
        "Settings of single performers: performer_2.smoothing=one_euro:before.",
        common=("cameras", "tracker", "refine_cameras", "output_hz", "bystanders"),
        check=lambda key, text: set_switch(PRESETS["studio"], key, text),
    ),
)

SWITCHES: dict[str, Switch] = {switch.name: switch for switch in _TABLE}
"""Every switch by its name, in display order. A cost is that of one core of the reference machine."""


def _default(name: str) -> Any:
    """The field of a switch; its default is the value in the preset `studio`."""
    value = SWITCHES[name].defaults.studio
    return field(default_factory=value.copy) if isinstance(value, dict) else field(default=value)


SettingsJson: TypeAlias = dict[str, Any]
"""Settings of a solve as files hold them: values by name of the switch."""


@dataclass(frozen=True)
class SolveSettings:
    """A value for every switch of `SWITCHES`, complete and valid. Made by `parse_settings`."""

    cameras: str = _default("cameras")
    tracker: str = _default("tracker")
    refine_cameras: str = _default("refine_cameras")
    confidence_threshold: float = _default("confidence_threshold")
    fusion: str = _default("fusion")
    ik: str = _default("ik")
    human_limits: str = _default("human_limits")
    flexibility: float = _default("flexibility")
    relax_pose: float = _default("relax_pose")
    bone_length_limit: str = _default("bone_length_limit")
    displacement_limit: str = _default("displacement_limit")
    displacement_limits_m_s: dict[str, float] = _default("displacement_limits_m_s")
    smoothing: str = _default("smoothing")
    look_at: str = _default("look_at")
    look_at_point_m: tuple[float, float, float] = _default("look_at_point_m")
    hands: str = _default("hands")
    fingers: str = _default("fingers")
    floor_contact: str = _default("floor_contact")
    physics: str = _default("physics")
    finish: str = _default("finish")
    effectors: dict[str, Effector] = _default("effectors")
    output_hz: int = _default("output_hz")
    bystanders: str = _default("bystanders")
    performers: dict[str, str] = _default("performers")

    def of_performer(self, name: str) -> "SolveSettings":
        """Return the settings of one performer, such as `performer_2`."""
        if not self.performers:
            return self
        own = replace(self, performers={})
        for key, text in self.performers.items():
            performer, _, switch = key.partition(".")
            if performer == name:
                own = set_switch(own, switch, text)
        return own

    @property
    def everybody(self) -> bool:
        """Whether persons without a T-pose are performers too."""
        return self.bystanders == "performers"

    def check_performers(self, names: Sequence[str]) -> None:
        """Raise SettingsError for a setting of a performer who is not among these."""
        for key in self.performers:
            if key.partition(".")[0] not in names:
                raise SettingsError(
                    "settings.unknown_performer",
                    "{key}: no such performer; allowed: {allowed}",
                    key=key,
                    allowed=list(names),
                )

    def camera_names(self, available: tuple[str, ...]) -> tuple[str, ...]:
        """Return the cameras to use, in the order of `available`.

        Raises:
            SettingsError: the take lacks a named camera.
        """
        if self.cameras == "all":
            return available
        wanted = [name.strip() for name in self.cameras.split(",") if name.strip()]
        unknown = [name for name in wanted if name not in available]
        if unknown or not wanted:
            raise SettingsError(
                "settings.unknown_cameras",
                "cameras={cameras!r}: no camera {names}; allowed: all, or some of {allowed}",
                cameras=self.cameras,
                names=", ".join(unknown) or "named",
                allowed=[*available],
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
        """Whether the solve takes the cameras' joints directly, because no setting changes fused joints before it."""
        before = self.displacement_limit == "before" or self.smoothing.endswith(":before")
        joints = self.fusion == "robust" and self.bone_length_limit == "off" and not before
        return self.ik == "kalman_filter" and joints

    @property
    def ahead_ns(self) -> int:
        """Look-ahead [ns]: one output frame where the solve takes the cameras' joints directly, else 0."""
        return 1_000_000_000 // self.output_hz if self.solves_cameras_joints else 0

    def to_json(self) -> SettingsJson:
        """Return the settings as `settings.json` holds them."""
        return {switch.name: switch.to_json(getattr(self, switch.name)) for switch in SWITCHES.values()}

    @classmethod
    def from_json(cls, value: SettingsJson) -> "SolveSettings":
        """Return the settings that `to_json` wrote, checked like those of a command line.

        Raises:
            SettingsError: an unknown switch, or a value that is not allowed.
        """
        return cls(**{name: _find(name).from_json(item) for name, item in value.items()})

    def texts(self) -> dict[str, str]:
        """Return every single-valued switch as `--set KEY=VALUE` writes it."""
        switches = (switch for switch in SWITCHES.values() if not isinstance(switch, PerJoint))
        return {switch.name: switch.text(getattr(self, switch.name)) for switch in switches}

    def texts_by_joint(self) -> dict[str, str]:
        """Return the per-joint switches as `--set KEY=VALUE` writes them."""
        out: dict[str, str] = {}
        for switch in SWITCHES.values():
            if isinstance(switch, PerJoint):
                out |= switch.texts(getattr(self, switch.name))
        return out


PRESETS: dict[str, SolveSettings] = {
    name: SolveSettings(**{switch.name: getattr(switch.defaults, name) for switch in SWITCHES.values()})
    for name in Defaults._fields
}
"""Named settings; `finish` is `studio` with the whole-take solve."""


def _find(name: str) -> Switch:
    if name not in SWITCHES:
        plain = [switch.name for switch in SWITCHES.values() if not isinstance(switch, PerJoint)]
        raise SettingsError(
            "settings.unknown",
            "unknown setting {key!r}; allowed: {allowed}, effectors.<joint>.reach/.pull/.resist, "
            "displacement_limits_m_s.<joint>, performer_2.<setting>",
            key=name,
            allowed=plain,
        )
    return SWITCHES[name]


def set_switch(settings: SolveSettings, key: str, value: str) -> SolveSettings:
    """Return `settings` with one switch changed.

    Raises:
        SettingsError: an unknown key or value; the message lists what is allowed.
    """
    name, *rest = key.split(".")
    if is_performer(name):
        switch = SWITCHES["performers"]
        assert isinstance(switch, PerJoint)
        return replace(settings, performers=switch.parse_part(settings.performers, key, [name, *rest], value))
    if not rest:
        return replace(settings, **{name: _find(name).parse(value)})
    switch = SWITCHES.get(name)
    if not isinstance(switch, PerJoint):
        raise unknown_part(key)
    return replace(settings, **{name: switch.parse_part(getattr(settings, name), key, rest, value)})


def add_choices(name: str, values: tuple[str, ...]) -> None:
    """Add values to a choice switch, in this process."""
    switch = SWITCHES[name]
    assert isinstance(switch, Choice)
    known = tuple(str(value) for value in switch.values)
    SWITCHES[name] = replace(switch, values=(*known, *(value for value in values if value not in known)))


def preset(name: str) -> SolveSettings:
    """Return a preset's settings.

    Raises:
        SettingsError: no such preset.
    """
    if name not in PRESETS:
        raise SettingsError(
            "settings.unknown_preset",
            "unknown preset {name!r}; allowed: {allowed}",
            name=name,
            allowed=[*PRESETS],
        )
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
            raise SettingsError(
                "settings.not_key_value",
                "--set {text!r} is not KEY=VALUE, such as smoothing=one_euro:before",
                text=assignment,
            )
        settings = set_switch(settings, key.strip(), value.strip())
    return settings
