#!/usr/bin/env python3
"""Compares inertial.csv of `stereo_slam run --imu` with a ground truth in EuRoC's layout.

    score_inertial.py OUT/inertial.csv mav0/state_groundtruth_estimate0/data.csv [--down y|z]

Prints the errors of velocity, tilt and biases, with their NEES. Without velocities in the truth, they are those of cubic
polynomials through 0.15 s of its positions. --down is the axis of the world that gravity is along: -z (EuRoC), or y (rendered)."""
import argparse
import csv
import numpy as np


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def read_truth(file):
    rows = [line.strip().split(",") for line in open(file) if not line.startswith("#")]
    return np.array([int(row[0]) for row in rows]), np.array([[float(x) for x in row[1:]] for row in rows])


def velocity(stamps, truth, i):
    """In the world; None at the ends of a truth without velocities."""
    if truth.shape[1] >= 10:
        return truth[i, 7:10]
    near = np.abs(stamps - stamps[i]) <= 75_000_000
    if i < 15 or i + 15 >= len(stamps):
        return None
    return np.linalg.lstsq(np.vander(1e-9 * (stamps[near] - stamps[i]), 4), truth[near, :3], rcond=None)[0][2]


def print_score(name, errors, nees, dof, unit):
    errors = np.array(errors)
    print(f"{name:9} rms {np.sqrt((errors ** 2).sum(1).mean()):.4g} {unit}, NEES {np.mean(nees):.2f} ({dof} expected)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("inertial")
    parser.add_argument("truth")
    parser.add_argument("--down", choices=["y", "z"], default="z")
    arguments = parser.parse_args()
    stamps, truth = read_truth(arguments.truth)
    gravity = np.array([0, 9.81, 0]) if arguments.down == "y" else np.array([0, 0, -9.81])
    errors = {"velocity": [], "tilt": [], "biases": []}
    nees = {"velocity": [], "tilt": [], "biases": []}
    for row in csv.DictReader(open(arguments.inertial)):
        if row["phase"] != "running":
            continue
        seconds, fraction = row["stamp_s"].split(".")
        i = np.argmin(np.abs(stamps - int(seconds + fraction)))
        v = velocity(stamps, truth, i)
        if v is None or abs(stamps[i] - int(seconds + fraction)) > 3_000_000:
            continue
        fields = [float(x) for x in list(row.values())[2:]]
        P = np.zeros((12, 12))
        P[np.triu_indices(12)] = fields[12:]
        P = P + np.triu(P, 1).T
        R = rotation(truth[i, 3:7])
        e = np.array(fields[:3]) - R.T @ v
        errors["velocity"].append(e)
        nees["velocity"].append(e @ np.linalg.solve(P[:3, :3], e))
        e = np.array(fields[3:6]) - R.T @ gravity
        errors["tilt"].append(np.degrees(e / 9.81))
        nees["tilt"].append(e @ np.linalg.pinv(P[3:6, 3:6], rcond=1e-3) @ e)
        if truth.shape[1] >= 16:
            e = np.array(fields[6:12]) - truth[i, 10:16]
            errors["biases"].append(e)
            nees["biases"].append(e @ np.linalg.solve(P[6:, 6:], e))
    for name, dof, unit in (("velocity", 3, "m/s"), ("tilt", 2, "degrees"), ("biases", 6, "rad/s, m/s^2")):
        if errors[name]:
            print_score(name, errors[name], nees[name], dof, unit)


if __name__ == "__main__":
    main()
