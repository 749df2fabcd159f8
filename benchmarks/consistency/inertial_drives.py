#!/usr/bin/env python3
"""The steps of inertial_drives.sh besides rendering and running.

inertial_drives.py misalign MAV0 SEED            turns and moves the IMU of odd seeds; writes true_imu.csv, the truth of the point
                                                 and the axes that the calibration takes for the IMU
inertial_drives.py remove MAV0                   removes the images of a second
inertial_drives.py flight CSV SEED FRAMES OUT    a part of a ground truth of EuRoC as a path for `simulate --trajectory`
inertial_drives.py street POSES SEED FRAMES OUT  a part of the path of a KITTI pose file of 10 Hz, at 20 Hz
inertial_drives.py head | row FOLDER             the table
inertial_drives.py summary OUT                   means of what is below OUT, by the kind of case
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


def street(file, seed, frames, out):
    poses = np.loadtxt(file).reshape(-1, 3, 4)
    count = int(frames) // 2 + 3
    begin = (int(seed) * 237) % (len(poses) - count)
    poses = poses[begin : begin + count]
    between = (-poses[:-3] + 9 * poses[1:-2] + 9 * poses[2:-1] - poses[3:]) / 16  # cubic interpolation
    path = np.stack([poses[1:-2], between], axis=1).reshape(-1, 3, 4)[: int(frames)]
    u, _, vt = np.linalg.svd(path[:, :, :3])
    rotations, positions = u @ vt, path[:, :, 3]
    with open(out, "w") as stream:
        for R, p in zip(rotations, positions):
            T = np.hstack([rotations[0].T @ R, (rotations[0].T @ (p - positions[0]))[:, None]])
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


HEAD = """| case | delay, ms: true, found +- sigma (NEES) | turn, degrees: true, left | ATE without, with, mm | velocity, mm/s (NEES, inside) | tilt, degrees (NEES, inside) | biases, NEES (inside) | inside over 1, 10, 100 frames: without; with | a second without images, mm: without, with | LOST |
|---|---|---|---|---|---|---|---|---|---|"""
SUMMARY_HEAD = """| kind | cases | ATE with / without: mean, worst; above 1.05 | velocity: NEES, inside | tilt: NEES, inside | biases: NEES, inside | poses over 1, 10, 100 frames, without: NEES, inside | with: NEES, inside | a second without images, mm: median, worst | LOST |
|---|---|---|---|---|---|---|---|---|---|"""


def json_of(file):
    return json.load(open(file)) if file.exists() else {}


def inside_of(folder, name):
    """(NEES, share inside) over 1, 10 and 100 frames."""
    scores = json_of(folder / f"{name}_score.json").get("nees", {}).get("relative_nees", [])
    return np.array([(s["mean"], 100 * s["share_inside_95"]) if s["count"] else (np.nan, np.nan) for s in scores[:3]]).reshape(-1, 2)


def measures(folder):
    """What the table has of a case."""
    _, body = read_rows(folder / "images/mav0/state_groundtruth_estimate0/data.csv")
    positions = {name: trajectory(folder / name / "trajectory_tum.txt")[:, 1:4] for name in ("alone", "imu")}
    online = {name: trajectory(folder / name / "trajectory_online.txt")[:, 1:] for name in ("gap_alone", "gap_imu")}
    inertial = json_of(folder / "inertial.json").get("inertial")
    def part(name):
        scores = inertial[name] if inertial else {}
        return np.array([scores.get(key, np.nan) for key in ("rms", "mean_nees", "share_inside_95")]) * (1, 1, 100)
    return {"ate_mm": [1e3 * aligned_error(body[:, :3], positions[name]) for name in ("alone", "imu")],
            "gap_mm": [1e3 * bridged_error(body, online[name]) for name in ("gap_alone", "gap_imu")],
            "lost": [json_of(folder / f"{name}.json")["frames_lost"] for name in ("gap_alone", "gap_imu")],
            "velocity": part("velocity_m_s") * (1e3, 1, 1), "tilt": part("tilt_rad") * (np.degrees(1), 1, 1),
            "biases": part("biases"), "delay_nees": inertial["delay_s"]["mean_nees"] if inertial else np.nan,
            "inside": [inside_of(folder, name) for name in ("alone", "imu")]}


def row(folder):
    folder = pathlib.Path(folder)
    seed = int(folder.name.split("-")[-1])
    m = measures(folder)
    imu = json_of(folder / "imu.json")["imu"]
    wrong = seed % 2 == 1
    axis = np.random.default_rng(seed).normal(size=3)
    true_turn = -np.radians(TURN_DEG) * wrong * axis / np.linalg.norm(axis)
    left_deg = np.degrees(np.linalg.norm(np.array(imu["turn_rad"]) - true_turn))
    state = "" if imu["phase"] == "running" else f" ({imu['phase']})"
    shares = "; ".join(", ".join(f"{x:.0f}" for x in inside[:, 1]) for inside in m["inside"])
    v, tilt, biases = m["velocity"], m["tilt"], m["biases"]
    print(f"| {folder.name}{state} | {[-20, 0, 20, -10, 10][seed % 5]}, {imu['delay_ms']:.2f} +- {imu['delay_sigma_ms']:.2f} ({m['delay_nees']:.1f}) "
          f"| {TURN_DEG * wrong:.0f}, {left_deg:.2f} | {m['ate_mm'][0]:.1f}, {m['ate_mm'][1]:.1f} | {v[0]:.1f} ({v[1]:.1f}, {v[2]:.0f} %) "
          f"| {tilt[0]:.2f} ({tilt[1]:.1f}, {tilt[2]:.0f} %) | {biases[1]:.1f} ({biases[2]:.0f} %) | {shares} "
          f"| {m['gap_mm'][0]:.0f}, {m['gap_mm'][1]:.1f} | {m['lost'][0]}, {m['lost'][1]} |", flush=True)


def summary(out):
    """Means over the cases of each kind."""
    folders = [folder for folder in pathlib.Path(out).iterdir() if (folder / "inertial.json").exists()]
    print("\n" + SUMMARY_HEAD)
    for kind in sorted({folder.name.split("-")[0] for folder in folders}):
        cases = [measures(folder) for folder in folders if folder.name.split("-")[0] == kind]
        ratios = np.array([m["ate_mm"][1] / m["ate_mm"][0] for m in cases])
        gaps = [m["gap_mm"][1] for m in cases]
        def part(name):
            _, nees, inside = np.nanmean([m[name] for m in cases], axis=0)
            return f"{nees:.1f}, {inside:.0f} %"
        def poses(which):
            means = np.nanmean([m["inside"][which] for m in cases], axis=0)
            return ", ".join(f"{nees:.1f}" for nees, _ in means) + "; " + ", ".join(f"{inside:.0f}" for _, inside in means) + " %"
        print(f"| {kind} | {len(cases)} | {np.exp(np.log(ratios).mean()):.2f}, {ratios.max():.2f}; {(ratios > 1.05).sum()} | {part('velocity')} | {part('tilt')} | {part('biases')} "
              f"| {poses(0)} | {poses(1)} | {np.median(gaps):.0f}, {max(gaps):.0f} | {sum(m['lost'][0] for m in cases)}, {sum(m['lost'][1] for m in cases)} |")


def main():
    command, *arguments = sys.argv[1:]
    if command == "misalign":
        misalign(arguments[0], int(arguments[1]))
    elif command == "remove":
        remove(arguments[0])
    elif command == "flight":
        flight(*arguments)
    elif command == "street":
        street(*arguments)
    elif command == "summary":
        summary(*arguments)
    elif command == "head":
        print(HEAD, flush=True)
    else:
        row(arguments[0])


if __name__ == "__main__":
    main()
