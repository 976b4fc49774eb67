"""Statements on agreement with the thesis, all derived from the figures."""

from dataclasses import dataclass
from itertools import pairwise

from studio.lab.study.results import Change, Results
from studio.lab.study.thesis_tables import FOUR, HEADLINE, LABELS, MOVED_SHARE, TABLES, Condition, Table

ALIKE = 0.05
"""Smallest relative change in the thesis that counts; the thesis gives no intervals."""


@dataclass(frozen=True)
class ThesisFinding:
    """One comparison with the thesis: `agrees`, `differs`, or `open` if the study cannot decide."""

    verdict: str
    text: str


def _short(name: str) -> str:
    """A figure's label without its unit."""
    return LABELS[name].split(",")[0]


def findings(table: Table, results: Results) -> list[ThesisFinding]:
    """Return a finding for each of the thesis's figures of each condition, relative to the table's first."""
    out = []
    for condition in table.conditions[1:]:
        if condition.thesis is None or table.base.thesis is None or not results.of(condition):
            continue
        problems = results.problems(condition)
        if len(problems) == len(results.of(condition)):
            out.append(
                ThesisFinding("differs", f"{condition.title}: no recording could be used ({problems[0]}).")
            )
            continue
        for index, name in enumerate(FOUR):
            change = results.change(table.base, condition, name)
            if change is not None:
                out.append(
                    _finding(condition.title, name, table.base.thesis[index], condition.thesis[index], change)
                )
    return out


def _finding(
    title: str, name: str, thesis_before: float, thesis_after: float, change: Change
) -> ThesisFinding:
    moved = thesis_after - thesis_before
    direction = 0 if abs(moved) < ALIKE * abs(thesis_before) else (1 if moved > 0 else -1)
    words = {-1: "falls", 0: "stays", 1: "rises"}
    theirs = f"the thesis's {words[direction]} from {thesis_before:g} to {thesis_after:g}"
    if change.count < 2:
        return ThesisFinding(
            "open",
            f"{title}, {_short(name)}: {change.before:z.1f} to {change.after:z.1f} on a single recording; {theirs}.",
        )
    interval = f"{change.difference:+.2f}, 95 % {change.low:+.2f} to {change.high:+.2f}"
    if change.direction == 0:
        ours = f"from {change.before:z.1f} to {change.after:z.1f} here, which chance explains ({interval})"
    else:
        ours = f"{words[change.direction]} from {change.before:z.1f} to {change.after:z.1f} here ({interval})"
    verdict = "agrees" if change.direction == direction else "open" if change.direction == 0 else "differs"
    return ThesisFinding(verdict, f"{title}, {_short(name)}: {ours}; {theirs}.")


def reasons(table: Table, results: Results) -> list[str]:
    """Return sentences on the causes, from the evidence in the study's own extra columns."""
    return {
        "5.1": _cameras, "5.2": _inverse_kinematics, "5.3": _limits, "5.5": _displacement, "5.6": headline,
    }.get(table.number, _nothing)(results)  # fmt: skip


def _nothing(results: Results) -> list[str]:
    return []


def level(results: Results) -> list[str]:
    """Why the absolute errors are smaller here than in the thesis."""
    raw = results.mean(Condition("", "raw", 1, False), FOUR[0])
    if not raw:
        return []
    return [
        f"One raw camera is {raw:.1f} cm off here and 14.4 cm in the thesis. What differs by construction: both "
        "motions are on one clock and in one frame here, with the rigid alignment fitted on all joints; in the "
        "thesis the two systems' clocks drifted and nothing was fitted (3.2.3), and its targets lay off the "
        "joints. The simulated tracker's noise follows depth cameras' data sheets, not the worst moments of the "
        "thesis's tracker. So directions "
        "and ratios are compared, not centimetres."
    ]


def _cameras(results: Results) -> list[str]:
    out = level(results)
    for count in (2, 3, 4):
        on, off = (Condition("", "raw", count, flag) for flag in (True, False))
        if not (results.of(on) and results.of(off)):
            continue
        problems = results.problems(on)
        if problems:
            out.append(
                f"With {count} cameras that disturb each other {len(problems)} of {len(results.of(on))} recordings "
                f"cannot be used ({problems[0].split(':')[0]}); without interference "
                f"{len(results.problems(off))} of {len(results.of(off))}. The thesis lost the skeleton with four."
            )
        change = results.change(off, on, FOUR[0])
        if change is not None:
            out.append(
                f"Interference alone takes the absolute difference of {count} cameras from {change.before:.1f} to "
                f"{change.after:.1f} cm ({_told(change)})."
            )
    for count in (2, 3):
        ruled, plain = (Condition("", name, count, True) for name in ("raw", "raw:confidence_threshold=0.0"))
        change = results.change(ruled, plain, FOUR[0])
        if change is not None:
            out.append(
                f"Without the thesis's rule that joints under 75 % are ignored, "
                f"{count} cameras are at {change.after:.1f} "
                f"instead of {change.before:.1f} cm ({_told(change)}): a joint that every camera doubts "
                "keeps its last "
                "place under the rule."
            )
    for count in (2, 3, 4):
        mean, robust = (Condition("", name, count, False) for name in ("raw", "raw:fusion=robust"))
        change = results.change(mean, robust, FOUR[0])
        if change is not None:
            behind = (
                ": a camera behind the performer takes left for right half of the time" if count == 4 else ""
            )
            out.append(
                f"Undisturbed, robust fusion puts {count} cameras at {change.after:.1f} instead of the mean's "
                f"{change.before:.1f} cm ({_told(change)}){behind}."
            )
    return out


def _told(change: Change) -> str:
    if change.count < 2:
        return "one recording"
    if change.direction == 0:
        return f"not told from chance, {change.low:+.2f} to {change.high:+.2f}"
    return f"{change.low:+.2f} to {change.high:+.2f}"


def _inverse_kinematics(results: Results) -> list[str]:
    ways = [condition for condition in TABLES[1].conditions if results.mean(condition, FOUR[0]) is not None]
    if not ways:
        return []
    best = min(ways, key=lambda one: results.mean(one, FOUR[0]) or 0.0)
    cleanest = min(ways, key=lambda one: results.mean(one, "cleanup_events_per_min") or 0.0)
    return [
        f"Nearest to the truth here: {best.title} ({results.mean(best, FOUR[0]):.1f} cm); least to clean up: "
        f"{cleanest.title} ({results.mean(cleanest, 'cleanup_events_per_min'):.0f} events a minute). "
        "In the thesis the "
        "combined skeleton was nearer to the truth and the previous pose was preferred, 50 to 16."
    ]


def _limits(results: Results) -> list[str]:
    out = []
    theirs = 100 * MOVED_SHARE[0] / MOVED_SHARE[1]
    for title, name in (
        ("limits and relax pose", "limits_relax"),
        ("limits", "limits"),
        ("relax pose", "relax"),
    ):
        moved = results.moved_share(Condition("", name, 1, False))
        if moved is not None and moved[1]:
            out.append(
                f"With {title}, a joint is at least 10 cm from where it is without in "
                f"{100 * moved[0] / moved[1]:.1f} % "
                f"of the frames ({moved[0]} of {moved[1]}); with both, the thesis counted {theirs:.1f} % "
                f"({MOVED_SHARE[0]} of {MOVED_SHARE[1]})."
            )
    return out


def _displacement(results: Results) -> list[str]:
    base = TABLES[4].base
    out = []
    for name in ("displacement_before", "displacement_after", "holt_before", "holt_after"):
        condition = Condition("", name, 1, False)
        change, lag = results.change(base, condition, FOUR[0]), results.change(base, condition, "latency_ms")
        if change is not None and lag is not None:
            out.append(
                f"{name.replace('_', ' ')}: absolute difference {change.difference:+.2f} cm, "
                f"delay {lag.difference:+.0f} ms."
            )
    if out:
        out.append(
            "The thesis does not print its thresholds; the studio's are the fastest known human movements "
            "(docs/switches.md), so that only what no body does is held back."
        )
    return out


def headline(results: Results) -> list[str]:
    """Whether the thesis's headline is reached, and if not, which part causes it."""
    raw, retained = Condition("", "raw", 1, False), Condition("", "thesis", 2, True)
    out, reached = [], True
    for name, theirs in HEADLINE.items():
        change = results.change(raw, retained, name)
        if change is None or change.share is None:
            continue
        enough = change.share <= theirs
        reached = reached and enough
        out.append(
            f"Preset thesis with two cameras against one raw camera: {_short(name)} {100 * change.share:+.1f} % "
            f"({change.before:.2f} to {change.after:.2f}, {_told(change)}); the thesis has {100 * theirs:+.1f} %, "
            f"which is "
            f"{'reached' if enough else 'not reached'}."
        )
    if out and not reached:
        out += ablation(results)
    for variant, cameras in (("studio", 2), ("finish", 2), ("finish", 1)):
        changes = {
            name: results.change(raw, Condition("", variant, cameras, cameras > 1), name) for name in HEADLINE
        }
        shares = [
            f"{_short(name)} {100 * change.share:+.1f} %"
            for name, change in changes.items()
            if change is not None and change.share is not None
        ]
        if shares:
            out.append(
                f"Preset {variant} with {cameras} camera{'s'[: cameras > 1]}, likewise: {', '.join(shares)}."
            )
    return out


def ablation(results: Results) -> list[str]:
    """Return the chain from one raw camera to the retained combination, and the effect of each part."""
    name, out = FOUR[0], []
    chain = (("raw", 1, "one raw camera"), ("raw", 2, "two raw cameras"), ("previous_pose", 2, "+ previous pose"),
             ("limits", 2, "+ human limits"), ("limits_bone_length", 2, "+ bone length limit"),
             ("thesis", 2, "+ displacement limit, look-at, hands"))  # fmt: skip
    steps: list[tuple[str, float, float]] = []
    for variant, cameras, title in chain:
        absolute, shortest = (
            results.mean(Condition("", variant, cameras, cameras > 1), figure) for figure in FOUR[:2]
        )
        if absolute is not None and shortest is not None:
            steps.append((title, absolute, shortest))
    if len(steps) > 1:
        told = "; ".join(f"{title} {absolute:.2f} / {shortest:.2f}" for title, absolute, shortest in steps)
        out.append(f"Part by part, absolute difference / shortest distance in cm: {told}.")
        out.append(_best_step(steps))
    helped = [(change.difference, title, change) for title, change in singles(results, "thesis", name)]
    gains = sorted(one for one in helped if one[2].direction == -1)
    if gains:
        told = "; ".join(
            f"{title} {difference:+.2f} cm ({_told(change)})" for difference, title, change in gains
        )
        out.append(f"What changes it most, one switch at a time from preset thesis: {told}.")
    elif helped:
        out.append("No single switch of preset thesis lowers the absolute difference by more than chance.")
    return out


def _best_step(steps: list[tuple[str, float, float]]) -> str:
    """Best point of the chain, and the step with the largest loss."""
    first, best = steps[0], min(steps[1:], key=lambda step: step[1])
    shares = [100 * (after / before - 1) for after, before in zip(best[1:], first[1:], strict=True)]
    rises = [(after[1] - before[1], after[0]) for before, after in pairwise(steps)]
    cost, costly = max(rises[1:] or rises)
    words = (
        f"The chain is best at “{best[0]}”: {shares[0]:+.1f} % and {shares[1]:+.1f} % against one raw camera"
    )
    return (
        f"{words}; the step that costs most after two cameras is “{costly}”, {cost:+.2f} cm."
        if cost > 0
        else f"{words}."
    )


def singles(results: Results, preset: str, figure: str) -> list[tuple[str, Change]]:
    """Return the change of a figure by each single switch of a preset, with two interfering cameras."""
    base = Condition("", preset, 2, True)
    names = dict.fromkeys(
        cell["variant"] for cell in results.cells if cell["variant"].startswith(f"{preset}:")
    )
    found = (
        (name.split(":", 1)[1], results.change(base, Condition("", name, 2, True), figure)) for name in names
    )
    return [(title, change) for title, change in found if change is not None]
