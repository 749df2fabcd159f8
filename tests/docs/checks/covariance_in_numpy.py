
# The recipe finds what evaluate finds.
import json, subprocess
subprocess.run("stereo_slam evaluate --groundtruth DIR/poses.txt --estimate OUT/trajectory_kitti.txt --covariances OUT/covariances.csv "
               "--truth-sigma-m 0.03 --truth-sigma-deg 0.1 --json scores.json", shell=True, check=True)
over_ten = next(entry for entry in json.load(open("scores.json"))["nees"]["relative_nees"] if entry["frames"] == 10)
assert over_ten["count"] == len(nees) > 0, (over_ten, len(nees))
assert abs(over_ten["mean"] - np.mean(nees)) < 1e-4 * over_ten["mean"], (over_ten, np.mean(nees))
# log inverts exp, which the power series of the matrix is, for small and large turns.
for phi in ([0.0, 0.0, 0.0], [1e-6, 2e-6, 0.0], [0.3, -0.2, 0.1], [1.5, -2.0, 0.5]):
    xi = np.concatenate([phi, [1.0, -2.0, 0.5]])
    X = np.zeros((4, 4))
    X[:3, :3], X[:3, 3] = skew(phi), xi[3:]
    T, term = np.eye(4), np.eye(4)
    for n in range(1, 60):
        term = term @ X / n
        T = T + term
    assert np.allclose(log(T), xi, atol=1e-9), (phi, log(T), xi)
