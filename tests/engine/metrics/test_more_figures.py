"""PCK, the spectral arc length, contacts and heights of feet in cases with a known answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.engine.metrics.figures.contacts import contact_precision_recall, foot_heights_cm
from studio.engine.metrics.figures.feet import FOOT_JOINTS
from studio.engine.metrics.figures.pck import pck
from studio.engine.metrics.figures.spectral_arc import spectral_arc_length, spectral_arc_lengths
from studio.engine.metrics.reference.matching import match
from studio.engine.model.joints import INDEX, MEASURED_JOINTS
from tests.engine.metrics.cases import dance, poses_of, reference_of, shifted, still

RATE = 60.0
TIME = np.arange(600) / RATE


def test_joints_within_a_distance_are_counted():
    truth = dance(TIME)
    moved = shifted(truth, {"left_wrist": [0.03, 0.0, 0.04], "head": [0.0, 0.2, 0.0]})
    moved[:300, INDEX["head"]] = truth[:300, INDEX["head"]]
    matched = match(poses_of(TIME, moved), reference_of(TIME, truth))
    count = len(MEASURED_JOINTS)
    assert pck(matched, 49.999) == pytest.approx((count - 1.5) / count, abs=1e-9)
    assert pck(matched, 50.001) == pytest.approx((count - 0.5) / count, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(length=st.integers(8, 400), speed=st.floats(0.01, 10.0), rate=st.sampled_from([30.0, 60.0, 120.0]))
def test_a_constant_speed_has_the_arc_of_its_dirichlet_kernel(length, speed, rate):
    """|V(f)| = |sin(pi f n / rate) / (n sin(pi f / rate))|, padded to 16 times the next power of two."""
    count = 2 ** (int(np.ceil(np.log2(length))) + 4)
    f = np.arange(count // 2 + 1) * rate / count
    with np.errstate(invalid="ignore", divide="ignore"):
        kernel = np.abs(np.sin(np.pi * f * length / rate) / (length * np.sin(np.pi * f / rate)))
    kernel[0] = 1.0
    kernel = kernel[f <= 10.0]
    last = np.flatnonzero(kernel >= 0.05)[-1]
    arc = -np.hypot(1.0 / last, np.diff(kernel[: last + 1])).sum()
    assert spectral_arc_length(np.full(length, speed), rate) == pytest.approx(arc, abs=1e-9)


def test_a_shaken_movement_is_less_smooth_whatever_its_size():
    bell = np.sin(np.pi * np.arange(120) / 119) ** 2
    shaken = bell * (1 + 0.4 * np.sin(2 * np.pi * 5 * np.arange(120) / RATE))
    assert spectral_arc_length(bell, RATE) > -1.7  # a single bell-shaped movement: about -1.5
    assert spectral_arc_length(shaken, RATE) < spectral_arc_length(bell, RATE) - 0.3
    assert spectral_arc_length(7.0 * bell, RATE) == pytest.approx(spectral_arc_length(bell, RATE), abs=1e-9)
    assert spectral_arc_length(np.zeros(120), RATE) == 0.0


def test_spectral_arcs_of_a_take_are_those_of_the_reference_where_they_are_equal():
    truth = dance(TIME)
    solve, reference = spectral_arc_lengths(match(poses_of(TIME, truth), reference_of(TIME, truth)))
    assert solve == pytest.approx(reference, abs=1e-9) and solve < -1.0
    rest = still(600)
    assert spectral_arc_lengths(match(poses_of(TIME, rest), reference_of(TIME, rest))) == (None, None)


def feet(lifted):
    """A body whose feet stand, except that one ankle is lifted by 30 cm in these frames."""
    out = still(600)
    for name in FOOT_JOINTS:
        out[:, INDEX[name], 2] = 0.05
    out[lifted, INDEX["left_ankle"], 2] += 0.3
    return out


def test_contacts_are_compared_frame_by_frame():
    """The reference's ankle is up from frame 300 on, the solve's from frame 350 on; 4 joints, 598 inner frames."""
    reference, solve = feet(slice(300, 600)), feet(slice(350, 600))
    precision, recall = contact_precision_recall(match(poses_of(TIME, solve), reference_of(TIME, reference)))
    inner, before_lift, before_late_lift = 598, 298, 348  # frames next to a jump move too fast to stand
    found, true = 3 * inner + before_late_lift, 3 * inner + before_lift
    assert recall == pytest.approx(1.0, abs=1e-9)
    assert precision == pytest.approx(true / found, abs=1e-9)


def test_height_of_standing_feet_has_a_sign():
    reference = feet(slice(0, 0))
    floating = reference + np.array([0.0, 0.0, 0.02])
    matched = match(poses_of(TIME, floating), reference_of(TIME, reference))
    assert foot_heights_cm(matched) == pytest.approx((2.0, 2.0), abs=1e-9)
    sunk = reference.copy()
    sunk[::2, :, 2] -= 0.01
    matched = match(poses_of(TIME, sunk), reference_of(TIME, reference))
    assert foot_heights_cm(matched) == pytest.approx((-0.5, 0.5), abs=0.01)


def test_without_feet_there_are_no_contacts():
    truth = still(600)
    truth[:, [INDEX[name] for name in FOOT_JOINTS]] = np.nan
    matched = match(poses_of(TIME, still(600)), reference_of(TIME, truth))
    assert contact_precision_recall(matched) == (None, None)
    assert foot_heights_cm(matched) == (None, None)
