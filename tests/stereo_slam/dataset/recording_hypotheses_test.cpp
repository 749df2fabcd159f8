// SPDX-License-Identifier: MIT
#include <opencv2/imgproc.hpp>

#include "simulator/recording/simulate.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/dataset/rig_variants.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/dataset/uniform_borders.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kFrames = 12;

/// A rendered drive, raw or rectified.
struct Drive {
  TemporaryFolder folder;
  StereoSequence sequence;

  explicit Drive(bool raw) {
    simulator::SimulationSettings settings;
    settings.frames = kFrames;
    settings.samples_per_pixel = 4;
    settings.texture_size_px = 256;
    if (raw) {
      settings.rig = simulator::euroc_like_rig(Distortion::kRadTan, 0.5);
    } else {
      settings.camera = {496, 150, 287.5, 287.5, 242.9, 74.1};
    }
    simulator::simulate(settings, folder.path());
    sequence = open_sequence(folder.path(), "auto");
  }
};

/// What is said of a recording.
std::string text_of_problems(const StereoSequence& sequence) {
  std::vector<StereoFrame> frames;
  for (const std::size_t i : spread(sequence.frames.size(), 5)) frames.push_back(load_frame(sequence, i));
  std::string text;
  for (const auto& problem : problems_of(check_stereo_agreement(frames), sequence, frames))
    text += problem.text + "\n";
  return text;
}

/// The recording with the right images of later frames (or the left ones, if negative).
StereoSequence delayed(const StereoSequence& sequence, int frames) {
  StereoSequence result = sequence;
  const auto count = static_cast<std::size_t>(std::abs(frames));
  result.frames.resize(sequence.frames.size() - count);
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    if (frames > 0)
      result.frames[i].right = sequence.frames[i + count].right;
    else
      result.frames[i].left = sequence.frames[i + count].left;
  }
  return result;
}

/// The recording with flipped images of one camera (code of cv::flip).
StereoSequence flipped(const StereoSequence& sequence, bool left, int code, const fs::path& folder) {
  StereoSequence result = sequence;
  fs::create_directories(folder);
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    auto& file = left ? result.frames[i].left : result.frames[i].right;
    cv::Mat image;
    cv::flip(cv::imread(file.string(), cv::IMREAD_GRAYSCALE), image, code);
    file = folder / frame_name(static_cast<int>(i));
    cv::imwrite(file.string(), image);
  }
  return result;
}

/// The recording with another calibration. A rig that is refused leaves it without a rectifier.
SequenceScan with_rig(const StereoSequence& sequence, const StereoRig& rig) {
  SequenceScan scan{.sequence = sequence, .problems = {}};
  scan.sequence.rectifier = nullptr;
  scan.sequence.camera = {};
  attempt(scan.problems, Problem::Severity::kError, [&] { set_rig(scan.sequence, rig); });
  check_rig(scan);
  return scan;
}

void swap_images(StereoSequence& sequence) {
  for (auto& files : sequence.frames) std::swap(files.left, files.right);
}

}  // namespace

TEST_CASE("Images of another frame are named with the number of frames, raw or rectified", "[hypotheses]") {
  for (const bool raw : {true, false}) {
    const Drive drive(raw);
    CHECK(text_of_problems(drive.sequence).empty());
    const std::string right = drive.sequence.right_name;
    const std::string left = drive.sequence.left_name;
    const auto delays = raw ? std::vector{std::pair(1, "1 frame early"), std::pair(-3, "3 frames late")}
                            : std::vector{std::pair(-1, "1 frame late"), std::pair(3, "3 frames early")};
    for (const auto& [frames, expected] : delays) {
      CAPTURE(raw, frames);
      const auto text = text_of_problems(delayed(drive.sequence, frames));
      CHECK_THAT(text, Catch::Contains(fmt::format("the images of {} look {}", right, expected)) &&
                           !Catch::Contains("swapped"));
      CHECK_THAT(text, Catch::Contains(fmt::format("of {}, or correct", frames > 0 ? left : right)));
    }
  }
}

TEST_CASE("The names of images that are a pair by name are to be corrected", "[hypotheses]") {
  const Drive drive(/*raw=*/false);
  StereoSequence named = delayed(drive.sequence, -1);
  const TemporaryFolder folder;
  for (auto& frame : named.frames) {
    const fs::path renamed = folder / frame.left.filename();
    fs::copy_file(frame.right, renamed);
    frame.right = renamed;
  }
  CHECK_THAT(text_of_problems(named),
             Catch::Contains("so correct the names or the stamps of image_1 by 1 frame"));
}

TEST_CASE("Cameras one above the other are named, and no delay that agrees by chance", "[hypotheses]") {
  const Drive drive(/*raw=*/false);
  for (const int code : {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_90_COUNTERCLOCKWISE}) {
    CAPTURE(code);
    StereoSequence turned = drive.sequence;
    std::swap(turned.camera.width_px, turned.camera.height_px);
    const TemporaryFolder folder;
    for (auto& frame : turned.frames) {
      for (auto* file : {&frame.left, &frame.right}) {
        cv::Mat image;
        cv::rotate(cv::imread(file->string(), cv::IMREAD_GRAYSCALE), image, code);
        *file = folder / (file->parent_path().filename().string() + file->filename().string());
        cv::imwrite(file->string(), image);
      }
    }
    const auto text = text_of_problems(turned);
    CHECK_THAT(text, Catch::Contains("displaced in column, as of cameras one above the other") &&
                         Catch::Contains(code == cv::ROTATE_90_CLOCKWISE ? "turn both anticlockwise"
                                                                         : "turn both clockwise") &&
                         !Catch::Contains("late") && !Catch::Contains("early"));
  }
}

TEST_CASE("Swapped images and images of one camera that are turned or mirrored are named", "[hypotheses]") {
  for (const bool raw : {true, false}) {
    const Drive drive(raw);
    StereoSequence swapped = drive.sequence;
    swap_images(swapped);
    CHECK_THAT(text_of_problems(swapped), Catch::Contains("look swapped"));
    for (const bool left : {true, false}) {
      CAPTURE(raw, left);
      const auto [code, how] =
          raw == left ? std::pair(-1, "turned by 180 degrees") : std::pair(1, "mirrored");
      const auto folder = drive.folder / fmt::format("flipped_{}", left);
      const auto text = text_of_problems(flipped(drive.sequence, left, code, folder));
      const auto& name = left ? drive.sequence.left_name : drive.sequence.right_name;
      CHECK_THAT(text, Catch::Contains(fmt::format("the images of {} look {}", name, how)) &&
                           !Catch::Contains("swapped"));
    }
  }
}

TEST_CASE("Mistakes in the calibration of raw cameras are named", "[hypotheses]") {
  const Drive drive(true);
  const StereoRig rig = *drive.sequence.rig;
  StereoRig transposed = rig;
  transposed.T_right_left.linear().transposeInPlace();
  CHECK_THAT(text_of_problems(with_rig(drive.sequence, transposed).sequence),
             Catch::Contains("rotation between the cameras looks transposed") && !Catch::Contains("swapped"));
  StereoRig exchanged = rig;
  std::swap(exchanged.left, exchanged.right);
  CHECK_THAT(text_of_problems(with_rig(drive.sequence, exchanged).sequence),
             Catch::Contains("lenses of the two cameras look exchanged") && !Catch::Contains("swapped"));
  StereoRig other = rig;
  other.T_right_left.linear() =
      Eigen::AngleAxisd(0.02, Eigen::Vector3d(1.0, 0.5, 1.0).normalized()) * rig.T_right_left.linear();
  CHECK_THAT(text_of_problems(with_rig(drive.sequence, other).sequence),
             Catch::Contains("the calibration does not fit these images") && !Catch::Contains("look"));
}

TEST_CASE("A rig with the right camera on the left is explained by the images", "[hypotheses]") {
  const Drive drive(true);
  const StereoRig rig = *drive.sequence.rig;
  const auto first = [](const SequenceScan& scan) {
    REQUIRE_FALSE(scan.problems.empty());
    CHECK(is_error(scan.problems.front()));
    return scan.problems.front().text;
  };
  StereoRig inverse = rig;
  inverse.T_right_left = rig.T_right_left.inverse();
  CHECK_THAT(
      first(with_rig(drive.sequence, inverse)),
      Catch::Contains("transformation between the cameras looks inverted") && !Catch::Contains("swapped"));
  StereoRig exchanged = inverse;
  std::swap(exchanged.left, exchanged.right);
  CHECK_THAT(first(with_rig(drive.sequence, exchanged)),
             Catch::Contains("the calibrations of the two cameras look exchanged"));
  StereoSequence swapped = drive.sequence;
  swap_images(swapped);
  CHECK_THAT(first(with_rig(swapped, exchanged)),
             Catch::Contains("look swapped, with the calibration of each"));
  StereoRig position = rig;
  position.T_right_left.translation() = rig.T_right_left.inverse().translation();
  CHECK_THAT(first(with_rig(drive.sequence, position)),
             Catch::Contains("looks like the position of the right"));
  StereoRig sensors = rig;
  const Eigen::Isometry3d T_body_right = *rig.T_body_left * rig.T_right_left.inverse();
  sensors.T_body_left = rig.T_body_left->inverse();
  sensors.T_right_left = T_body_right * rig.T_body_left->inverse();
  CHECK_THAT(first(with_rig(drive.sequence, sensors)),
             Catch::Contains("T_BS of both cameras looks inverted"));

  StereoSequence blank = drive.sequence;  // nothing is guessed
  for (auto& files : blank.frames) files.right = files.left;
  const auto scan = with_rig(blank, inverse);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text,
             Catch::Contains("to the left of the left one; exchange the two cameras, or"));
}

TEST_CASE("Raw images of EuRoC show by their rows a calibration of another size or focal length", "[data]") {
  const auto data = data_folder();
  if (!data) return;
  const StereoSequence sequence = open_sequence(*data / "euroc/MH_01_easy_first150", "euroc");
  CHECK(text_of_problems(sequence).empty());
  const auto text_with = [&](const StereoRig& rig) {
    return text_of_problems(with_rig(sequence, rig).sequence);
  };
  CHECK_THAT(text_with(with_focal_factor(*sequence.rig, 1.09)),
             Catch::Contains("% too long for these images"));
  CHECK_THAT(text_with(with_focal_factor(*sequence.rig, 0.9)),
             Catch::Contains("% too short for these images"));
  CHECK_THAT(text_with(with_size_factor(*sequence.rig, 0.889)),
             Catch::Contains("looks made for images of about 6"));
  StereoRig straight = *sequence.rig;
  for (auto* lens : {&straight.left, &straight.right}) lens->coefficients = {0.0, 0.0, 0.0, 0.0};
  CHECK_THAT(text_with(straight), Catch::Contains("look distorted, but the calibration has no distortion"));
  CHECK_THAT(text_with(with_opposite_distortion(*sequence.rig)),
             Catch::Contains("look to have the wrong sign") || Catch::Contains("check signs and order"));
  CHECK_THAT(text_with(with_other_lens_model(*sequence.rig)), Catch::Contains("those of the model radtan"));
  StereoRig wild = *sequence.rig;
  wild.left.coefficients.resize(5, 0.9);
  CHECK_THAT(text_with(wild), Catch::Contains("check signs and order of the coefficients"));
}

TEST_CASE("A displacement of the right image is no other size of the images", "[stereo_slam][dataset]") {
  const Drive drive(/*raw=*/true);
  StereoRig high = *drive.sequence.rig;
  high.right.cy -= 4.0;
  const auto text = text_of_problems(with_rig(drive.sequence, high).sequence);
  CHECK_THAT(text,
             Catch::Contains("the right images lie 4.") && Catch::Contains("than the calibration says"));
  CHECK_THAT(text, !Catch::Contains("images of about"));
}

TEST_CASE("Few wrong matches do not decide the sign of a far scene's disparities", "[stereo_slam][dataset]") {
  const Drive drive(/*raw=*/false);
  StereoFrame far = load_frame(drive.sequence, 0);
  far.right = far.left.clone();
  const cv::Matx23d by_half_a_pixel(1.0, 0.0, -0.4, 0.0, 1.0, 0.0);
  cv::warpAffine(far.left, far.right, by_half_a_pixel, far.left.size(), cv::INTER_LINEAR,
                 cv::BORDER_REPLICATE);
  const auto forwards = check_stereo_agreement({far});
  CHECK(forwards.median_disparity_px == Approx(0.4).margin(0.1));
  CHECK(forwards.negative_share == 0.0);
  std::swap(far.left, far.right);
  CHECK(check_stereo_agreement({far}).negative_share == 1.0);
}

TEST_CASE("Images that were scaled and padded are noticed by their borders", "[stereo_slam][dataset]") {
  const Drive drive(/*raw=*/false);
  std::vector<StereoFrame> frames;
  const auto padded = [](const cv::Mat& image, int border_px) {
    cv::Mat scaled, result;
    const cv::Size inside(image.cols - 2 * border_px, image.rows - 2 * border_px * image.rows / image.cols);
    cv::resize(image, scaled, inside, 0, 0, cv::INTER_AREA);
    const int rows_px = (image.rows - inside.height) / 2;
    cv::copyMakeBorder(scaled, result, rows_px, image.rows - inside.height - rows_px, border_px, border_px,
                       cv::BORDER_CONSTANT, 0);
    return result;
  };
  for (const int i : {0, 5, 10}) {
    StereoFrame frame = load_frame(drive.sequence, static_cast<std::size_t>(i));
    CHECK_FALSE(uniform_borders({frame}).pad(frame.left.cols, frame.left.rows));
    frame.left = padded(frame.left, 60);
    frame.right = padded(frame.right, 60);
    frames.push_back(frame);
  }
  frames.push_back(frames.back());
  frames.back().left = cv::Mat::zeros(frames.back().left.size(), CV_8U);  // a lost image
  const auto problems = problems_of(check_stereo_agreement(frames), drive.sequence, frames);
  REQUIRE(problems.size() == 1);
  CHECK_THAT(problems[0].text, Catch::Contains("left 60, right 60") && Catch::Contains("scaled to 376x"));
  CHECK_FALSE(uniform_borders({}).pad(100, 100));
}

TEST_CASE("Small disparities are those of a far scene, and none at all are those of one image",
          "[stereo_slam][dataset]") {
  const Drive drive(/*raw=*/false);
  const std::vector<StereoFrame> frames = {load_frame(drive.sequence, 0)};
  StereoAgreement agreement;
  agreement.left_features = agreement.right_features = 2000;
  agreement.matches = 500;
  const auto said_of = [&](double median_px, double near_px) {
    agreement.median_disparity_px = median_px;
    agreement.near_disparity_px = near_px;
    const auto problems = problems_of(agreement, drive.sequence, frames);
    return problems.empty() ? std::string() : problems.front().text;
  };
  CHECK_THAT(said_of(0.01, 0.03), Catch::Contains("image_0 and image_1 show the same image"));
  CHECK_THAT(said_of(0.75, 0.8),
             Catch::Contains("nine of ten points are farther than 140 baselines (75.2 m)") &&
                 Catch::Contains("lengths are uncertain by about 4 %"));
  agreement.beyond_share = 0.9;
  CHECK_THAT(said_of(1.5, 2.0), Catch::Contains("lengths are uncertain by about 2 %"));
  CHECK(said_of(1.5, 2.5).empty());
}
