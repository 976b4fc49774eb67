"""Hand states: the window, the circles and the network on hand-drawn hands; states over time."""

import numpy as np

from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.seeing.hands.circles import CLOSED, OPEN, UNKNOWN, circles_state
from studio.engine.seeing.hands.shape import shape_networks
from studio.engine.seeing.hands.states import HandStates
from studio.engine.seeing.hands.window import ABOUT, CHANNELS, SIDE, HandWindow, hand_window
from studio.engine.seeing.images.convolution import KERNELS, Committee, Convolution

CAMERA = DepthCamera(365.0, 365.0, 255.5, 211.5, 512, 424)
WRIST, ELBOW = np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.25, 2.0])  # the hand points up


def drawn(*, fingers: bool, z: float = 2.0, background: float = 3.5, shift: float = 0.0) -> np.ndarray:
    """A depth image of a forearm with a palm, and above it fingers or nothing."""
    y, x = np.meshgrid(np.arange(424), np.arange(512), indexing="ij")
    right, up = (x - 255.5) / 365 * z - shift, -(y - 211.5) / 365 * z
    arm = (np.abs(right) < 0.035) & (up < 0) & (up > -0.3)
    palm = (np.abs(right) < 0.045) & (up >= 0) & (up < 0.09)
    tips = (
        (np.abs(right) < 0.05)
        & (up >= 0.09)
        & (up < 0.18)
        & (np.abs(np.mod(right + 0.05, 0.025) - 0.0125) < 0.009)
    )
    return np.where(arm | palm | (tips & fingers), 1000 * z, 1000 * background).astype(np.uint16)


def filled(window: HandWindow) -> np.ndarray:
    """The share of each sample that lies at the hand's depth."""
    return window.samples[..., 0]


def test_the_window_shows_the_hand_in_units_of_the_forearm() -> None:
    near = hand_window(CAMERA, drawn(fingers=True), WRIST, ELBOW, 0.25, mirrored=False)
    assert near is not None and near.samples.shape == (SIDE, SIDE, CHANNELS)
    rows = filled(near).sum(axis=1)
    assert rows[0] > 2 and rows[-1] < 1
    fist = hand_window(CAMERA, drawn(fingers=False), WRIST, ELBOW, 0.25, mirrored=False)
    assert fist is not None and filled(fist).sum() < 0.8 * filled(near).sum()
    far = hand_window(
        CAMERA, drawn(fingers=True, z=3.0), WRIST * 1.5, np.array([0, 0.25, 3.0]), 0.25, mirrored=False
    )
    assert far is not None and np.abs(filled(far) - filled(near)).mean() < 0.1
    beside = hand_window(CAMERA, drawn(fingers=True, shift=0.03), WRIST, ELBOW, 0.25, mirrored=False)
    assert beside is not None and np.abs(filled(beside) - filled(near)).mean() < 0.08
    mirrored = hand_window(CAMERA, drawn(fingers=True), WRIST, ELBOW, 0.25, mirrored=True)
    assert mirrored is not None and np.abs(filled(mirrored)[:, ::-1] - filled(near)).mean() < 0.1


def test_nothing_at_the_hands_place_is_no_window() -> None:
    empty = np.zeros((424, 512), np.uint16)
    assert hand_window(CAMERA, empty, WRIST, ELBOW, 0.25, mirrored=False) is None
    assert hand_window(CAMERA, empty + 3500, WRIST, ELBOW, 0.25, mirrored=False) is None
    assert hand_window(CAMERA, drawn(fingers=True), WRIST, WRIST, 0.25, mirrored=False) is None
    assert hand_window(CAMERA, drawn(fingers=True), WRIST + 5, ELBOW + 5, 0.25, mirrored=False) is None


def test_circles_of_the_reference_system() -> None:
    middle = np.array([0.0, -0.045, 2.0])
    y, x = np.mgrid[:424, :512]
    radius_m = np.hypot(x - 255.5, y - (211.5 - 0.045 * 365 / 2)) * 2 / 365
    angle = np.arctan2(y - (211.5 - 0.045 * 365 / 2), x - 255.5)

    def hand(fingers: np.ndarray) -> np.ndarray:
        return np.where((radius_m < 0.065) | ((radius_m < 0.11) & fingers), 2000, 3500).astype(np.uint16)

    fist, spread, half = hand(angle > 9), hand(np.mod(angle, 0.5) < 0.4), hand(angle > 0)
    assert circles_state(CAMERA, fist, middle) == CLOSED
    assert circles_state(CAMERA, spread, middle) == OPEN
    assert circles_state(CAMERA, half, middle) == UNKNOWN
    assert circles_state(CAMERA, np.zeros_like(fist), middle) == UNKNOWN
    assert circles_state(CAMERA, fist, np.full(3, np.nan)) == UNKNOWN


def joints() -> tuple[np.ndarray, np.ndarray]:
    positions = np.full((JOINT_COUNT, 3), np.nan)
    confidence = np.zeros(JOINT_COUNT)
    for name, place in (("left_wrist", WRIST), ("left_elbow", ELBOW)):
        positions[INDEX[name]], confidence[INDEX[name]] = place, 0.9
    return positions, confidence


def constant_networks(value: float) -> Committee:
    """Networks that give the same answer for every window."""
    layers, side, channels = [], SIDE, CHANNELS
    for width, stride in KERNELS:
        layers += [np.zeros((width * width * channels, 2)), np.zeros(2)]
        side, channels = (side - width) // stride + 1, 2
    dense = [np.zeros((side * side * channels + ABOUT, 3)), np.zeros(3), np.zeros((3, 1)), np.full(1, value)]
    return Committee((Convolution(np.zeros(ABOUT), np.ones(ABOUT), (*layers, *dense)),))


def test_states_grow_sure_with_time_and_forget() -> None:
    positions, confidence = joints()
    states = HandStates(CAMERA, constant_networks(2.0))
    course = [states.update(drawn(fingers=True), positions, confidence, k * 33_000_000) for k in range(20)]
    open_probability = [next(h.open_probability for h in seen if h.method == "shape") for seen in course]
    assert {h.side for h in course[0]} == {"left"} and {h.method for h in course[0]} == {"shape", "circles"}
    assert open_probability[0] > 0.6 and open_probability[-1] > 0.95
    assert all(np.diff(open_probability) >= -1e-9)
    empty = np.zeros((424, 512), np.uint16)
    hidden = [states.update(empty, positions, confidence, (20 + k) * 33_000_000) for k in range(150)]
    assert abs(hidden[-1][0].open_probability - 0.5) < 0.05
    assert states.update(empty, positions, confidence * 0, 10**10) == ()


def test_the_network_tells_a_drawn_hand_from_a_drawn_fist() -> None:
    windows = [
        hand_window(CAMERA, drawn(fingers=f), WRIST, ELBOW, 0.25, mirrored=False) for f in (True, False)
    ]
    samples = np.array([window.samples for window in windows if window is not None])
    about = np.array([window.about for window in windows if window is not None])
    flat, fist = shape_networks()(samples, about)[:, 0]
    assert flat > fist + 1.0
