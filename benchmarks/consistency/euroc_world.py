"""The world of EuRoC's ground truth, for paths of `simulate --trajectory`."""
import numpy as np

# EuRoC's world has z up; that of the simulator has x right, y down, z forward.
R_SIMULATOR_WORLD = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], dtype=float)


def rotation(w, x, y, z):
    """The rotation matrix of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
