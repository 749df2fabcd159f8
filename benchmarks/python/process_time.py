"""The same as process_time.cpp, by the module stereo_slam: process_time.py RECORDING FX FY CX CY BASELINE_M."""
import pathlib
import sys
import time

import matplotlib.image
import numpy as np
import stereo_slam

folder = pathlib.Path(sys.argv[1])
pairs = [[np.round(255 * matplotlib.image.imread(folder / camera / file.name)).astype(np.uint8) for camera in ("image_0", "image_1")]
         for file in sorted((folder / "image_0").glob("*.png"))]
slam = stereo_slam.StereoSlam(tuple(map(float, sys.argv[2:7])))
for i, (left, right) in enumerate(pairs):
    begin, cpu_begin = time.perf_counter(), time.process_time()
    frame = slam.process(left, right, i * 100_000_000)
    T, P = frame.T_world_camera, frame.covariance
    wall_ms, cpu_ms = 1e3 * (time.perf_counter() - begin), 1e3 * (time.process_time() - cpu_begin)
    print(f"{T[2, 3]:.9f} {P[5, 5]:.9e} {wall_ms:.4f} {cpu_ms:.4f}")
