"""Solves a take with several presets, measures them against a reference, and draws the errors by joint.

python examples/compare.py TAKE REFERENCE OUT.png
"""

import sys

import matplotlib

import studio

matplotlib.use("Agg")
from matplotlib import pyplot

PRESETS = ("thesis", "studio", "finish")


def main(take_path: str, reference: str, out: str) -> None:
    take = studio.open_take(take_path)
    for preset in PRESETS:
        studio.solve(take, preset)
    figures = studio.evaluate(take, reference, list(PRESETS))

    joints = list(figures["studio"]["per_joint_mm"])
    axes = pyplot.figure(figsize=(10, 4), layout="constrained").subplots()
    for k, preset in enumerate(PRESETS):
        errors = [figures[preset]["per_joint_mm"][joint] for joint in joints]
        places = [place + (k - 1) * 0.27 for place in range(len(joints))]
        axes.bar(places, errors, 0.25, label=f"{preset}, mean {figures[preset]['mpjpe_mm']:.1f} mm")
    axes.set_xticks(range(len(joints)), joints, rotation=45, ha="right")
    axes.set_ylabel("distance from the reference [mm]")
    axes.legend()
    pyplot.savefig(out)
    print(f"{out}: " + ", ".join(f"{name} {one['mpjpe_mm']:.1f} mm" for name, one in figures.items()))


if __name__ == "__main__":
    main(*sys.argv[1:4])
