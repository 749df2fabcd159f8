#!/usr/bin/env python3
"""The steps of inertial_drives.sh besides rendering and running.

inertial_drives.py misalign MAV0 SEED            turns and moves the IMU of odd seeds; writes true_imu.csv, the truth of the point
                                                 and the axes that the calibration takes for the IMU
inertial_drives.py remove MAV0                   removes the images of a second
inertial_drives.py flight CSV SEED FRAMES OUT    a part of a ground truth of EuRoC as a path for `simulate --trajectory`
inertial_drives.py head | row FOLDER             the table
"""
import json
import pathlib
import sys

import numpy as np

from euroc_world import R_SIMULATOR_WORLD, rotation

FIRST_MISSING, MISSING = 60, 20  # frames: drives slow down and turn then
TURN_DEG, OFFSET_M = 2.0, 0.02


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rotation_about(axis, angle):
    K = skew(axis / np.linalg.norm(axis))
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def read_rows(file):
    """The stamps and numbers of a CSV of EuRoC."""
    rows = [line.strip().split(",") for line in open(file) if not line.startswith("#")]
    return [row[0] for row in rows], np.array([[float(x) for x in row[1:]] for row in rows])


def write_rows(file, stamps, numbers):
    with open(file, "w") as out:
        for stamp, row in zip(stamps, numbers):
            out.write(stamp + "," + ",".join(f"{x:.12g}" for x in row) + "\n")


def misalign(mav0, seed):
    mav0 = pathlib.Path(mav0)
    generator = np.random.default_rng(seed)
    wrong = seed % 2 == 1
    turn = rotation_about(generator.normal(size=3), np.radians(TURN_DEG)) if wrong else np.eye(3)
    offset = generator.normal(size=3)
    offset *= (OFFSET_M if wrong else 0.0) / np.linalg.norm(offset)
    stamps, readings = read_rows(mav0 / "imu0/data.csv")
    imu_s = np.array([1e-9 * float(stamp) for stamp in stamps])
    truth_stamps, truth = read_rows(mav0 / "state_groundtruth_estimate0/data.csv")
    # The sensor reads in axes that are turned, and is not where the calibration says.
    write_rows(mav0 / "imu0/data.csv", stamps, np.hstack([readings[:, :3] @ turn.T, readings[:, 3:6] @ turn.T]))
    description = (mav0 / "imu0/sensor.yaml").read_text()
    T = np.eye(4)
    T[:3, 3] = offset
    numbers = ", ".join(f"{x:.12g}" for x in T.ravel())
    (mav0 / "imu0/sensor.yaml").write_text(
        "\n".join(f"  data: [{numbers}]" if line.startswith("  data:") else line for line in description.split("\n"))
    )
    moved = truth.copy()
    for i, stamp in enumerate(truth_stamps):
        R = rotation(*truth[i, 3:7])
        rate = readings[np.argmin(np.abs(imu_s - 1e-9 * float(stamp))), :3] - truth[i, 10:13]
        moved[i, :3] += R @ offset
        moved[i, 7:10] += R @ np.cross(rate, offset)
    write_rows(mav0 / "true_imu.csv", truth_stamps, moved)


def remove(mav0):
    for camera in ("cam0", "cam1"):
        names = sorted((pathlib.Path(mav0) / camera / "data").glob("*.png"))
        for name in names[FIRST_MISSING : FIRST_MISSING + MISSING]:
            name.unlink()


def flight(file, seed, frames, out):
    rows_per_frame = 10  # 200 rows per second
    _, truth = read_rows(file)
    moving = len(truth) - int(frames) * rows_per_frame - 2000
    begin = 4000 + (int(seed) * 1237) % max(moving - 4000, 1)  # after the start
    T_body_camera = np.array([[0.0149, -0.9999, 0.0041], [0.9996, 0.0150, 0.0257], [-0.0258, 0.0038, 0.9997]])
    poses = []
    for row in truth[begin : begin + int(frames) * rows_per_frame : rows_per_frame]:
        R = R_SIMULATOR_WORLD @ rotation(*row[3:7]) @ T_body_camera
        u, _, vt = np.linalg.svd(R)
        poses.append((u @ vt, R_SIMULATOR_WORLD @ row[:3]))
    ahead = poses[0][0][:, 2]
    heading = rotation_about(np.array([0.0, 1.0, 0.0]), -np.arctan2(ahead[0], ahead[2]))
    with open(out, "w") as stream:
        for R, p in poses:
            T = np.hstack([heading @ R, (heading @ (p - poses[0][1]))[:, None]])
            stream.write(" ".join(f"{x:.9g}" for x in T.ravel()) + "\n")


def trajectory(file):
    return np.array([[float(x) for x in line.split()] for line in open(file)])


def aligned_error(truth, estimate):
    """ATE: root mean square of the positions after alignment."""
    a, b = truth - truth.mean(0), estimate - estimate.mean(0)
    u, _, vt = np.linalg.svd(b.T @ a)
    R = (u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt).T
    return np.sqrt(((a - b @ R.T) ** 2).sum(1).mean())


def bridged_error(truth, estimate):
    """The error of the position after the missing images, relative to the last frame before them."""
    before, after = FIRST_MISSING - 1, FIRST_MISSING + MISSING - 1
    def motion(poses, quaternion):
        R = rotation(*quaternion(poses[before]))
        return R.T @ (poses[after, :3] - poses[before, :3])
    return np.linalg.norm(motion(truth, lambda row: row[3:7]) - motion(estimate, lambda row: row[[6, 3, 4, 5]]))


HEAD = """| case | delay, ms: true, found +- sigma (NEES) | turn, degrees: true, left | ATE without, with, mm | velocity, mm/s (NEES, inside) | tilt, degrees (NEES) | biases, NEES | inside over 1, 10, 100 frames | a second without images, mm: without, with | LOST |
|---|---|---|---|---|---|---|---|---|---|"""


def row(folder):
    folder = pathlib.Path(folder)
    mav0 = folder / "images/mav0"
    seed = int(folder.name.split("-")[-1])
    _, body = read_rows(mav0 / "state_groundtruth_estimate0/data.csv")
    runs = {name: json.load(open(folder / f"{name}.json")) for name in ("alone", "imu", "gap_alone", "gap_imu")}
    paths = {name: trajectory(folder / name / "trajectory_tum.txt")[:, 1:] for name in runs}
    imu = runs["imu"]["imu"]
    wrong = seed % 2 == 1
    generator = np.random.default_rng(seed)
    true_turn = -np.radians(TURN_DEG) * (lambda axis: axis / np.linalg.norm(axis))(generator.normal(size=3)) * wrong
    left_deg = np.degrees(np.linalg.norm(np.array(imu["turn_rad"]) - true_turn))
    ate = [1e3 * aligned_error(body[:, :3], paths[name][:, :3]) for name in ("alone", "imu")]
    online = [trajectory(folder / name / "trajectory_online.txt")[:, 1:] for name in ("gap_alone", "gap_imu")]
    gap = [1e3 * bridged_error(body, path) for path in online]
    lost = f"{runs['gap_alone']['frames_lost']}, {runs['gap_imu']['frames_lost']}"
    state = "" if imu["phase"] == "running" else f" ({imu['phase']})"
    score, inertial_score = [json.load(open(file)) if file.exists() else {} for file in (folder / "score.json", folder / "inertial.json")]
    inertial, inside = inertial_score.get("inertial"), score.get("nees", {}).get("relative_nees", [])
    shares = ", ".join(f"{100 * s['share_inside_95']:.0f}" if s["count"] else "-" for s in inside)
    parts, delay_nees = ["-", "-", "-"], "-"
    if inertial:
        v, tilt, biases = inertial["velocity_m_s"], inertial["tilt_rad"], inertial["biases"]
        delay_nees = f"{inertial['delay_s']['mean_nees']:.1f}"
        parts = [f"{1e3 * v['rms']:.1f} ({v['mean_nees']:.1f}, {100 * v['share_inside_95']:.0f} %)",
                 f"{np.degrees(tilt['rms']):.2f} ({tilt['mean_nees']:.1f})", f"{biases['mean_nees']:.1f}"]
    print(f"| {folder.name}{state} | {[-20, 0, 20, -10, 10][seed % 5]}, {imu['delay_ms']:.2f} +- {imu['delay_sigma_ms']:.2f} ({delay_nees}) | {TURN_DEG * wrong:.0f}, {left_deg:.2f} | "
          f"{ate[0]:.1f}, {ate[1]:.1f} | {parts[0]} | {parts[1]} | {parts[2]} | {shares} | {gap[0]:.0f}, {gap[1]:.1f} | {lost} |", flush=True)


def main():
    command, *arguments = sys.argv[1:]
    if command == "misalign":
        misalign(arguments[0], int(arguments[1]))
    elif command == "remove":
        remove(arguments[0])
    elif command == "flight":
        flight(*arguments)
    elif command == "head":
        print(HEAD, flush=True)
    else:
        row(arguments[0])


if __name__ == "__main__":
    main()
