"""Frames of cameras with joints moved or left out, at the instants around pins."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.noise import rays
from studio.engine.edits.frames import Changed, Frames
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.joints import INDEX, MIRROR
from studio.engine.whole_take.mending.around import STEP_S, Around

Array = NDArray[np.float64]

FILLED_CONFIDENCE, GUESSED_CONFIDENCE = 0.4, 0.15
"""Least confidence of a joint that was moved, and confidence of one that was moved to a guess from its pins."""


def changed_frames(
    frames: Frames,
    calibration: Calibration,
    seen: Around,
    places: Array,
    gone: NDArray[np.bool_],
    guessed: NDArray[np.bool_],
) -> Frames:
    """Return the frames with joints moved or left out.

    Args:
        places: new places, stage frame [m], shape (count, camera_count, 21, 3); NaN = not moved.
        gone: joints that are left out, shape (count, camera_count, 21).
        guessed: new places that are known from pins alone, same shape.
    """
    out = dict(frames)
    for k, (name, mine) in enumerate(seen.cameras.items()):
        camera = calibration.cameras[name]
        T, changed = camera.T_stage_camera, dict[int, CameraFrame]()
        rows = np.clip(np.rint((mine.time_s - seen.time_s[0]) / STEP_S).astype(int), 0, len(places) - 1)
        for n, (row, place) in enumerate(zip(rows.tolist(), mine.places, strict=True)):
            put, left = np.isfinite(places[row, k, :, 0]), gone[row, k]
            if not put.any() and not left.any():
                continue
            own = _at(places[:, k], seen.time_s, mine.time_s[n], row)
            order = MIRROR if seen.exchanged[row, k] else slice(None)
            own, put, left = own[order], put[order], left[order]
            frame = frames[name][place]
            confidence = np.where(put, np.maximum(frame.confidence, FILLED_CONFIDENCE), frame.confidence)
            confidence[guessed[row, k][order]] = GUESSED_CONFIDENCE
            confidence[left] = 0.0
            frame = replace(frame, confidence=confidence)
            if frame.picture is not None:
                changed[place] = _in_picture(frame, frame.picture, camera, own, put, left)
                continue
            local = (own - T[:3, 3]) @ T[:3, :3]
            local -= camera.depth_bias_m * rays(local)
            positions = np.where(put[:, None], local, frame.positions)
            positions[left] = np.nan
            changed[place] = replace(frame, positions=positions)
        if changed:
            out[name] = Changed(frames[name], changed)
    return out


def _in_picture(
    frame: CameraFrame,
    picture: PictureJoints,
    camera: CameraCalibration,
    places: Array,
    put: NDArray[np.bool_],
    left: NDArray[np.bool_],
) -> CameraFrame:
    """A frame of a camera without depth, with joints moved or left out. If a wrist is one of them, its hand's
    landmarks are left out too.

    Args:
        frame, picture: the frame, and its picture.
        camera: its calibration.
        places: of the joints [m], shape (21, 3).
        put, left: joints that are moved there, and that are left out, shape (21,).
    """
    lens = None if camera.lens is None else camera.lens.sized(picture.width, picture.height)
    if lens is None:
        return frame
    T = camera.T_stage_camera
    pixels, hands = picture.pixels.copy(), picture.hands
    pixels[put] = lens.pixels_of((places[put] - T[:3, 3]) @ T[:3, :3])
    pixels[left] = np.nan
    moved = put | left
    if hands is not None:
        of_hand = np.array([moved[INDEX[f"{side}_wrist"]] for side in ("left", "right")])
        hands = np.where(of_hand[:, None, None], np.nan, hands)
    picture = replace(
        picture, pixels=pixels, world_m=np.where(moved[:, None], np.nan, picture.world_m), hands=hands
    )
    return replace(frame, picture=picture)


def _at(places: Array, grid_s: Array, time_s: float, row: int) -> Array:
    """Places, shape (count, 21, 3), at a time near an instant, interpolated with the next where both are known."""
    other = int(np.clip(row + (1 if time_s > grid_s[row] else -1), 0, len(places) - 1))
    share = abs(time_s - grid_s[row]) / STEP_S
    between = (1.0 - share) * places[row] + share * places[other]
    return np.where(np.isfinite(between), between, places[row])
