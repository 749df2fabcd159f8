#!/usr/bin/env python3
"""Writes camera paths for drone.sh, as KITTI pose files, from the ground truth of EuRoC V1_02_medium.

drone.py GROUND_TRUTH.csv OUT

OUT/flown.txt          20 poses per second
OUT/fast.txt           the same, with four times the translations
OUT/turns.txt          200 of these poses around the fastest turns, with twice the translations
"""
import csv
import pathlib
import sys

import numpy as np

from euroc_world import R_SIMULATOR_WORLD, rotation

ROWS_PER_POSE = 10  # 200 rows per second
FIRST_TURN = 7651
# From sensor.yaml of cam0.
T_BODY_CAMERA = np.array(
    [
        [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975],
        [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768],
        [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949],
        [0, 0, 0, 1],
    ]
)


def read_camera_poses(file):
    """T_world_camera of every row."""
    poses = []
    with open(file, newline="") as rows:
        for row in csv.reader(rows):
            if row[0].startswith("#"):
                continue
            values = np.array(row[1:8], dtype=float)
            pose = np.eye(4)
            pose[:3, :3] = rotation(*(values[3:] / np.linalg.norm(values[3:])))
            pose[:3, 3] = values[:3]
            poses.append(pose @ T_BODY_CAMERA)
    return np.array(poses)


def simulator_path(poses, translation_scale):
    """The poses relative to the first position, turned about the vertical so that the first one looks ahead."""
    path = poses.copy()
    path[:, :3, 3] *= translation_scale
    path[:, :3, :] = R_SIMULATOR_WORLD @ path[:, :3, :]
    path[:, :3, 3] -= path[0, :3, 3]
    ahead = path[0, :3, 2]
    yaw = np.arctan2(ahead[0], ahead[2])
    turn = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
    path[:, :3, :] = turn @ path[:, :3, :]
    return path


def write(file, path):
    np.savetxt(file, path[:, :3, :].reshape(-1, 12), fmt="%.9g")


def main():
    poses = read_camera_poses(sys.argv[1])
    out = pathlib.Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    write(out / "flown.txt", simulator_path(poses[::ROWS_PER_POSE], 1.0))
    write(out / "fast.txt", simulator_path(poses[::ROWS_PER_POSE], 4.0))
    turns = simulator_path(poses, 2.0)[FIRST_TURN::ROWS_PER_POSE][:200]
    write(out / "turns.txt", turns)


if __name__ == "__main__":
    main()
