"""The content of `metrics.json` of a solve; docs/formats.md explains every key."""

from typing import TypedDict

from studio.engine.base.sentences import Sentence
from studio.engine.model.spans import SpanJson


class CameraMoveJson(TypedDict):
    """Distance [mm] and angle [deg] by which a camera was moved before depth was tracked, and its assumed place."""

    T_stage_camera: list[list[float]]
    moved_mm: float
    turned_deg: float


class ExchangeJson(TypedDict):
    """Exchange of two performers from this stage time on [s]."""

    time_s: float
    performers: list[str]


class CameraExchangeJson(TypedDict):
    """Stage time [s] from which a camera has left and right exchanged, or no longer."""

    camera: str
    time_s: float


class MendedJson(TypedDict):
    """An error of cameras that a pin proved.

    Attributes:
        joints: the joints that were wrong, the nearest to the trunk first.
        cameras: the cameras that were wrong; none = no camera saw the joint.
        start_s, end_s: begin and end, stage time [s].
        exchanges: exchanges of left and right by cameras meanwhile; from then on the other limb was wrong.
        guessed: away from the pins the joint was unknown, and was put where it most likely was.
    """

    joints: list[str]
    cameras: list[str]
    start_s: float
    end_s: float
    exchanges: list[CameraExchangeJson]
    guessed: bool


class EditJson(TypedDict, total=False):
    """The outcome of an edit in a solve, in `metrics.json`.

    Attributes:
        honoured: whether the solve follows the edit.
        missed_mm: for a pin, the largest distance of its joint from its place, beyond its radius.
        missed_deg: the same for a direction.
        line: one line, for people, if it was not honoured.
        said: the line with its code.
        mended: for a pin, the errors that it found and mended; absent without any.
    """

    honoured: bool
    missed_mm: float
    missed_deg: float
    line: str
    said: list[Sentence]
    mended: list[MendedJson]


class RetimeJson(TypedDict):
    """A part that is faster or slower in a solve: its keys of `edits.json`, in stage time."""

    start_s: float
    end_s: float
    ease_s: float
    factor: float


class SolveMetrics(TypedDict, total=False):
    """Figures of a solve; units are in the keys. A key is missing where its step did not run.

    Attributes:
        source: the file of an imported animation.
        followed, agreement, refined_cameras, physics: one line each, for people.
        not_followed: by joint `share`, `longest_s`, `largest_mm`, `unseen_share`.
        disagrees, cameras_moved: by camera.
        physics_figures: means over the frames, as `_before` and `_after`.
        performers: for a take with several, the figures of each, by name.
        undecided_s: spans of stage time [s], from and to, in which this performer was not told apart from another.
        recorded_s: for a take with several, spans of stage time [s] in which cameras sent frames.
        people: one line, for people: the use of cameras without depth where several bodies are seen.
        exchanges: exchanges of performers by the operator, as the solve made them.
        bystanders: people who held no T-pose and were left out.
        edits: the outcome of each edit that is on, by its id; missing without any.
        edits_revision: revision of the take's list of edits that the solve honoured; missing where it honoured none.
        edits_said: one line, for people: why the edits were not used, or that they were converted to another
            calibration.
        said: the lines for people that have one, with their codes.
        seams_s: of a spliced take, begin and end of each seam [s].
        retimed: parts that are faster or slower, whose solve has another time than the stage.
        left_out: people who held a T-pose but came in after the eighth performer; missing without any.
    """

    frames: int
    source: str
    camera_frames: int
    as_live: bool
    solve_s: float
    ms_per_frame: float
    frames_per_second: float
    followed: str
    longest_without_anybody_s: float
    jumps: int
    not_followed: dict[str, dict[str, float]]
    refined_cameras: str
    cameras_moved: dict[str, CameraMoveJson]
    agreement: str
    disagrees: dict[str, list[SpanJson]]
    physics: str
    physics_figures: dict[str, float]
    performers: "dict[str, SolveMetrics]"
    undecided_s: list[list[float]]
    people: str
    bystanders: int
    left_out: int
    exchanges: list[ExchangeJson]
    recorded_s: list[list[float]]
    edits: dict[str, EditJson]
    edits_revision: int
    edits_said: str
    said: list[Sentence]
    seams_s: list[list[float]]
    retimed: list[RetimeJson]
