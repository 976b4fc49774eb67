"""Errors of cameras around a pin that are a shift of some joints."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Performer
from studio.engine.model.joints import CANONICAL, PARENTS
from studio.engine.whole_take.mending.evidence import (
    BONE_M,
    MOST,
    SLOPE,
    Erring,
    best_of,
    bones_off,
    fastest_of,
    jumps_of,
    squared_of,
    too_far,
)

Array = NDArray[np.float64]

PIN_M, JUMP_M, LIKE_BONES, ROUNDS = 0.03, 0.05, 15.0, 4
"""For a shift: standard deviations of the measured distance from the pin, and of an elbow's jump [m]; number of a
bone's frames that count as one; and rounds of reweighting."""

SHORT_M = 0.1
"""Length below which a bone is not used [m]."""

MOST_OF_SHIFT = 36.0
"""Limit of a squared residual of a jump after subtraction of the shift: errors of this kind begin and end at once."""


class ShiftErrors:
    """Errors that are a shift of some joints, in some axes."""

    def __init__(
        self,
        tracks: Array,
        near: Array,
        scale: Array,
        joint: int,
        joints: tuple[int, ...],
        at: slice,
        place_m: Array,
        own: Array,
        lengths: Mapping[str, float],
        fastest_m_s: float,
        in_body: bool,
    ) -> None:
        """`fastest_m_s`: `fastest_of(near)`."""
        self._tracks, self.scale_of, self._joint, self._joints, self._at = tracks, scale, joint, joints, at
        self._own, self._lengths, self._in_body, self._fastest_m_s = own, lengths, in_body, fastest_m_s
        self._near, self._there = near, place_m.mean(axis=0)
        self._local = np.einsum("tba,tcjb->tcja", own, tracks[:, :, list(joints)])
        self._jump = jumps_of(self._local)
        self._plain = squared_of(self._jump, scale)
        self._frames = bones_off(tracks, joints[0], lengths) + too_far(near, at, self._there, fastest_m_s)

    def off_m(self, row: slice) -> Array:
        """Mean distance of the joint from the pin's place in some instants [m], shape (3,). Where an error begins or
        ends at the pin, an instant next to it is more exact."""
        pin = np.einsum("tba,b->ta", self._own[row], self._there)
        off = (self._local[row, :, self._joints.index(self._joint)] - pin[:, None]).reshape(-1, 3)
        known = np.isfinite(off[:, 0])
        return off[known].mean(axis=0) if known.any() else np.zeros(3)

    def by(self, shift: Array, off: Array) -> Erring:
        """The likeliest error with a shift [m], shape (3,), whose joint is off by `off` [m] at the pin."""
        away = np.einsum("tab,b->ta", self._own, shift)[:, None]
        top, tracks = self._joints[0], self._tracks
        frames = bones_off(tracks, top, self._lengths, tracks[:, :, top] - away)
        near = self._near - away
        fastest_m_s = fastest_of(near) if self._in_body else self._fastest_m_s
        frames += too_far(near, self._at, self._there, fastest_m_s) - self._frames
        begins, ends = (
            squared_of(self._jump + sign * shift, self.scale_of, MOST_OF_SHIFT) - self._plain
            for sign in (-1.0, 1.0)
        )
        found = best_of(
            frames, begins, ends, self._at, self._joints, off, in_body=self._in_body, follows=True
        )
        return replace(found, cost=found.cost + float(((shift - off) ** 2).sum()) / PIN_M**2)


def shift_of(
    found: Erring,
    tracks: Array,
    noise: Array,
    errs: NDArray[np.bool_],
    own: Array,
    performer: Performer | None,
) -> Array:
    """Return the shift of joints while an error lasts [m], shape (3,). It fits their distance from the pin, their
    jumps at its begin and end, and the length of their bone.

    Args:
        found: the error.
        tracks, noise: of all cameras, as in `erring`.
        errs: where each camera errs, shape (row_count, camera_count).
        own: axes in which the error is constant, shape (count, 3, 3).
        performer: as in `erring`.
    """
    joints = list(found.joints)
    edges = [(found.rows.start, errs[0], 1.0), (found.rows.stop, errs[-1], -1.0)]
    told = [
        (sign * _jump_at(k, tracks[:, :, joints], own)[by], noise[k][by][:, joints])
        for k, by, sign in edges
        if k < len(tracks)
    ]
    off = np.concatenate([np.empty((0, 3)), *(one.reshape(-1, 3) for one, _ in told)])
    sigma = JUMP_M * np.concatenate([np.empty(0), *(one.ravel() for _, one in told)])
    off, sigma = off[np.isfinite(off[:, 0])], sigma[np.isfinite(off[:, 0])]
    top = joints[0]
    length = None if performer is None or CANONICAL[top] == "hips" else performer.bone_m(CANONICAL[top])
    seen = tracks[found.rows]
    bones = np.einsum("tba,tcb->tca", own[found.rows], seen[:, :, top] - seen[:, :, int(PARENTS[top])])[errs]
    bones = bones[np.isfinite(bones[:, 0])]
    shift = found.shift_m
    for _ in range(ROUNDS):
        squared = ((off - shift) ** 2).sum(axis=1) / sigma**2
        weight = 1.0 / sigma**2 / (1.0 + squared / MOST)
        normal, right = np.eye(3) / PIN_M**2, found.shift_m / PIN_M**2
        normal, right = normal + weight.sum() * np.eye(3), right + weight @ off
        if length is not None and length > SHORT_M and len(bones):
            apart = np.linalg.norm(bones - shift, axis=1)
            unit = (bones - shift) / np.maximum(apart, 1e-6)[:, None]
            beyond = apart - length
            weight = 1.0 / BONE_M**2 / (1.0 + (beyond / BONE_M) ** 2 / MOST) / LIKE_BONES
            normal = normal + np.einsum("k,ka,kb->ab", weight, unit, unit)
            right = right + np.einsum("k,ka->a", weight * (beyond + unit @ shift), unit)
        shift = np.linalg.solve(normal, right)
    return shift


def _jump_at(k: int, tracks: Array, own: Array) -> Array:
    """The jumps before an instant, of the shape (camera_count, joint_count, 3), in some axes; see `jumps_of`."""
    first = max(k - SLOPE - 1, 0)
    about = slice(first, k + SLOPE)
    return jumps_of(np.einsum("tba,tcjb->tcja", own[about], tracks[about]))[k - first]
