#!/usr/bin/env python3
"""Table of the drives of drives.sh: shares of poses within the 95 % bound of their covariances.

    drives.py OUT

A row has all drives whose names agree up to the hyphen; shares and medians are means over its drives, in brackets the smallest and the
largest of one drive. Poses of one drive share their errors, so it is the number of drives that says how sure a share is: below the table are the
means over all drives with their standard errors.
"""
import collections
import json
import pathlib
import statistics
import sys

WINDOWS = (1, 10, 100)


def figures(folder):
    """Of one drive: ATE in metres, path ratio, and share inside and median NEES of each window and of the world."""
    scores = json.loads((folder / "scores.json").read_text())
    result = {"ate": scores["ate_se3_aligned_m"]["rmse"], "ratio": scores["path_ratio"]}
    nees = {entry["frames"]: entry for entry in scores["nees"]["relative_nees"]} | {"world": scores["nees"]["world_nees"]}
    for window, entry in nees.items():
        if entry["count"] > 0:
            result[f"inside {window}"] = 100 * entry["share_inside_95"]
            result[f"median {window}"] = entry["median"]
    return result


def spread(drives, key, form):
    values = [drive[key] for drive in drives if key in drive]
    if not values:
        return "n/a"
    text = form.format(statistics.mean(values))
    return text if len(values) == 1 else f"{text} ({form.format(min(values))} to {form.format(max(values))})"


def row(name, drives):
    cells = [name, str(len(drives)), spread(drives, "ate", "{:.3f}"), spread(drives, "ratio", "{:.4f}")]
    for window in (*WINDOWS, "world"):
        cells.append(spread(drives, f"inside {window}", "{:.0f}"))
    cells.append(spread(drives, "median 100", "{:.1f}"))
    return "| " + " | ".join(cells) + " |"


def main(out):
    groups = collections.defaultdict(list)
    for scores in sorted(out.glob("*/scores.json")):
        groups[scores.parent.name.rpartition("-")[0]].append(figures(scores.parent))
    if not groups:
        sys.exit(f"{out}: no drive has been scored")
    print("| drives | | ATE m | path ratio | % inside, 1 frame | 10 frames | 100 frames | from the first frame | median NEES, 100 frames |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, drives in groups.items():
        print(row(name.replace("_", " "), drives))
    every = [drive for drives in groups.values() for drive in drives]
    print(row("all", every))
    for window in (*WINDOWS, "world"):
        values = [drive[f"inside {window}"] for drive in every if f"inside {window}" in drive]
        if len(values) > 1:
            error = statistics.stdev(values) / len(values) ** 0.5
            print(f"\n{window}: {statistics.mean(values):.1f} +- {error:.1f} % inside ({len(values)} drives)", end="")
    print()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
