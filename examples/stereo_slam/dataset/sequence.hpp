// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "stereo_slam/calibration/rectifier.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/images/pair_source.hpp"
#include "stereo_slam/imu/imu_recording.hpp"
#include "stereo_slam/settings/settings.hpp"

/// A recording as plain data: the files of each frame and the camera. A new dataset format needs one function
/// that fills a SequenceScan and one line in scan_sequence.
namespace stereo_slam {

/// Files of one stereo frame: those of its images, or the videos or the bag that contain them.
struct StereoFiles {
  std::int64_t stamp_ns = 0;
  std::filesystem::path left;
  std::filesystem::path right;
};

/// How far apart in time the images of the pairs were taken.
struct PairDistances {
  std::int64_t median_ns = 0;
  std::int64_t largest_ns = 0;
};

/// Stereo recording; its frames are scaled and rectified when they are loaded.
struct StereoSequence {
  std::filesystem::path folder;
  std::string format;              ///< "kitti", "euroc", "folders", "video", "bag" or "camera"
  std::string left_name = "left";  ///< what messages call the images of the left camera
  std::string right_name = "right";
  StereoCamera camera;              ///< of every frame, with the image size
  std::vector<StereoFiles> frames;  ///< stamps increase; empty for a live camera
  PairDistances pair_distances;     ///< by the stamps of both cameras, where both have stamps
  bool live = false;                ///< a live camera: frames without end, which bring their own stamps
  bool side_by_side = false;        ///< the left file of a frame shows both images
  bool right_half_first = false;    ///< images side by side, from files or a source, begin with the right one
  bool pairs_as_told = false;       ///< the user says which images are pairs; see offset_right_images()
  cv::Size unscaled;                ///< of the left images as recorded, if they are scaled; else empty
  cv::Size unscaled_right;          ///< of the right images
  GreyScale scale;                  ///< of images with 16 bits a pixel

  std::optional<StereoRig> rig;                    ///< of raw images, also if it cannot be rectified
  std::shared_ptr<const Rectifier> rectifier;      ///< null for images that are rectified already
  std::string lenses;                              ///< distortion model before rectification, or empty
  std::shared_ptr<PairSource> source;              ///< null for image files
  std::optional<Eigen::Isometry3d> T_body_camera;  ///< of the rectified left camera, if known

  std::shared_ptr<const ImuRecording> imu;  ///< null if no IMU is to be used
  /// Reads the IMU that the recording has among its images, as bags have; empty for one in files.
  std::function<ImuRecording(const CameraAndImu&)> recorded_imu;

  std::vector<Eigen::Isometry3d> ground_truth;  ///< T_world_camera, or empty
  std::vector<std::int64_t> ground_truth_ns;    ///< its stamps; for KITTI those of the frames
};

/// The full path of the folder or file; for a live camera, the name that the user gave.
[[nodiscard]] std::string full_name(const StereoSequence& sequence);

/// A problem of a recording: where, what and what to do. Errors make the recording unusable.
struct Problem {
  enum class Severity { kWarning, kError };
  Severity severity = Severity::kError;
  std::string text;

  /// A problem of a file or folder: "PATH: WHAT".
  template <class... Values>
  [[nodiscard]] static Problem of(Severity severity, const std::filesystem::path& path,
                                  fmt::format_string<Values...> what, Values&&... values) {
    return {severity, path.string() + ": " + fmt::format(what, std::forward<Values>(values)...)};
  }
  template <class... Values>
  [[nodiscard]] static Problem warning(const std::filesystem::path& path, fmt::format_string<Values...> what,
                                       Values&&... values) {
    return of(Severity::kWarning, path, what, std::forward<Values>(values)...);
  }
  template <class... Values>
  [[nodiscard]] static Problem error(const std::filesystem::path& path, fmt::format_string<Values...> what,
                                     Values&&... values) {
    return of(Severity::kError, path, what, std::forward<Values>(values)...);
  }
};

[[nodiscard]] inline bool is_error(const Problem& problem) {
  return problem.severity == Problem::Severity::kError;
}

/// The recording found in a folder, with every problem found.
struct SequenceScan {
  StereoSequence sequence;
  std::vector<Problem> problems;
  bool too_large = false;  ///< its images must not be loaded; see check_memory

  template <class... Values>
  void warn(const std::filesystem::path& path, fmt::format_string<Values...> what, Values&&... values) {
    problems.push_back(Problem::warning(path, what, std::forward<Values>(values)...));
  }
};

/// Thrown where a video ends slightly before the frame count of its header, or a live camera stops delivering
/// images.
struct EndOfRecording : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What the user says about the pairs of a recording.
struct PairingOptions {
  std::optional<std::int64_t> most_apart_ns{};  ///< nothing: less than half the time between two frames
  bool right_half_first = false;                ///< see StereoSequence
};

/// Reads everything but the images, of which it opens only the first. `format`: kitti, euroc, folders, video
/// or auto. With a `calibration` (see read_calibration), `folder` may also be a video or a live camera that
/// shows both images side by side, or two of them: LEFT,RIGHT.
[[nodiscard]] SequenceScan scan_sequence(const std::filesystem::path& folder, std::string_view format,
                                         const std::filesystem::path& calibration = {},
                                         const PairingOptions& pairing = {});

/// Reads the samples of the recording's IMU, from `file` or, if that is empty, from where the recording has
/// them. Adds a warning for every kind of fault, and an error if there are no samples at the times of the
/// frames.
void add_imu(SequenceScan& scan, const std::filesystem::path& file);

/// Finds which part of 16 bits a pixel the images use: a camera of 12 bits may leave the upper four empty,
/// and a thermal one uses a small part. Up to sixteen pairs, spread over the recording, decide for all
/// frames. Adds a warning if it is not the whole range.
void find_scale(SequenceScan& scan);

/// Lets the images be scaled when they are loaded, before they are rectified, and scales the calibration with
/// them. `factor` is from 0 to 1. Adds an error for images that would become too small.
void scale_images(SequenceScan& scan, double factor);

/// Adds an error if a run with images of this size needs more than half of the memory that the process may
/// use, and says that they are too large.
void check_memory(SequenceScan& scan);

/// The sequence of scan_sequence. Throws std::runtime_error with the first error.
[[nodiscard]] StereoSequence open_sequence(const std::filesystem::path& folder, std::string_view format);

/// Runs one step of a scan. A std::exception of the step becomes a problem of the given severity.
void attempt(std::vector<Problem>& problems, Problem::Severity severity, const std::function<void()>& step);

/// The size of every left or right image before rectification, but after scaling.
[[nodiscard]] cv::Size image_size(const StereoSequence& sequence, bool is_left);

/// The size of every left or right image in the recording.
[[nodiscard]] cv::Size recorded_size(const StereoSequence& sequence, bool is_left);

/// The problem that an image has another size than all images of its camera. `image` is the name of its file,
/// or another name by which it is found.
[[nodiscard]] Problem wrong_size(std::string_view image, const cv::Size& size, const cv::Size& all);

/// Sets camera, rectifier, lenses and, if known, T_body_camera from a rig. Throws std::runtime_error as
/// Rectifier does; with a `file`, the message names it.
void set_rig(StereoSequence& sequence, const StereoRig& rig);
void set_rig(StereoSequence& sequence, const StereoRig& rig, const std::filesystem::path& file);

/// Sets the ground truth to the poses of the body at the times of the frames, as poses of the camera. Throws
/// std::runtime_error with the path of their file or folder if there are none.
void set_ground_truth(StereoSequence& sequence, const std::vector<std::int64_t>& stamps_ns,
                      const std::vector<Eigen::Isometry3d>& T_world_body, const std::filesystem::path& file);

/// The images of a left frame and of a right one, scaled but not rectified. Throws like load_frame.
[[nodiscard]] RawPair load_raw_pair(const StereoSequence& sequence, std::size_t left, std::size_t right);

/// Whether both cameras have the same image in frame `index`, before rectification. Throws like load_frame.
[[nodiscard]] bool has_one_image_twice(const StereoSequence& sequence, std::size_t index);

/// Reads a frame, rectifies it and prepares it according to `settings`. Throws std::runtime_error that names
/// the file when an image is missing, damaged or of another size, and EndOfRecording where a video ends
/// early.
[[nodiscard]] StereoFrame load_frame(const StereoSequence& sequence, std::size_t index,
                                     const ImageSettings& settings = {});

/// Like load_frame, but an image that is missing, damaged or of another size is black in the frame, which
/// says why.
[[nodiscard]] StereoFrame load_partial_frame(const StereoSequence& sequence, std::size_t index,
                                             const ImageSettings& settings = {});

}  // namespace stereo_slam
