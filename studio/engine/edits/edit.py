"""The edits of a take: pins, directions, contacts, doubts, offsets and time.

An edit states a fact about the take, and a solve honours it. Times are stage time in seconds, as `Poses.time_s`;
places and directions are in the stage frame. An edit holds from `start_s` to `end_s`, both included; equal times are
one instant. Before and after it eases in and out over `ease_s`.
"""

from typing import Literal

import msgspec


class _Edit(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", forbid_unknown_fields=True):
    """Common fields of all edits.

    Attributes:
        id: unique within the take; it stays while the edit changes.
        start_s: begin, stage time [s].
        end_s: end, stage time [s]; not before the begin.
        ease_s: time over which the edit eases in before its begin and out after its end [s].
        on: whether solves honour it.
        performer: the performer that it is about, `performer_1`, ...
        note: the operator's note.
    """

    id: str
    start_s: float
    end_s: float
    ease_s: float = 0.1
    on: bool = True
    performer: str = "performer_1"
    note: str = ""


class PinEdit(_Edit, frozen=True, kw_only=True, tag="pin"):
    """A joint is at a place.

    Attributes:
        joint: a canonical joint.
        place_m: stage frame [m].
        radius_m: largest distance from the place [m]; 0 = exactly there.
    """

    joint: str
    place_m: tuple[float, float, float]
    radius_m: float = 0.0


class DirectionEdit(_Edit, frozen=True, kw_only=True, tag="direction"):
    """The head looks, or a palm faces, in a direction.

    Attributes:
        of: the head or the palm.
        direction: stage frame; its length does not matter.
        radius_deg: largest angle from the direction [degrees].
    """

    of: Literal["head", "left_palm", "right_palm"]
    direction: tuple[float, float, float]
    radius_deg: float = 0.0


class ContactEdit(_Edit, frozen=True, kw_only=True, tag="contact"):
    """A joint stands or is held, or does not.

    Attributes:
        joint: the canonical joint that touches: a hand, foot (`_ankle`), toe, knee or hip.
        touches: `floor`; `nothing`, which takes a found contact away; or a canonical joint.
        other: the performer whose joint it touches; None = their own.
    """

    joint: str
    touches: str = "floor"
    other: str | None = None


class LeaveOutEdit(_Edit, frozen=True, kw_only=True, tag="leave_out"):
    """A camera's joints are not used.

    Attributes:
        camera: its name; None = all cameras.
        joints: canonical joints that are left out; none = all.
    """

    camera: str | None = None
    joints: tuple[str, ...] = ()


class ExchangeEdit(_Edit, frozen=True, kw_only=True, tag="exchange_sides"):
    """A camera, or all of them, exchanged left and right.

    Attributes:
        camera: its name; None = all cameras.
        joints: canonical joints that are exchanged with those of the other side, by the name of either; none = all.
    """

    camera: str | None = None
    joints: tuple[str, ...] = ()


class OffsetEdit(_Edit, frozen=True, kw_only=True, tag="offset"):
    """A layer that turns a joint further, or moves the whole body, after the solve.

    Attributes:
        joint: the output joint (HumanIK name) that is turned.
        rotation_deg: added in the joint's own frame, as a rotation vector [degrees].
        move_m: added to the place of the hips, stage frame [m]; only for `Hips`.
    """

    joint: str
    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    move_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


class TrimEdit(_Edit, frozen=True, kw_only=True, tag="trim"):
    """Only this part of the take is kept in solves; of all performers."""


class RetimeEdit(_Edit, frozen=True, kw_only=True, tag="retime"):
    """A part of the take becomes faster or slower, after the solve; later parts are moved in time.

    Attributes:
        factor: new duration divided by the old one; above 1 is slower.
    """

    factor: float


Edit = (
    PinEdit
    | DirectionEdit
    | ContactEdit
    | LeaveOutEdit
    | ExchangeEdit
    | OffsetEdit
    | TrimEdit
    | RetimeEdit
)  # fmt: skip
"""Any edit; in JSON its field `kind` gives the kind."""
