"""A person who walks round a stage in front of ordinary cameras, with the landmark errors of a pose network."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, make_transform, transform_points
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.human.anthropometry import anthropometric_positions
from studio.engine.model.joints import INDEX, JOINT_COUNT

Array = NDArray[np.float64]
RATE_HZ = 30.0
HEIGHT_M = 1.8
LENS = Lens(1000.0, 1000.0, 639.5, 359.5, 1280, 720)


def walker(times_s: Array, *, radius_m: float = 1.2, swing: float = 0.5, seated: bool = False) -> Array:
    """Return the joints of a person on a circle [m], stage axes, shape (time_count, 21, 3)."""
    rest = anthropometric_positions(HEIGHT_M)
    arms = [f"{s}_{n}" for s in ("left", "right") for n in ("elbow", "wrist", "hand")]
    out = np.zeros((len(times_s), JOINT_COUNT, 3))
    for f, t in enumerate(times_s):
        body = rest.copy()
        for name in arms:  # hanging arms
            shoulder = rest[INDEX[f"{name.split('_')[0]}_shoulder"]]
            body[INDEX[name]] = shoulder - np.array([0.0, 0.0, np.linalg.norm(rest[INDEX[name]] - shoulder)])
        for side, sign in (("left", 1.0), ("right", -1.0)):
            phase = swing * sign * np.sin(2 * np.pi * 0.9 * t)
            bend = max(0.0, -phase) * 0.8
            leg = (1.5, -1.5) if seated else (phase + bend, phase - bend)
            _turn(body, [f"{side}_{n}" for n in ("knee", "ankle", "toe")], f"{side}_hip", leg[0])
            _turn(body, [f"{side}_{n}" for n in ("ankle", "toe")], f"{side}_knee", leg[1] - leg[0])
            _turn(body, [f"{side}_{n}" for n in ("elbow", "wrist", "hand")], f"{side}_shoulder", -phase * 0.8)
            _turn(body, [f"{side}_{n}" for n in ("wrist", "hand")], f"{side}_elbow", 0.3 + 0.2 * np.sin(t))
        angle = 0.5 * t
        heading = -angle + 0.4 * np.sin(0.7 * t)
        turn = np.array(
            [[np.cos(heading), np.sin(heading), 0], [-np.sin(heading), np.cos(heading), 0], [0, 0, 1]]
        )
        body[:, 2] -= min(body[INDEX["left_toe"], 2], body[INDEX["right_toe"], 2]) - 0.03
        out[f] = body @ turn + [radius_m * np.cos(angle), radius_m * np.sin(angle), 0.0]
    return out


def _turn(body: Array, names: list[str], about: str, angle: float) -> None:
    """Turn joints about another joint, by an angle towards the front (-y)."""
    centre = body[INDEX[about]]
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    rows = [INDEX[name] for name in names]
    body[rows] = (body[rows] - centre) @ turn + centre


def camera_at(angle_deg: float, distance_m: float = 4.5, height_m: float = 1.5) -> Array:
    """Return T_stage_camera of a camera that looks at the middle of the stage."""
    a = np.radians(angle_deg)
    place = np.array([distance_m * np.cos(a), distance_m * np.sin(a), height_m])
    z = np.array([0.0, 0.0, 0.9]) - place
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return make_transform(np.stack([x, np.cross(z, x), z], axis=1), place)


def view_of(
    name: str,
    T_stage_camera: Array,
    *,
    seed: int = 0,
    seconds: float = 12.0,
    ahead_s: float = 0.0,
    lens: Lens = LENS,
    error_m: float = 0.01,
    guess_deg: float = 8.0,
    knows_lens: bool = False,
    radius_m: float = 1.2,
    seated: bool = False,
) -> View:
    """Return what a camera sees.

    Args:
        error_m: standard deviation of landmarks across the line of sight; an error lasts over some frames.
        guess_deg: turn of the network's guess of the body about the camera's y axis, in all frames.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    local = transform_points(
        invert_transform(T_stage_camera), walker(times + ahead_s, radius_m=radius_m, seated=seated)
    )
    noise = np.zeros(local.shape)
    for f in range(len(times)):
        fresh = rng.normal(0.0, error_m, local.shape[1:])
        noise[f] = fresh if f == 0 else 0.8 * noise[f - 1] + 0.6 * fresh
    pixels = lens.pixels_of(local + noise * [1.0, 1.0, 0.0])
    a = np.radians(guess_deg * rng.choice([-1.0, 1.0]))
    tilt = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    world = (local - local[:, [0]]) @ tilt * 0.95 + 2 * noise
    confidence = np.full(local.shape[:2], 0.95)
    return View(name, times, pixels, confidence, world, lens.width, lens.height, lens if knows_lens else None)
