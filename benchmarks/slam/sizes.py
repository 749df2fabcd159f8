#!/usr/bin/env python3
"""Tables of the runs of sizes.sh, each with the law that fits its CPU time and its memory.

    sizes.py RUNS

The law of y against x is a + b x by least squares, with the largest relative difference from it.
"""
import csv
import json
import pathlib
import statistics
import sys

from summarise import cost


def megapixels(folder):
    floor = json.loads((folder / "floor.json").read_text())
    return 1e-6 * floor["width_px"] * floor["height_px"]


def tracked_points(folder):
    return int(folder.parent.name)


def landmarks(folder):
    """Landmarks that were matched in a frame, in the median: two degrees of freedom and a third for the disparity each."""
    with open(folder / "covariances.csv", newline="") as file:
        return statistics.median(int(row["nis_dof"]) / 3 for row in csv.DictReader(file))


def frames(folder):
    return cost(folder)["frames"]


SUBJECTS = {"pixels": ("Mpx an image", megapixels), "points": ("points followed at most", tracked_points),
            "landmarks": ("landmarks matched", landmarks), "length": ("frames", frames)}


def line_fit(x, y):
    """a, b and the largest relative difference of y from a + b x."""
    b, a = statistics.linear_regression(x, y)
    return a, b, max(abs(v - (a + b * u)) / v for u, v in zip(x, y))


def table(runs, subject):
    title, size_of = SUBJECTS[subject]
    measured = [(size_of(folder), cost(folder)) for folder in (runs / subject).glob("*/1")]
    rows = sorted(measured, key=lambda row: row[0])
    lines = [f"| {title} | CPU ms | median / floor | CPU / floor | peak MB |", "|---|---|---|---|---|"]
    for size, figures in rows:
        lines.append(f"| {size:.3g} | {figures['cpu_ms']:.1f} | {figures['median_to_floor']:.2f} | {figures['cpu_to_floor']:.2f} | "
                     f"{figures['peak_mb']:.0f} |")
    sizes = [size for size, _ in rows]
    laws = []
    for name, unit in (("cpu_ms", "CPU ms"), ("peak_mb", "MB")):
        a, b, difference = line_fit(sizes, [figures[name] for _, figures in rows])
        laws.append(f"{a:.3g} + {b:.3g} x {unit} (to {100 * difference:.0f} %)")
    return "\n".join(lines) + "\n\nLaw, x in the unit of the first column: " + ", ".join(laws) + ".\n"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    print("\n".join(table(folder, subject) for subject in SUBJECTS if (folder / subject).is_dir()))
