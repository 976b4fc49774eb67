"""The verdict on a camera's calibration, with its reasons and advice."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import Said, say
from studio.engine.base.value_sentences import bad_value
from studio.engine.calibration.quality.halves import Halves
from studio.engine.calibration.quality.steadiness import MOVED_M, CameraShift
from studio.engine.model.human.anthropometry import IN_SHOES
from studio.engine.model.spans import Span

MIN_PAIRS = 2000
MIN_SPREAD_M = 0.25
MAX_HALVES_M, MAX_HALVES_DEG = 0.01, 0.5

GOOD_SHIFT_M = 0.025
GOOD_AGREEMENT_M, REFUSED_AGREEMENT_M = 0.10, 0.20
GOOD_OFFSET_SD_S = 0.01
MAX_TILT_DEG = 60.0
HEIGHTS_M = (0.8, 2.3)
MAX_SUNK_M = 0.12
MAX_HEIGHT_CHANGE_M = 0.15
"""Tolerance of a known height: trackers place heads and feet some centimetres apart."""


@dataclass(frozen=True)
class Facts:
    """Input of a camera's verdict. None = not measured or not applicable.

    Attributes:
        pairs: number of joints that camera and reference both reported at one instant.
        spread_m: standard deviations of the walked places along their principal axes [m], largest first.
        agreement_m: median distance to the reference's joints, left and right corrected [m].
        halves: difference of the fits on even and odd blocks.
        shift: largest shift of the camera's joints from the other cameras', and its time.
        left_out: spans that were left out because the camera did not agree, in seconds since the reference began.
        camera_height_m: over the floor [m].
        tilt_deg: angle between the camera's up and the stage's.
        feet_m: height over the floor of the lower of the camera's standing feet [m].
        known_height_m: the performer's, as measured before [m].
        performer_height_m: as measured with this calibration [m]; None where no whole body was seen.
        mirrored: a reflection fits the camera's joints far better.
        same_stream: the camera has the reference's place and reports the same joints.
        clock_reason: why the motion did not give the clock, empty where it did.
        offset_sd_s: standard deviation of the clock offset [s].
    """

    pairs: int | None = None
    spread_m: NDArray[np.float64] | None = None
    agreement_m: float | None = None
    halves: Halves | None = None
    shift: CameraShift | None = None
    left_out: tuple[Span, ...] = ()
    camera_height_m: float | None = None
    tilt_deg: float | None = None
    feet_m: float | None = None
    known_height_m: float | None = None
    performer_height_m: float | None = None
    mirrored: bool = False
    same_stream: bool = False
    clock_reason: str = ""
    offset_sd_s: float = 0.0


def verdict(facts: Facts) -> tuple[str, tuple[str, ...]]:
    """Return `good`, `usable` or `refused`, and the reasons, for one camera."""
    refused = _place_refusals(facts)
    doubts = []
    if facts.agreement_m is not None and facts.agreement_m > GOOD_AGREEMENT_M:
        (refused if facts.agreement_m > REFUSED_AGREEMENT_M else doubts).append(
            say(
                "verdict.disagrees",
                "joints disagree with the reference camera by {cm:.0f} cm (median): let one performer "
                "alone walk, in view of both cameras",
                cm=facts.agreement_m * 100,
            )
        )
    if facts.halves is not None:
        metres, degrees = facts.halves.metres, facts.halves.degrees
        if metres > MAX_HALVES_M or degrees > MAX_HALVES_DEG:
            refused.append(
                say(
                    "verdict.halves_differ",
                    "fits on even and odd 5 s blocks differ by {cm:.1f} cm and {degrees:.1f} degrees "
                    "(allowed: {most:.0f} cm and {least} degrees): walk for longer",
                    cm=metres * 100,
                    degrees=degrees,
                    most=MAX_HALVES_M * 100,
                    least=MAX_HALVES_DEG,
                )
            )
    if facts.shift is not None and facts.shift.metres > GOOD_SHIFT_M:
        (refused if facts.shift.metres > MOVED_M else doubts).append(
            say(
                "verdict.shifted",
                "its joints shifted by {cm:.1f} cm against the other cameras' for a while from "
                "{seconds:.0f} s on: was it moved, or somebody else in view? Fix it in place and walk "
                "again",
                cm=facts.shift.metres * 100,
                seconds=facts.shift.at_s,
            )
        )
    doubts += [span.words() for span in facts.left_out]
    if facts.clock_reason:
        doubts.append(
            say(
                "verdict.clock_not_found",
                "clock offset not found from the motion ({why}): move livelier, or sync the clocks",
                why=facts.clock_reason,
            )
        )
    elif facts.offset_sd_s > GOOD_OFFSET_SD_S:
        doubts.append(clock_uncertain(facts.offset_sd_s))
    if refused:
        return "refused", tuple(refused + doubts)
    return ("usable", tuple(doubts)) if doubts else ("good", ())


def _place_refusals(facts: Facts) -> list[str]:
    """Return why the camera's place cannot be right."""
    reasons = []
    if facts.mirrored:
        reasons.append(
            say(
                "verdict.mirrored",
                "the stream is mirrored: switch the camera's mirror mode off and record again",
            )
        )
    if facts.same_stream:
        reasons.append(
            say(
                "verdict.same_stream",
                "the stream is the reference camera's own: give each camera client its own device",
            )
        )
    if facts.pairs is not None and facts.pairs < MIN_PAIRS:
        reasons.append(
            say(
                "verdict.few_pairs",
                "only {pairs} joint pairs with the reference camera, at least {least} are needed: walk "
                "for longer where both cameras see you",
                pairs=facts.pairs,
                least=MIN_PAIRS,
            )
        )
    if facts.spread_m is not None and facts.spread_m[1] < MIN_SPREAD_M:
        reasons.append(
            say(
                "verdict.little_spread",
                "too little spread: walk through the whole stage, forwards and sideways, not on one spot "
                "or line",
            )
        )
    if facts.camera_height_m is not None and facts.camera_height_m < 0.0:
        reasons.append(
            say(
                "verdict.under_floor",
                "the camera comes out {cm:.0f} cm under the floor: walk with both feet in view and "
                "calibrate again",
                cm=-facts.camera_height_m * 100,
            )
        )
    if facts.feet_m is not None and facts.feet_m < -MAX_SUNK_M:
        reasons.append(
            say(
                "verdict.feet_under_floor",
                "the camera puts feet {cm:.0f} cm under the floor: walk with both feet in view, and "
                "check that it was not moved",
                cm=-facts.feet_m * 100,
            )
        )
    if facts.tilt_deg is not None and facts.tilt_deg > MAX_TILT_DEG:
        reasons.append(
            say(
                "verdict.tilted",
                "the camera comes out tilted by {degrees:.0f} degrees: mount it upright, or check its stream",
                degrees=facts.tilt_deg,
            )
        )
    if facts.performer_height_m is None:
        reasons.append(say("verdict.no_body", "no whole body was seen: walk with head and both feet in view"))
    elif not HEIGHTS_M[0] < facts.performer_height_m < HEIGHTS_M[1]:
        reasons.append(
            say(
                "verdict.performer_height",
                "the performer comes out {m:.2f} m tall: let one performer alone walk, and check the "
                "camera's unit (metres)",
                m=facts.performer_height_m,
            )
        )
    elif (
        facts.known_height_m is not None
        and abs(facts.performer_height_m - facts.known_height_m) > MAX_HEIGHT_CHANGE_M
    ):
        reasons.append(
            say(
                "verdict.performer_height_changed",
                "the performer comes out {m:.2f} m tall, and was measured as {before:.2f} m before: let "
                "the same performer walk, or name another",
                m=facts.performer_height_m,
                before=facts.known_height_m,
            )
        )
    return reasons


def check_height(height_m: float | None) -> None:
    """Check a performer's height [m]; None = not given.

    Raises:
        SettingsError: no performer has this height.
    """
    if height_m is not None and not HEIGHTS_M[0] <= height_m <= HEIGHTS_M[1]:
        allowed = f"{HEIGHTS_M[0]} to {HEIGHTS_M[1]}, the performer's height in metres"
        raise SettingsError(bad_value("height_m", height_m, allowed))


def in_shoes(height_m: float | None) -> float | None:
    """Return a performer's height in shoes [m], as in a calibration, from the height without shoes, which people
    know; None = unknown.

    Raises:
        SettingsError: no performer has this height.
    """
    check_height(height_m)
    return None if height_m is None else min(height_m * IN_SHOES, HEIGHTS_M[1])


def clock_uncertain(offset_sd_s: float) -> Said:
    """Return the message about an uncertain clock offset of this standard deviation [s]."""
    return say(
        "verdict.clock_uncertain",
        "clock offset known to {ms:.0f} ms only: move livelier",
        ms=offset_sd_s * 1000.0,
    )
