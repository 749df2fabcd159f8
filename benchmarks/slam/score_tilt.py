#!/usr/bin/env python3
"""Compares roll and pitch of a run, relative to its first frame, with a ground truth in EuRoC's layout.

    score_tilt.py OUT mav0/state_groundtruth_estimate0/data.csv [--down y|z]

OUT is the folder of `stereo_slam run --pose-frame body`. Prints for each quarter of the path the root mean square of the error of
the vertical and its standard deviation as reported, in degrees, then the NEES (2 expected) and the share of the frames inside the
95 % bound. --down is the axis of the world that gravity is along: -z (EuRoC), or y (rendered)."""
import argparse
import csv
import pathlib
import numpy as np

from score_inertial import read_truth, rotation


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def stamp_ns(text):
    seconds, fraction = text.split(".")
    return int(seconds) * 1_000_000_000 + int((fraction + 9 * "0")[:9])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("truth")
    parser.add_argument("--down", choices=["y", "z"], default="z")
    arguments = parser.parse_args()
    stamps, truth = read_truth(arguments.truth)
    down = np.array([0, 1.0, 0]) if arguments.down == "y" else np.array([0, 0, -1.0])
    poses = [line.split() for line in open(arguments.out / "trajectory_tum.txt") if not line.startswith("#")]
    errors, sigmas, nees, first = [], [], [], None
    for pose, row in zip(poses, csv.reader(open(arguments.out / "covariances.csv").readlines()[1:])):
        i = np.argmin(np.abs(stamps - stamp_ns(pose[0])))
        if abs(stamps[i] - stamp_ns(pose[0])) > 3_000_000:
            continue
        R_true, R = rotation(truth[i, 3:7]), rotation(np.array([float(pose[k]) for k in (7, 4, 5, 6)]))
        first = first or (R_true.T @ down, R)  # the vertical in the axes of the first frame, and these in the world of the run
        u_true, u = R_true.T @ down, R.T @ first[1] @ first[0]
        a = np.cross(u_true, [1.0, 0.3, 0.2])
        across = np.array([a, np.cross(u_true, a)]) / np.linalg.norm(a)
        P = np.zeros((6, 6))
        P[np.triu_indices(6)] = [float(x) for x in row[2:23]]
        P = across @ skew(u_true) @ (P + np.triu(P, 1).T)[:3, :3] @ (across @ skew(u_true)).T
        e = across @ (u - u_true)
        errors.append(e @ e)
        sigmas.append(np.trace(P))
        if len(errors) > 10:  # the first pose is certain
            nees.append(e @ np.linalg.solve(P, e))
    quarters = [slice(k * len(errors) // 4, (k + 1) * len(errors) // 4) for k in range(4)]
    def rms(squares):
        return ", ".join(f"{np.degrees(np.sqrt(np.mean(squares[quarter]))):.3f}" for quarter in quarters)
    print(f"error {rms(errors)} degrees, sigma {rms(sigmas)} degrees, NEES {np.mean(nees):.2f}, "
          f"inside {100 * np.mean(np.array(nees) < 5.991):.0f} %")


if __name__ == "__main__":
    main()
