"""`python -m tests.engine.seeing.tracker.fit_confidence`: the weights of `studio.engine.seeing.fitting.confidence`.

Performers for tuning, and random bodies like them, do motions on which no reported figure is measured: captures,
parts of the embedded motion and random ones with squats, seen by one, two and three cameras. For each kind of joint,
a logistic regression predicts from the evidence whether it is off by more than 6 cm; no slope may have the wrong
physical sign. Joints between 3.5 and 7 cm are left out. In a quarter of the runs, limbs are put into wrong poses, and
for a while stand behind a board. One threshold leaves the given share of the joints within 3 cm in the other runs
above log-odds of 0.
Prints the effect of the weights in runs that were left out of their fit (five folds), next to those in use; the
array; and how far the intercepts of those in use would have to fall for the same share. Takes about ten minutes on
one core.

The weights in use have the threshold of this program with a share of 0.08; their slopes are older. The weights fitted
here are as good or better (joints off by 10 cm doubted with 1 / 2 / 3 cameras 99 / 97 / 87 % for 95 / 100 / 87,
within 3 cm 14 / 6 / 4 % for 12 / 7 / 5; disturbed 92 / 93 / 100 for 95 / 86 / 100 and 25 / 9 / 11 for 40 / 12 / 28)
but are not in use: they do not doubt a joint that lies 0.6 m behind the seen surface, or a limb that leaves a square
metre unexplained, as long as its bone's points fit well. That hardly happens in these runs, but `test_geometry`
demands it.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.animation.motion.composer import compose
from studio.engine.animation.motion.keys import FloorPath, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.joints import INDEX
from studio.engine.seeing.fitting.cones import PARTS
from studio.engine.seeing.fitting.confidence import _WEIGHTS, EVIDENCE, KINDS, evidence, expected_errors
from studio.engine.seeing.search.limbs import CANDIDATES
from studio.engine.seeing.tracker.body import FollowedBody, usual_body
from studio.engine.seeing.tracker.tracker import Tracker
from studio.simulator.body.performers import TUNING, Actor
from studio.simulator.performer.motion import perform, read_performance
from tests.engine.seeing.tracker.bars import BEFORE_S, HZ, NEAR_M, OFF_M, T_POSE_S, tracked

CLIPS = ("02_01", "02_03", "02_04", "49_01", "49_04")
DEMO_S = (27.0, 47.0)
"""Starts of parts of the embedded motion that `bars` leaves out [s]."""

DRAWN, DRAWN_S = 0.45, 10.5
"""Share of the runs with a random motion, and its length [s]."""

CAMERAS = (1, 2, 1, 2, 3)
SIGNS = np.array([1, 0, 1, -1, -1, 1, 1, 1, 1])
"""Signs of the slopes, 0 = either: more variance, a place far from the usual depth behind the seen surface, fewer
points and more unexplained ones make no joint surer."""
RIDGE = 100.0
RIGHT_M, WRONG_M, LIMIT_M = 0.035, 0.07, 0.06
FOLDS = 5
_ARM = ((0.0, -0.2, 0.0, 0.1), (2.6, 1.6, 1.0, 2.2))
KIND = np.tile(np.arange(len(KINDS)), 2)

DISTURBED = 4
"""Every run of this number is disturbed."""
AFTER, PERIOD, HIDDEN_FRAMES = 110, 45, 25
"""Frames before the first disturbance, between two disturbances, and for which a limb is hidden."""
BOARD_M, BEFORE_M = 0.06, 0.35
"""How far the hiding board reaches beyond the limb's joints, and how far in front of them it stands [m]."""
JOINTS_OF_PART = {
    PARTS.index(f"{side}_{limb}"): [INDEX[f"{side}_{name}"] for name in names]
    for side in ("left", "right")
    for limb, names in (("arm", ("elbow", "wrist")), ("leg", ("knee", "ankle")))
}

Array = NDArray[np.float64]


class RecordedBody(FollowedBody):
    """A body that keeps the evidence of its confidences, of the last frame."""

    told: Array | None = None

    def _errors(self, fit, points, joints, places, axes):
        variance, seen = self._weighed(fit, points, joints, places, axes)
        self.told = evidence(self.fitter.chain, joints, variance, seen)
        return expected_errors(self.fitter.chain, joints, variance, seen)


class Recorder(Tracker):
    """A tracker that keeps the evidence of its first body's confidences, of all frames."""

    told: list[Array]

    def __init__(self, *args):
        super().__init__(*args)
        self.body = RecordedBody(0, self._views)
        self.bodies = [self.body]
        Recorder.told = []

    def track(self, frames, following=None):
        """Track, with a row for every frame."""
        self.body.told = None
        found = super().track(frames, following)
        nothing = np.full((len(KIND), len(EVIDENCE)), np.nan)
        Recorder.told.append(nothing if self.body.told is None else self.body.told)
        return found


class Disturbed(Recorder):
    """A tracker with disturbances: now and then a limb of the body is put into another pose, or a board stands in
    front of a limb in one camera's image for a while."""

    def __init__(self, *args):
        super().__init__(*args)
        self._rng = np.random.default_rng(len(self._views))
        self._limbs = usual_body()[2].limbs
        self._hidden: tuple[int, str] | None = None
        self._count = 0
        self._last: Array | None = None

    def track(self, frames, following=None):
        """Track the performer in the disturbed frames."""
        self._count += 1
        motion = self.body.motion
        if self._count > AFTER and self._count % PERIOD == 0 and motion.pose is not None:
            self._hidden = None
            limb = self._limbs[self._rng.integers(len(self._limbs))]
            if self._rng.random() < 0.5:
                angles = motion.pose.angles.copy()
                angles[limb.dofs] = limb.poses[self._rng.integers(CANDIDATES)]
                motion.pose = motion.pose.with_angles(angles)
            else:
                names = sorted(frames)
                self._hidden = limb.part, names[self._rng.integers(len(names))]
        if self._hidden is not None and self._count % PERIOD > HIDDEN_FRAMES:
            self._hidden = None
        if self._hidden is not None and self._last is not None and self._hidden[1] in frames:
            part, name = self._hidden
            frames = frames | {name: self._behind_something(frames[name], self._last[JOINTS_OF_PART[part]])}
        found = super().track(frames, following)
        self._last = found.positions if np.isfinite(found.positions).all() else None
        return found

    def _behind_something(self, frame: DepthFrame, joints: Array) -> DepthFrame:
        """Return a frame in which a board stands in front of joints of the stage [m], shape (n, 3)."""
        view = self._views[frame.camera]
        assert view.T_work_camera is not None
        places = transform_points(invert_transform(view.T_work_camera), joints)
        columns, rows = view.camera.pixels_of(places).T
        depth_mm, margin = frame.depth_mm.copy(), BOARD_M * view.camera.fx / places[:, 2].mean()
        low, high = (int(max(f, 0)) for f in (rows.min() - margin, rows.max() + margin))
        left, right = (int(max(f, 0)) for f in (columns.min() - margin, columns.max() + margin))
        depth_mm[low:high, left:right] = 1000.0 * max(places[:, 2].min() - BEFORE_M, 0.3)
        return replace(frame, depth_mm=depth_mm)


def random_performer(rng: np.random.Generator) -> Actor:
    """Return a random body close to one of those for tuning."""
    base = TUNING[rng.integers(len(TUNING) - 1)]
    return replace(
        base, name="random", height_m=rng.uniform(1.5, 2.0), girth=base.girth * rng.uniform(0.9, 1.1),
        legs=rng.uniform(0.96, 1.04), arms=rng.uniform(0.96, 1.04), sleeve=rng.uniform(0.6, 2.0),
        looseness_m=rng.uniform(0.009, 0.022), skirt_m=rng.uniform(0.0, 0.09), seed=int(rng.integers(1000, 9999)),
    )  # fmt: skip


def drawn_motion(rng: np.random.Generator) -> CanonicalMotion:
    """Return a T-pose, then random motion: arms anywhere in front of the body, squats, the trunk turned."""
    keys, path, now = Keys(), FloorPath(), T_POSE_S - 0.5
    keys.move(0.0, 0.0, left_raise=np.pi / 2, right_raise=np.pi / 2)
    path.wait(T_POSE_S)
    path.turn(rng.uniform(-1.0, 1.0))
    while now < DRAWN_S:
        length_s = rng.uniform(0.5, 1.2)
        drop = rng.uniform(0.15, 0.42) if rng.random() < 0.5 else 0.0
        body = {"drop": drop, "back": 0.4 * drop, "lean": 1.1 * drop, "bend": 0.5 * drop, "nod": -0.7 * drop}
        for side in ("left", "right"):
            arm = dict(zip(("raise", "plane", "roll", "elbow"), rng.uniform(*_ARM), strict=True))
            body |= {f"{side}_{name}": value for name, value in arm.items() if rng.random() < 0.9}
        keys.move(now, now + length_s, twist=rng.uniform(-0.4, 0.4), **body)
        now += length_s + rng.uniform(0.0, 0.5)
    path.wait(max(DRAWN_S - path.end_s, 0.0))
    return compose(AUTHORED_OFFSETS, keys, path, DRAWN_S)


def disturbed(number: int) -> bool:
    """Whether a run is disturbed."""
    return number % DISTURBED == DISTURBED - 1


def run(number: int, mocap: Path) -> tuple[Array, Array]:
    """Return errors [m], shape (frame_count, 12), and evidence, shape (frame_count, 12, evidence_count), of a run."""
    rng = np.random.default_rng([9, number])
    performer = TUNING[number] if number < len(TUNING) else random_performer(rng)
    if rng.random() < DRAWN:
        motion, begin_s = perform(drawn_motion(rng), performer), T_POSE_S + BEFORE_S
    else:
        choice = int(rng.integers(len(CLIPS) + len(DEMO_S)))
        if choice < len(CLIPS):
            motion = read_performance(mocap / f"{CLIPS[choice]}.bvh", performer, unit_m=0.056444)
            begin_s = motion.calibration_s or 0.0
        else:
            motion, begin_s = perform(demo_motion(), performer), DEMO_S[choice - len(CLIPS)]
    make = Disturbed if disturbed(number) else Recorder
    found = tracked(motion, performer, CAMERAS[number % len(CAMERAS)], begin_s, number, make)
    told = np.stack(Recorder.told[-len(found.error_m) :])
    moving = round((motion.motion.duration_s - begin_s) * HZ)
    return found.error_m[:moving], told[:moving]


def fitted(told: Array, error_m: Array, kind: NDArray[np.int64]) -> Array:
    """Return the weights, shape (kind_count, evidence_count), no slope against its sign in `SIGNS`."""
    out = np.empty((len(KINDS), len(EVIDENCE)))
    for k in range(len(KINDS)):
        clear = (kind == k) & ((error_m < RIGHT_M) | (error_m > WRONG_M))
        x = told[clear][:, 1:]
        middle, spread = x.mean(axis=0), x.std(axis=0) + 1e-6
        weights = bounded_logistic((x - middle) / spread, error_m[clear] > LIMIT_M, SIGNS)
        slopes = weights[1:] / spread
        out[k] = [weights[0] - slopes @ middle, *slopes]
    return out


def bounded_logistic(x: Array, positive: NDArray[np.bool_], signs: Array) -> Array:
    """Return intercept and slopes of a logistic regression with ridge, shape (1 + n,); x has the shape (count, n).

    `signs`: of the slopes, shape (n,). Source of the bounded steps: Byrd, Lu, Nocedal & Zhu, "A limited memory
    algorithm for bound constrained optimization", SIAM J. Sci. Comput. 1995.
    """
    y = np.where(positive, 1.0, -1.0)

    def loss(weights: Array) -> tuple[float, Array]:
        margin = y * (weights[0] + x @ weights[1:])
        slope = -y / (1.0 + np.exp(np.minimum(margin, 500.0)))
        gradient = np.array([slope.sum(), *(x.T @ slope + RIDGE * weights[1:])])
        return float(np.logaddexp(0.0, -margin).sum() + 0.5 * RIDGE * weights[1:] @ weights[1:]), gradient

    bounds = [(None, None), *(((None, 0.0), (None, None), (0.0, None))[sign + 1] for sign in signs)]
    return minimize(loss, np.zeros(1 + x.shape[1]), jac=True, method="L-BFGS-B", bounds=bounds).x


def doubted(log_odds: Array, error_m: Array) -> str:
    """Return the shares of the wrong joints and of the near joints that are doubted, as text."""
    off, near = ((log_odds[some] > 0.0).mean() for some in (error_m > OFF_M, error_m < NEAR_M))
    return f"{off:.2f} of those off by 10 cm, {near:.2f} of those within 3 cm"


def main() -> None:
    """Print the weights and their effect."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mocap", type=Path, default=Path("../shared/data/mocap"))
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument(
        "--near", type=float, default=0.08, help="share of the joints within 3 cm to be doubted"
    )
    args = parser.parse_args()
    errors, told, runs = [], [], []
    for number in range(args.runs):
        error_m, weighed = run(number, args.mocap)
        errors.append(error_m.ravel())
        told.append(weighed.reshape(-1, len(EVIDENCE)))
        runs.append(np.full(error_m.size, number))
        print(f"run {number}: {100 * np.nanmean(error_m):.1f} cm", flush=True)
    error_m, x, of_run = np.concatenate(errors), np.concatenate(told), np.concatenate(runs)
    kind = np.tile(KIND, len(error_m) // len(KIND))
    known = np.isfinite(error_m) & np.isfinite(x).all(axis=1)
    error_m, x, of_run, kind = error_m[known], x[known], of_run[known], kind[known]
    calm = ~np.isin(of_run, [number for number in range(args.runs) if disturbed(number)])
    score = np.zeros(len(error_m))
    for fold in range(FOLDS):
        out = of_run // len(CAMERAS) % FOLDS == fold
        weights = fitted(x[~out], error_m[~out], kind[~out])
        score[out] = (weights[kind[out]] * x[out]).sum(axis=1)
    score -= np.quantile(score[calm & (error_m < NEAR_M)], 1.0 - args.near)
    in_use = (_WEIGHTS[kind] * x).sum(axis=1)
    for cameras in sorted(set(CAMERAS)):
        for name, some in (("", calm), (", disturbed", ~calm)):
            own = some & (np.array(CAMERAS)[of_run % len(CAMERAS)] == cameras)
            print(f"{cameras} cameras{name}: fitted {doubted(score[own], error_m[own])}; ", end="")
            print(f"in use {doubted(in_use[own], error_m[own])}")
    weights = fitted(x, error_m, kind)
    score = (weights[kind] * x).sum(axis=1)
    weights[:, 0] -= np.quantile(score[calm & (error_m < NEAR_M)], 1.0 - args.near)
    print(np.array2string(weights, separator=", ", max_line_width=118, formatter={"float": "{:.2f}".format}))
    used = in_use[calm & (error_m < NEAR_M)]
    print(
        f"the weights in use with {np.quantile(used, 1.0 - args.near):.2f} less doubt as many of those within 3 cm"
    )


if __name__ == "__main__":
    main()
