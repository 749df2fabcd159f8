#!/usr/bin/env python3
"""Tables of the runs of sizes.sh, each with the law that fits its CPU time and its memory.

    sizes.py RUNS

RUNS/SUBJECT/SIZE/ROUND holds the results of `stereo_slam run` and floor.json. Figures are medians over the rounds, the spread of a ratio is
its largest minus its smallest value. The law of y against x is a + b x by least squares, with the largest relative difference from it.
"""
import csv
import json
import pathlib
import statistics
import sys

from summarise import cost, over_rounds


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
    rows = []
    for folder in (runs / subject).iterdir():
        rounds = sorted(folder.iterdir())
        rows.append((size_of(rounds[0]), over_rounds([cost(folder) for folder in rounds])))
    rows.sort(key=lambda row: row[0])
    lines = [f"| {title} | CPU ms | floor: CPU ms | CPU / floor (spread) | median / floor (spread) | peak MB |", "|---|---|---|---|---|---|"]
    for size, figures in rows:
        cells = [f"{size:.0f}" if size >= 100 else f"{size:.2f}", f"{figures['cpu_ms']['median']:.1f}", f"{figures['floor_cpu_ms']['median']:.1f}"]
        for ratio in ("cpu_to_floor", "median_to_floor"):
            cells.append(f"{figures[ratio]['median']:.2f} ({figures[ratio]['spread']:.2f})")
        lines.append("| " + " | ".join([*cells, f"{figures['peak_mb']['median']:.0f}"]) + " |")
    sizes = [size for size, _ in rows]
    laws = []
    for name, unit in (("cpu_ms", "CPU ms"), ("peak_mb", "MB")):
        a, b, difference = line_fit(sizes, [figures[name]["median"] for _, figures in rows])
        laws.append(f"{a:.3g} {b:+.3g} x {unit} (to {100 * difference:.0f} %)")
    return "\n".join(lines) + "\n\nLaw, x in the unit of the first column: " + ", ".join(laws) + ".\n"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    print("\n".join(table(folder, subject) for subject in SUBJECTS if (folder / subject).is_dir()))
