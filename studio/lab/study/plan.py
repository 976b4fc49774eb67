"""Recordings of a study (motions x cameras x interference x seeds), and the switches of their solves."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from studio.engine.animation.motion.authored import MOVEMENTS
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.settings.settings import parse_settings

FORMAT = 1
"""Version of the cells; a new one invalidates them."""


@dataclass(frozen=True)
class Variant:
    """A solve's settings: a preset and changes.

    Attributes:
        name: in tables and files.
        preset, changes: as in `--preset` and `--set`.
        against: another variant; the share of frames with a joint at least 10 cm from its place there is measured.
    """

    name: str
    preset: str
    changes: tuple[str, ...] = ()
    against: str | None = None


@dataclass(frozen=True)
class StudyRecording:
    """One simulated take.

    Attributes:
        motion: name of a movement or path of an animation; content: hash of that file, empty for a movement.
        cameras, interference, seed: see `simulator.joints.seen.see`.
        unit_m: metres per unit of a BVH; None = from its height.
    """

    motion: str
    content: str
    cameras: int
    interference: bool
    seed: int
    unit_m: float | None = None

    @property
    def title(self) -> str:
        return self.motion if not self.content else Path(self.motion).stem


@dataclass(frozen=True)
class Cell:
    """One solve of one recording."""

    recording: StudyRecording
    variant: Variant

    @property
    def key(self) -> str:
        """Hash of all inputs of the figures; it names the file."""
        recording = asdict(self.recording)
        if self.recording.content:  # independent of the file's path
            recording["motion"] = self.recording.title
        settings = parse_settings(self.variant.preset, self.variant.changes).to_json()
        value = [FORMAT, recording, settings, self.variant.against]
        return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:24]


@dataclass(frozen=True)
class Study:
    """All cells, and their inputs."""

    motions: tuple[str, ...]
    cameras: tuple[int, ...]
    seeds: int
    cells: tuple[Cell, ...]

    def by_recording(self) -> dict[StudyRecording, list[Cell]]:
        out: dict[StudyRecording, list[Cell]] = {}
        for cell in self.cells:
            out.setdefault(cell.recording, []).append(cell)
        return out


PRESETS: tuple[Variant, ...] = tuple(Variant(name, name) for name in ("raw", "thesis", "studio", "finish"))

_PREVIOUS = ("ik=previous_pose",)
THESIS: tuple[Variant, ...] = (
    Variant("previous_pose", "raw", _PREVIOUS),
    Variant("combined_skeleton", "raw", ("ik=combined_skeleton",)),
    Variant("kalman_filter", "raw", ("ik=kalman_filter",)),
    Variant(
        "limits_relax", "raw", (*_PREVIOUS, "human_limits=on", "relax_pose=0.1"), against="previous_pose"
    ),
    Variant("limits", "raw", (*_PREVIOUS, "human_limits=on"), against="previous_pose"),
    Variant("relax", "raw", (*_PREVIOUS, "relax_pose=0.1"), against="previous_pose"),
    Variant("bone_length", "raw", (*_PREVIOUS, "bone_length_limit=2")),
    Variant("displacement_before", "raw", (*_PREVIOUS, "displacement_limit=before")),
    Variant("displacement_after", "raw", (*_PREVIOUS, "displacement_limit=after")),
    *(
        Variant(f"{name}_{place}", "raw", (*_PREVIOUS, f"smoothing={name}:{place}"))
        for name in ("holt", "one_euro")
        for place in ("before", "after")
    ),
)
"""One switch at a time on the plain solve from the previous pose, as in the thesis's tables 5.2 to 5.5."""

WITHOUT: tuple[Variant, ...] = tuple(
    Variant(f"thesis:{change}", "thesis", (change,))
    for change in (
        "ik=none", "ik=combined_skeleton", "human_limits=off", "relax_pose=0.1", "bone_length_limit=off",
        "displacement_limit=none", "displacement_limit=before", "smoothing=holt:before", "hands=off",
        "look_at=off", "fusion=robust", "confidence_threshold=0.0",
    )
)  # fmt: skip
"""Ablation of the retained combination: one switch changed at a time."""

SINGLE: tuple[Variant, ...] = tuple(
    Variant(f"studio:{change}", "studio", (change,))
    for change in (
        "fusion=mean", "ik=previous_pose", "ik=combined_skeleton", "ik=none", "human_limits=off",
        "flexibility=2", "relax_pose=0.1", "bone_length_limit=2", "displacement_limit=before",
        "displacement_limit=after", "smoothing=holt:before", "smoothing=holt:after", "smoothing=one_euro:before",
        "smoothing=one_euro:after", "look_at=off", "hands=off", "floor_contact=off", "output_hz=30",
    )
)  # fmt: skip
"""Ablation of preset `studio`."""

CHAIN: tuple[Variant, ...] = (
    *(one for one in THESIS if one.name in ("previous_pose", "limits")),
    Variant("limits_bone_length", "raw", (*_PREVIOUS, "human_limits=on", "bone_length_limit=2")),
)
"""Steps from the fused skeleton to the retained combination."""

UNSURE = Variant("raw:confidence_threshold=0.0", "raw", ("confidence_threshold=0.0",))
"""The mean without the thesis's threshold of 75 % confidence."""

ROBUST = Variant("raw:fusion=robust", "raw", ("fusion=robust",))
"""Robust fusion instead of the mean; it shows the effect of wrong cameras on the mean."""

PHYSICS = Variant("finish:physics=on", "finish", ("physics=on",))


def variants(cameras: int, interference: bool, *, short: bool = False) -> tuple[Variant, ...]:
    """Return the variants for recordings with this many cameras; `short` leaves out those that no table needs."""
    if cameras == 1:
        return (*PRESETS, UNSURE, *THESIS)
    if cameras == 2 and interference:
        return (*PRESETS, UNSURE, ROBUST, *CHAIN, *(() if short else (*WITHOUT, *SINGLE, PHYSICS)))
    return (*PRESETS, UNSURE, ROBUST)


def make_plan(
    motions: tuple[Path, ...],
    *,
    cameras: tuple[int, ...],
    seeds: int,
    unit_m: float | None,
    short: bool = False,
) -> Study:
    """Return the study of these animations, by default of the thesis's four movements.

    A single camera has no interference; more cameras are recorded twice, with and without it.

    Raises:
        FormatError: a motion that is missing.
        SettingsError: no seed, or a number of cameras that no rig has.
    """
    if seeds < 1:
        raise SettingsError("study.seeds", "--seeds {n}: give at least 1", n=seeds)
    if not cameras or any(count not in (1, 2, 3, 4) for count in cameras):
        raise SettingsError(
            "study.cameras",
            "--cameras {cameras}: allowed are 1, 2, 3 and 4, by commas",
            cameras=",".join(map(str, cameras)),
        )
    sources = [(str(path), _content(path)) for path in motions] or [(name, "") for name in MOVEMENTS]
    cells = [
        Cell(StudyRecording(motion, content, count, interference, seed, unit_m), variant)
        for seed in range(seeds)
        for motion, content in sources
        for count in sorted(set(cameras))
        for interference in ((True, False) if count > 1 else (False,))
        for variant in variants(count, interference, short=short)
    ]
    titles = tuple(dict.fromkeys(cell.recording.title for cell in cells))
    if len(titles) < len(sources):
        raise FormatError("study.motion_twice", "two motions have the same name; rename one")
    return Study(titles, tuple(sorted(set(cameras))), seeds, tuple(cells))


def _content(path: Path) -> str:
    if not path.is_file():
        raise FormatError(
            "study.no_motion",
            "no motion at {path}; give BVH files, or none for the thesis's four movements",
            path=path,
        )
    return hashlib.sha256(path.read_bytes()).hexdigest()
