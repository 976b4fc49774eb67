"""Compare or update the figures of the fixed set, or measure their noise."""

import argparse
import json
import os
from pathlib import Path

import numpy as np

from studio.engine.base.files import write_json
from tests.regression.cases import CASES, PRESETS, WORSE, figures, seeded_figures

FILE = Path(__file__).with_name("figures.json")
SEEDS = range(1, 7)


def tolerance(known: dict, case: str, preset: str, name: str) -> float:
    """Return how much worse a figure may be: its deviation over seeds, or the least difference that is reported."""
    return max(known["noise"][case][preset].get(name, 0.0), WORSE[name][1])


def noise_of(case: str, data: Path) -> dict[str, dict[str, float]]:
    """Return the standard deviation of each figure over takes of one motion that differ by the seed of their noise.

    A seed with over twice the median error is no noise but a failure: it is reported and left out.
    """
    runs = {seed: seeded_figures(CASES[case], data, seed) for seed in SEEDS}
    out: dict[str, dict[str, float]] = {}
    for preset in PRESETS:
        error = {seed: run[preset]["mpjpe_mm"] for seed, run in runs.items()}
        failed = [seed for seed in SEEDS if error[seed] > 2.0 * float(np.median(list(error.values())))]
        for seed in failed:
            print(f"{case} {preset} seed {seed} fails: {error[seed]:.0f} mm")
        good = [runs[seed][preset] for seed in SEEDS if seed not in failed]
        out[preset] = {
            name: float(np.std([run[name] for run in good if name in run], ddof=1)) for name in good[0]
        }
    return out


def compared(known: dict, case: str, found: dict[str, dict[str, float]]) -> list[str]:
    """Return a line per figure that differs by more than its noise."""
    lines = []
    for preset, values in found.items():
        for name, value in values.items():
            before = known["figures"][case][preset].get(name)
            if before is None:
                continue
            worse = WORSE[name][0](value) - WORSE[name][0](before)
            if abs(worse) > tolerance(known, case, preset, name):
                verdict = "worse" if worse > 0 else "better"
                lines.append(f"{case} {preset} {name}: {before:.3f} -> {value:.3f}, {verdict}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.regression", description=__doc__)
    parser.add_argument("--update", action="store_true", help="write the present figures")
    parser.add_argument("--noise", action="store_true", help="find the noise anew from seeds (some minutes)")
    parser.add_argument("--case", nargs="+", choices=list(CASES), default=list(CASES))
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    args = parser.parse_args()
    known = json.loads(FILE.read_text()) if FILE.is_file() else {"figures": {}, "noise": {}}
    for case in args.case:
        if args.noise:
            known["noise"][case] = noise_of(case, args.data)
        found = figures(CASES[case], args.data)
        if case in known["figures"] and case in known["noise"]:
            print("\n".join(compared(known, case, found)) or f"{case}: as before, within noise")
        if args.update:
            known["figures"][case] = found
    if args.update or args.noise:
        write_json(FILE, known)


if __name__ == "__main__":
    main()
