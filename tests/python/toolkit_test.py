"""Tests of the module antipode; run.sh builds it and calls them. The expected values are computed with matrices in numpy."""
import unittest

import antipode
import numpy as np


def hat(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def expm(A):
    """The exponential of a small matrix by its series, scaled by 2^-10."""
    A, term, total = A / 1024, np.eye(len(A)), np.eye(len(A))
    for k in range(1, 20):
        term = term @ A / k
        total = total + term
    return np.linalg.matrix_power(total, 1024)


def motion(twist):
    A = np.zeros((4, 4))
    A[:3, :3], A[:3, 3] = hat(twist[:3]), twist[3:]
    return expm(A)


def adjoint(T):
    R, t = T[:3, :3], T[:3, 3]
    return np.block([[R, np.zeros((3, 3))], [hat(t) @ R, R]])


def swapped(P):
    order = [3, 4, 5, 0, 1, 2]
    return P[np.ix_(order, order)]


RANDOM = np.random.default_rng(5)
TWIST = np.array([0.3, -0.2, 0.9, 1.0, 2.0, -3.0])
OTHER = np.array([-0.5, 0.1, 0.2, 0.4, -1.0, 0.7])
T, S = motion(TWIST), motion(OTHER)


def covariance(scale=1e-4):
    A = RANDOM.normal(size=(6, 6))
    return scale * A @ A.T


def close(actual, expected, tolerance=1e-12):
    np.testing.assert_allclose(actual, expected, rtol=tolerance, atol=tolerance)


class PoseTest(unittest.TestCase):
    def test_poses_are_the_matrices_that_they_are_made_of(self):
        close(antipode.Pose().matrix, np.eye(4))
        close(antipode.Pose(T).matrix, T)
        close(antipode.Pose.exp(TWIST).matrix, T, 1e-11)  # the series squares its rounding errors ten times
        close(antipode.Pose.exp(TWIST).log(), TWIST)
        pose = antipode.Pose(T)
        close(antipode.Pose(pose.rotation, pose.translation).matrix, T)
        close((pose * antipode.Pose(S)).matrix, T @ S)
        close(pose.inverse().matrix, np.linalg.inv(T))
        close(pose.adjoint(), adjoint(T))
        self.assertIn("Pose(", repr(pose))

    def test_points_are_mapped_as_rows(self):
        points = RANDOM.normal(size=(7, 3))
        before = points.copy()
        close(antipode.Pose(T).map(points), points @ T[:3, :3].T + T[:3, 3])
        close(antipode.Pose(T).map(points[2]), T[:3, :3] @ points[2] + T[:3, 3])
        close(antipode.Pose(T).map(points[:, ::-1]), points[:, ::-1] @ T[:3, :3].T + T[:3, 3])
        np.testing.assert_array_equal(points, before)
        with self.assertRaisesRegex(ValueError, "n x 3"):
            antipode.Pose(T).map(np.zeros((3, 4)))

    def test_what_is_no_pose_is_an_error_with_its_value(self):
        stretched = T.copy()
        stretched[0, 0] += 0.1
        with self.assertRaisesRegex(ValueError, "rotation"):
            antipode.Pose(stretched)
        with self.assertRaisesRegex(ValueError, "rotation"):
            antipode.PoseGaussian(stretched, np.eye(6))
        with self.assertRaisesRegex(ValueError, "rotation"):
            antipode.Pose(T) * stretched
        projective = T.copy()
        projective[3, 0] = 1
        with self.assertRaisesRegex(ValueError, "last row"):
            antipode.Pose(projective)
        not_finite = T.copy()
        not_finite[0, 3] = np.nan
        with self.assertRaisesRegex(ValueError, "not finite"):
            antipode.Pose(not_finite)
        with self.assertRaises(ValueError):
            antipode.Pose([2, 0, 0, 0], [0, 0, 0])
        for wrong in (np.zeros((3, 3)), "T", None):
            with self.assertRaises(TypeError):
                antipode.PoseGaussian(wrong, np.eye(6))


class DensityTest(unittest.TestCase):
    def test_matrices_are_taken_as_poses(self):
        P = covariance()
        x = antipode.PoseGaussian(T, P)
        close(x.pose.matrix, T)
        np.testing.assert_array_equal(x.covariance, P)
        np.testing.assert_array_equal(antipode.PoseGaussian().covariance, np.zeros((6, 6)))

    def test_products_have_the_covariance_of_first_order_when_errors_are_small(self):
        P, Q, C = covariance(1e-10), covariance(1e-10), np.zeros((6, 6))
        x, y = antipode.PoseGaussian(T, P), antipode.PoseGaussian(S, Q)
        A = adjoint(np.linalg.inv(S))
        xy = antipode.compose(x, y)
        close(xy.pose.matrix, T @ S, 1e-8)
        close(xy.covariance / 1e-10, (A @ P @ A.T + Q) / 1e-10, 1e-6)
        C[:] = 0.3 * np.sqrt(np.outer(np.diag(P), np.diag(Q))) * np.eye(6)
        correlated = A @ P @ A.T + Q + A @ C + (A @ C).T
        close(antipode.compose(x, y, cross=C).covariance / 1e-10, correlated / 1e-10, 1e-6)
        back = antipode.inverse(x)
        close(back.pose.matrix, np.linalg.inv(T))
        close(back.covariance / 1e-10, adjoint(T) @ P @ adjoint(T).T / 1e-10, 1e-9)

    def test_a_relative_pose_undoes_a_product(self):
        x, y = antipode.PoseGaussian(T, np.zeros((6, 6))), antipode.PoseGaussian(S, covariance())
        z = antipode.relative_pose(x, antipode.compose(x, y))
        close(z.pose.matrix, S)
        close(z.covariance, y.covariance)
        P = covariance()
        same = antipode.relative_pose(antipode.PoseGaussian(T, P), antipode.PoseGaussian(T, P), cross=P)
        close(same.covariance, np.zeros((6, 6)), 1e-15)

    def test_fusion_adds_the_information_of_both(self):
        P, Q = covariance(1e-8), covariance(1e-8)
        xi = 1e-5 * RANDOM.normal(size=6)
        fused = antipode.fuse(antipode.PoseGaussian(T, P), antipode.PoseGaussian(T @ motion(xi), Q))
        self.assertTrue(fused.converged)
        expected = np.linalg.inv(np.linalg.inv(P) + np.linalg.inv(Q))
        close(fused.density.covariance / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-3)
        distance = xi @ np.linalg.solve(P + Q, xi)
        self.assertAlmostEqual(fused.mahalanobis_squared / distance, 1, delta=1e-3)
        step = np.asarray(antipode.Pose(T).inverse().matrix @ fused.density.pose.matrix)
        close((antipode.Pose(step).log() - P @ np.linalg.solve(P + Q, xi)) / 1e-5, np.zeros(6), 1e-3)

    def test_draws_have_the_covariance(self):
        count = 4000
        x = antipode.PoseGaussian(T, covariance())
        draws = antipode.sample(x, count, seed=3)
        self.assertEqual(draws.shape, (count, 4, 4))
        np.testing.assert_array_equal(draws, antipode.sample(x, count, seed=3))
        nees = [antipode.mahalanobis_squared(x, draw) for draw in draws]
        self.assertAlmostEqual(np.mean(nees), 6, delta=5 * np.sqrt(12 / count))  # the variance of chi-square is 2 n

    def test_covariances_that_cannot_be_are_errors(self):
        lopsided = covariance()
        lopsided[0, 1] += 1
        x = antipode.PoseGaussian(T, lopsided)
        for function in (antipode.inverse, antipode.to_ros_covariance, lambda x: antipode.fuse(x, x)):
            with self.assertRaisesRegex(ValueError, "not symmetric"):
                function(x)
        with self.assertRaisesRegex(ValueError, "negative eigenvalue"):
            antipode.to_sophus_covariance(antipode.PoseGaussian(T, -np.eye(6)))
        with self.assertRaisesRegex(ValueError, "singular"):
            antipode.mahalanobis_squared(antipode.PoseGaussian(T, np.zeros((6, 6))), T)


class ConventionsTest(unittest.TestCase):
    def test_covariances_of_other_libraries(self):
        P = covariance()
        x = antipode.PoseGaussian(T, P)
        turn = np.kron(np.eye(2), T[:3, :3])
        expected = {"gtsam": P, "sophus": swapped(P), "left": adjoint(T) @ P @ adjoint(T).T, "ros": swapped(turn @ P @ turn.T)}
        for name, matrix in expected.items():
            with self.subTest(name):
                written = getattr(antipode, f"to_{name}_covariance")(x)
                close(written, matrix)
                close(getattr(antipode, f"from_{name}_covariance")(T, written).covariance, P)

    def test_the_numbers_of_a_message_of_ros_are_rows(self):
        P = covariance()
        message = antipode.to_ros_covariance(antipode.PoseGaussian(T, P)).ravel().tolist()
        self.assertEqual(len(message), 36)
        close(antipode.from_ros_covariance(T, message).covariance, P)
        with self.assertRaisesRegex(ValueError, "has 35 numbers, not 36"):
            antipode.from_ros_covariance(T, message[:35])
        with self.assertRaisesRegex(ValueError, "unknown"):
            antipode.from_ros_covariance(T, [0.0] * 36)


if __name__ == "__main__":
    unittest.main()
