"""Tests of the module stereo_slam; run.sh builds it and calls them.

The recording is a textured wall at 8 m that is passed sideways by 0.16 m a frame: 4 px at a focal length of 200 px.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np
import stereo_slam

CAMERA = (200.0, 200.0, 160.0, 60.0, 0.4)
WIDTH, HEIGHT, DISPARITY, SHIFT, FRAMES = 320, 120, 10, 4, 12
PERIOD_NS = 100_000_000
PROGRAM = os.environ.get("STEREO_SLAM", "")


def blurred(image):
    """Three box filters of 3 x 3 pixels, as nature has no white noise."""
    for _ in range(3):
        image = sum(np.roll(np.roll(image, dy, 0), dx, 1) for dy in (-1, 0, 1) for dx in (-1, 0, 1)) / 9
    return image


def make_texture():
    noise = blurred(np.random.default_rng(7).uniform(size=(HEIGHT, WIDTH + DISPARITY + SHIFT * FRAMES)))
    return np.round(255 * (noise - noise.min()) / np.ptp(noise)).astype(np.uint8)


TEXTURE = make_texture()


def pair(frame):
    """Views of the texture, whose rows are apart in memory."""
    left = SHIFT * frame
    return TEXTURE[:, left:left + WIDTH], TEXTURE[:, left + DISPARITY:left + DISPARITY + WIDTH]


def drive(slam, convert=lambda image: image, frames=FRAMES):
    results = [slam.process(*map(convert, pair(i)), i * PERIOD_NS) for i in range(frames)]
    slam.finish()
    return results


def write_images(folder, suffix, write):
    """Writes the images of all frames into folder/left and folder/right, each by write(path, image)."""
    for side in (0, 1):
        images = folder / ("left", "right")[side]
        images.mkdir()
        for i in range(FRAMES):
            write(images / f"{i:06}.{suffix}", pair(i)[side])


class ModuleTest(unittest.TestCase):
    def test_poses_have_the_motion_and_its_covariance(self):
        results = drive(stereo_slam.StereoSlam(CAMERA))
        self.assertEqual([frame.index for frame in results], list(range(FRAMES)))
        self.assertEqual({frame.status for frame in results[1:]}, {"OK"})
        self.assertEqual(results[-1].reasons, [])
        for i, frame in enumerate(results):
            P = frame.covariance
            self.assertEqual(P.shape, (6, 6))
            np.testing.assert_allclose(P, P.T, rtol=0, atol=1e-15)
            self.assertGreater(np.linalg.eigvalsh(P)[0], 0)
            np.testing.assert_allclose(frame.T_world_camera[3], [0, 0, 0, 1])
            error = frame.T_world_camera[:3, 3] - [0.16 * i, 0, 0]
            self.assertLess(np.linalg.norm(error), 4 * np.sqrt(np.trace(P[3:, 3:])) + 1e-3)
        np.testing.assert_allclose(results[-1].T_odometry_camera, results[-1].T_world_camera, atol=1e-9)

    def test_images_of_every_type_have_the_same_poses(self):
        expected = drive(stereo_slam.StereoSlam(CAMERA))[-1].T_world_camera
        for name, convert in {
            "copy": np.ascontiguousarray,
            "one channel": lambda image: image[:, :, None],
            "BGR": lambda image: np.repeat(image[:, :, None], 3, axis=2),
            "BGRA": lambda image: np.repeat(image[:, :, None], 4, axis=2),
        }.items():
            with self.subTest(name):
                np.testing.assert_array_equal(drive(stereo_slam.StereoSlam(CAMERA), convert)[-1].T_world_camera, expected)
        of_16_bits = drive(stereo_slam.StereoSlam(CAMERA), lambda image: 256 * image.astype(np.uint16))
        self.assertEqual(of_16_bits[-1].status, "OK")

    def test_an_array_may_be_read_only_and_used_again_at_once(self):
        slam, reused = stereo_slam.StereoSlam(CAMERA), stereo_slam.StereoSlam(CAMERA)
        for i in range(FRAMES):
            expected = slam.process(*pair(i), i * PERIOD_NS)
            left, right = (image.copy() for image in pair(i))
            left.setflags(write=False)
            frame = reused.process(left, right, i * PERIOD_NS)
            left.setflags(write=True)
            left[:] = right[:] = 0
            np.testing.assert_array_equal(frame.T_world_camera, expected.T_world_camera)

    def test_a_missing_right_image_is_none(self):
        slam = stereo_slam.StereoSlam(CAMERA)
        drive(slam)
        left, _ = pair(FRAMES)
        self.assertIn(slam.process(left, None, FRAMES * PERIOD_NS).status, ("OK", "WEAK"))

    def test_trajectory_and_map_are_arrays(self):
        slam = stereo_slam.StereoSlam(CAMERA)
        drive(slam)
        run = slam.trajectory()
        self.assertEqual(run["T_world_camera"].shape, (FRAMES, 4, 4))
        self.assertEqual(run["covariance"].shape, (FRAMES, 6, 6))
        self.assertEqual(run["stamp_ns"].tolist(), [i * PERIOD_NS for i in range(FRAMES)])
        self.assertEqual(len(run["status"]), FRAMES)
        np.testing.assert_allclose(run["T_world_camera"][-1][:3, 3], [0.16 * (FRAMES - 1), 0, 0], atol=0.02)
        self.assertLessEqual(len(slam.keyframes()["status"]), FRAMES)
        points = slam.map_points()
        self.assertEqual(points.shape[1], 3)
        self.assertAlmostEqual(float(np.median(points[:, 2])), 8.0, delta=0.2)

    def test_another_thread_may_ask_for_results_while_frames_are_processed(self):
        slam, done, counts = stereo_slam.StereoSlam(CAMERA), threading.Event(), []

        def read():
            while not done.is_set():
                counts.append(len(slam.trajectory()["stamp_ns"]))
                slam.map_points()

        reader = threading.Thread(target=read)
        reader.start()
        drive(slam)
        done.set()
        reader.join()
        self.assertEqual(counts, sorted(counts))
        self.assertLessEqual(counts[-1], FRAMES)

    def test_a_map_is_saved_and_loaded(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "wall.map"
            slam = stereo_slam.StereoSlam(CAMERA)
            drive(slam)
            slam.save_map(file)
            again = stereo_slam.StereoSlam(CAMERA, load_map=file)
            self.assertEqual(again.process(*pair(0), 0).index, 0)

    def test_wrong_input_is_an_error_with_its_value(self):
        left, right = pair(0)
        for image, message in [
            (left.astype(float), r"\(120, 320\) and the type float64, which is none of uint8 and uint16"),
            (left[:, ::-1], "whose pixels are not side by side; copy it by numpy.ascontiguousarray"),
            (left.T, "whose pixels are not side by side"),
            (left[0], "which is not rows x columns"),
            (np.repeat(left[:, :, None], 2, axis=2), r"\(120, 320, 2\)"),
            ("left.png", "is no numpy array, but str"),
            (None, "the left image is empty"),
            (left[:50], "the two images differ in size"),
        ]:
            with self.subTest(message):
                slam = stereo_slam.StereoSlam(CAMERA)
                slam.process(left, right, 0)
                with self.assertRaisesRegex(ValueError, message):
                    slam.process(image, right, PERIOD_NS)
        slam = stereo_slam.StereoSlam(CAMERA)
        slam.process(left, right, 5)
        with self.assertRaises(ValueError):
            slam.process(left, right, 5)
        with self.assertRaisesRegex(RuntimeError, "unknown setting features.wrong"):
            stereo_slam.StereoSlam(CAMERA, settings={"features.wrong": "1"})
        with self.assertRaisesRegex(RuntimeError, "nowhere.yaml"):
            stereo_slam.StereoSlam("nowhere.yaml")

    @unittest.skipUnless(os.access(PROGRAM, os.X_OK), "the program is not built")
    def test_the_program_has_the_same_poses(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_images(folder, "pgm", lambda path, image: path.write_bytes(
                f"P5 {WIDTH} {HEIGHT} 255\n".encode() + image.tobytes()))
            fx, fy, cx, cy, baseline = CAMERA
            (folder / "calibration.yaml").write_text(
                f"rectified: {{fx: {fx}, fy: {fy}, cx: {cx}, cy: {cy}, baseline_m: {baseline}}}\nframe_rate_hz: 10\n")
            subprocess.run([PROGRAM, "run", "--quiet", "--dataset", folder, "--output", folder / "out"], check=True)
            slam = stereo_slam.StereoSlam(folder / "calibration.yaml")
            drive(slam)
            run = slam.trajectory()
            kitti = np.loadtxt(folder / "out/trajectory_kitti.txt").reshape(-1, 3, 4)
            np.testing.assert_allclose(run["T_world_camera"][:, :3], kitti, rtol=1e-8, atol=1e-9)
            rows = (folder / "out/covariances.csv").read_text().splitlines()[1:]
            triangles = np.array([[float(x) for x in row.split(",")[2:23]] for row in rows])
            np.testing.assert_allclose(run["covariance"][(slice(None), *np.triu_indices(6))], triangles, rtol=1e-8, atol=1e-15)

    def test_the_documentation(self):
        text = (pathlib.Path(__file__).parents[2] / "docs/embedding.md").read_text()
        code = text[text.index("import antipode\nimport stereo_slam\n"):]
        code = code[:code.index("```")]
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                pathlib.Path("calibration.yaml").write_text(
                    "rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 0.4}\n")
                names = {"pairs": [(*pair(i), i * PERIOD_NS) for i in range(4)], "print": lambda *values: None, "numpy": np}
                exec(code, names)
                self.assertEqual(names["of_ros"].shape, (6, 6))
                self.assertEqual(names["lidar"].pose.matrix.shape, (4, 4))
                self.assertTrue(names["both"].converged)
                self.assertTrue(pathlib.Path("hall.map").exists())
            finally:
                os.chdir(before)

    def test_a_run_is_plotted(self):
        try:
            import matplotlib.image
        except ImportError:
            self.skipTest("matplotlib is not installed (Debian: python3-matplotlib)")
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_images(folder, "png", lambda path, image: matplotlib.image.imsave(
                path, image, cmap="gray", vmin=0, vmax=255))
            (folder / "calibration.yaml").write_text(
                "rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 0.4}\n")
            subprocess.run([sys.executable, os.environ["PLOT_RUN"], folder / "calibration.yaml", folder / "left",
                            folder / "right", folder / "run.png"], check=True, stdout=subprocess.DEVNULL)
            self.assertGreater((folder / "run.png").stat().st_size, 10_000)


if __name__ == "__main__":
    unittest.main()
