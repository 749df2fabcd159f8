#!/usr/bin/env python3
"""Runs the SLAM on two folders of images and plots the path with the 95 % ellipses of its positions.

    plot_run.py CALIBRATION LEFT_FOLDER RIGHT_FOLDER OUTPUT.png [FRAMES_PER_SECOND]

Needs matplotlib, which reads images as well, and the module stereo_slam in PYTHONPATH.
"""
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import stereo_slam


def read(file):
    """The image as uint8, grey or BGR; matplotlib gives RGB, and PNG files from 0 to 1."""
    image = plt.imread(file)
    if image.dtype != np.uint8:
        image = np.round(255 * image).astype(np.uint8)
    return image if image.ndim == 2 else np.ascontiguousarray(image[:, :, 2::-1])


def ellipse(T_world_camera, covariance):
    """Points on the 95 % ellipse of the position, seen from above: x to the right, z forward."""
    R = T_world_camera[:3, :3]
    P = (R @ covariance[3:, 3:] @ R.T)[np.ix_([0, 2], [0, 2])]
    angles = np.linspace(0, 2 * np.pi, 50)
    circle = np.sqrt(5.99) * np.vstack([np.cos(angles), np.sin(angles)])  # 95 % of chi squared with 2 degrees of freedom
    values, vectors = np.linalg.eigh(P)
    return T_world_camera[[0, 2], 3][:, None] + vectors @ (np.sqrt(np.maximum(values, 0))[:, None] * circle)


def main(calibration, left, right, output, frames_per_second="10"):
    slam = stereo_slam.StereoSlam(calibration)
    period_ns = round(1e9 / float(frames_per_second))
    pairs = zip(sorted(pathlib.Path(left).iterdir()), sorted(pathlib.Path(right).iterdir()))
    for i, (left_file, right_file) in enumerate(pairs):
        frame = slam.process(read(left_file), read(right_file), i * period_ns)
        print(frame.index, frame.status, *frame.reasons, np.round(frame.T_world_camera[:3, 3], 3))
    slam.finish()
    run = slam.trajectory()
    poses, covariances = run["T_world_camera"], run["covariance"]
    points = slam.map_points()
    plt.figure(figsize=(8, 8))
    plt.plot(points[:, 0], points[:, 2], ".", color="0.7", markersize=1)
    plt.plot(poses[:, 0, 3], poses[:, 2, 3], "b-")
    for i in range(0, len(poses), max(1, len(poses) // 20)):
        plt.plot(*ellipse(poses[i], covariances[i]), "r-", linewidth=0.8)
    plt.axis("equal")
    plt.xlabel("x [m]")
    plt.ylabel("z [m]")
    plt.savefig(output)


if __name__ == "__main__":
    if len(sys.argv) not in (5, 6):
        sys.exit(__doc__)
    main(*sys.argv[1:])
