// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/bag_files.hpp"
#include "stereo_slam/bags/bag_reader.hpp"
#include "stereo_slam/bags/ros_message.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/dataset/stamp_pairs.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// "/cam0/image_raw" -> "/cam0/camera_info", also for ".../image_raw/compressed".
[[nodiscard]] std::string camera_info_topic(const std::string& image_topic) {
  const std::string name = without_transport(image_topic);
  return name.substr(0, name.rfind('/')) + "/camera_info";
}

/// The image pairs of a bag. A frame is a pair of image indices, one in each topic.
class BagImages : public PairSource {
 public:
  BagImages(std::shared_ptr<BagReader> reader, TopicPair topics, fs::path recording)
      : reader_(std::move(reader)), topics_(std::move(topics)), recording_(std::move(recording)) {}

  void add(std::size_t left, std::size_t right) { frames_.emplace_back(left, right); }

  [[nodiscard]] std::optional<RawPair> read(std::size_t index) override {
    const auto [left, right] = frames_.at(index);
    RawPair pair;
    pair.left =
        load_or_fault([&, i = left] { return reader_->image(topics_.left, i, scale_); }, pair.left_fault);
    if (!topics_.side_by_side()) {
      pair.right = load_or_fault([&, i = right] { return reader_->image(topics_.right, i, scale_); },
                                 pair.right_fault);
      return pair;
    }
    pair.right_fault = pair.left_fault;
    if (pair.left.empty()) return pair;
    try {
      return split(pair.left);
    } catch (const std::invalid_argument& error) {
      fail(recording_, "image {} of {}: {}", left, topics_.left, error.what());
    }
  }

  [[nodiscard]] bool add_values(std::size_t index, ValueCounts& values) override {
    const auto [left, right] = frames_.at(index);
    if (!reader_->add_values(topics_.left, left, values)) return false;
    return topics_.side_by_side() || reader_->add_values(topics_.right, right, values);
  }

  void use_scale(const GreyScale& scale) override { scale_ = scale; }

 private:
  std::shared_ptr<BagReader> reader_;
  TopicPair topics_;
  fs::path recording_;
  GreyScale scale_;
  std::vector<std::pair<std::size_t, std::size_t>> frames_;
};

/// The images of a topic that have usable times. Adds a warning if some have not.
[[nodiscard]] TimedImages timed_images(const std::string& topic, const IndexedImages& indexed,
                                       bool record_times, SequenceScan& scan) {
  const fs::path& recording = scan.sequence.folder;
  const auto& times = indexed.times;
  TimedImages images;
  try {
    images = record_times ? by_record_times(times) : by_header_stamps(times);
  } catch (const std::invalid_argument& error) {
    fail(recording, "{}: {}", topic, error.what());
  }
  const auto warn = [&](const std::string& text) { scan.warn(recording, "{}; they are left out", text); };
  if (indexed.unreadable > 0)
    warn(fmt::format("{} of {} images of {} cannot be read, the first because {}", indexed.unreadable,
                     indexed.unreadable + times.size(), topic, indexed.first_fault));
  if (images.repeated > 0)
    warn(fmt::format("{} of the images of {} {} the stamp of the image before", images.repeated, topic,
                     images.repeated == 1 ? "has" : "have"));
  if (!images.out_of_order.empty()) {
    const std::size_t first = images.out_of_order.front();
    warn(fmt::format(
        "{} of {} images of {} have stamps that do not fit between those around them, the first is image {} "
        "with {} s",
        images.out_of_order.size(), times.size(), topic, first, format_seconds(times[first].header_ns)));
  }
  return images;
}

/// Fills the frames with the pairs of images that are nearest in time.
void pair_images(BagReader& reader, const TopicPair& topics, const BagOptions& options, BagImages& images,
                 SequenceScan& scan) {
  const fs::path& recording = scan.sequence.folder;
  auto& frames = scan.sequence.frames;
  std::vector<std::string> names{topics.left};
  if (!topics.side_by_side()) names.push_back(topics.right);
  const auto indexed = reader.index_images(names);
  const TimedImages left = timed_images(topics.left, indexed.front(), options.record_times, scan);
  if (topics.side_by_side()) {
    for (std::size_t i = 0; i < left.index.size(); ++i) {
      frames.push_back({left.stamps_ns[i], recording, recording});
      images.add(left.index[i], left.index[i]);
    }
    if (frames.size() < 2) fail(recording, "has {} of {}", counted(frames.size(), "image"), topics.left);
    return;
  }
  const TimedImages right = timed_images(topics.right, indexed.back(), options.record_times, scan);
  const CameraStamps of_left{topics.left, left.stamps_ns};
  const CameraStamps of_right{topics.right, right.stamps_ns};
  const StampPairs pairs = paired_by_stamps(of_left, of_right, options.pairing, scan);
  for (const auto& [i, j] : pairs.pairs) {
    frames.push_back({left.stamps_ns[i], recording, recording});
    images.add(left.index[i], right.index[j]);
  }
  warn_of_lone_images(of_left, of_right, pairs, scan);
}

/// The calibration in the folder of the bag: one of read_calibration()'s files, or as EuRoC or TUM-VI ship
/// it.
[[nodiscard]] std::optional<OwnCamera> calibration_beside(const fs::path& recording) {
  const fs::path folder = fs::absolute(bag_files(recording).files.front()).parent_path();
  if (const auto found = find_calibration(folder); !found.empty()) return read_calibration(found);
  if (fs::exists(folder / "dso/camchain.yaml")) return read_calibration(folder / "dso/camchain.yaml");
  if (!fs::exists(folder / "mav0/cam0/sensor.yaml")) return std::nullopt;
  OwnCamera own;
  own.rig = read_sensor_files(folder / "mav0/cam0/sensor.yaml", folder / "mav0/cam1/sensor.yaml");
  return own;
}

/// Whether a topic holds rectified images by its name, such as /left/image_rect or .../image_rect/compressed.
[[nodiscard]] bool is_named_rectified(const std::string& image_topic) {
  return fs::path(without_transport(image_topic)).filename().string().find("rect") != std::string::npos;
}

/// Whether there are messages on a topic.
[[nodiscard]] bool has_messages(const BagReader& reader, const std::string& name) {
  return std::ranges::any_of(reader.topics(),
                             [&](const BagTopic& topic) { return topic.name == name && topic.messages > 0; });
}

/// Whether P[3], which ROS defines to be 0 for the left camera of a pair, says that a pair of topics is in
/// order or is not; nothing if there is no camera_info or P[3] of both or of neither is 0.
[[nodiscard]] std::optional<bool> are_in_order(BagReader& reader, const TopicPair& topics) {
  const auto has_baseline = [&](const std::string& image_topic) -> std::optional<bool> {
    const std::string name = camera_info_topic(image_topic);
    if (!has_messages(reader, name)) return std::nullopt;
    return reader.camera_info(name).P[3] != 0.0;
  };
  const auto left = has_baseline(topics.left);
  const auto right = has_baseline(topics.right);
  if (!left || !right || *left == *right) return std::nullopt;
  return *right;
}

/// The topics of a bag. Those whose names do not say which is left are ordered by their camera_info, with a
/// warning.
[[nodiscard]] TopicPair topics_of(BagReader& reader, const fs::path& recording, const BagOptions& options,
                                  std::vector<Problem>& problems) {
  TopicPair topics = choose_topics(reader.topics(), options.left_topic, options.right_topic);
  if (!topics.is_guess) return topics;
  const auto in_order = are_in_order(reader, topics);
  if (topics.is_unnamed && !in_order) refuse_topics(reader.topics());
  if (in_order && !*in_order) std::swap(topics.left, topics.right);
  problems.push_back(Problem::warning(
      recording,
      "{} is taken as the left and {} as the right camera, by {}; --left-topic and --right-topic name others",
      topics.left, topics.right,
      in_order ? "P[3] of their camera_info, which is 0 for the left one" : "their names"));
  return topics;
}

/// Whether the last message of a topic is another calibration than this one; not if it is damaged.
[[nodiscard]] bool changes(BagReader& reader, const std::string& name, const CameraInfo& info) {
  try {
    return !(reader.last_camera_info(name) == info);
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// The calibration in the bag's camera_info.
[[nodiscard]] OwnCamera calibration_inside(BagReader& reader, const TopicPair& topics, const fs::path& file) {
  if (topics.side_by_side()) {
    fail(file,
         "{} shows both cameras, and a camera_info describes one; name the calibration of both: "
         "--calibration FILE",
         topics.left);
  }
  const std::string left = camera_info_topic(topics.left);
  const std::string right = camera_info_topic(topics.right);
  for (const auto& name : {left, right}) {
    if (!has_messages(reader, name))
      fail(file, "has no {}; name the calibration of the camera: --calibration FILE", name);
  }
  if (left == right) {
    fail(file,
         "{} is the only camera_info beside {} and {}, but each has its own calibration; name that of both: "
         "--calibration FILE",
         left, topics.left, topics.right);
  }
  const CameraInfo of_left = reader.camera_info(left);
  const CameraInfo of_right = reader.camera_info(right);
  for (const auto& [name, info] : {std::pair(left, of_left), {right, of_right}}) {
    if (is_calibrated(info) || info.P[0] != 0.0) continue;
    fail(file,
         "{}: the camera matrix K is zero in all messages, which says that the camera was not calibrated; "
         "name its calibration: --calibration FILE",
         name);
  }
  OwnCamera own;
  try {
    if (is_named_rectified(topics.left)) {
      own.rectified = rectified_of(of_left, of_right);
    } else {
      own.rig = rig_of(of_left, of_right);
    }
  } catch (const std::invalid_argument& error) {
    fail(file, "{}: {}", right, error.what());
  }
  if (const auto warning = baseline_warning(of_left, of_right); !warning.empty())
    own.warnings.push_back(fmt::format("{}: {}: {}", file.string(), right, warning));
  for (const auto& [name, info] : {std::pair(left, of_left), {right, of_right}}) {
    if (!changes(reader, name, info)) continue;
    own.warnings.push_back(
        fmt::format("{}: {} changes during the recording; its first calibration is used for all images",
                    file.string(), name));
  }
  return own;
}

/// Throws if rectified images have another size than the camera_info says.
void require_size(const StereoCamera& camera, const TopicPair& topics, BagImages& images,
                  const fs::path& file) {
  if (camera.width_px == 0) return;
  const auto pair = images.read(0);
  require_complete(*pair);
  for (const auto& [topic, image] : {std::pair(topics.left, pair->left), {topics.right, pair->right}}) {
    if (image.cols == camera.width_px && image.rows == camera.height_px) continue;
    fail(file,
         "{} says {}x{} pixels, but the images of {} have {}x{}; they may have been scaled or cut out after "
         "the calibration: name one of this size, --calibration FILE",
         camera_info_topic(topic), camera.width_px, camera.height_px, topic, image.cols, image.rows);
  }
}

[[nodiscard]] OwnCamera calibration_of(BagReader& reader, const TopicPair& topics, const fs::path& file,
                                       const BagOptions& options) {
  if (!options.calibration.empty()) return read_calibration(options.calibration);
  if (auto beside = calibration_beside(file)) return std::move(*beside);
  return calibration_inside(reader, topics, file);
}

/// The samples of a topic. Throws std::invalid_argument with what is wrong with the topic.
[[nodiscard]] ImuSamples samples_of(BagReader& reader, const std::string& topic, bool record_times) {
  std::vector<ImuSample> samples;
  ImuFaults faults{.record = "message", .place = "message"};
  std::string first_fault;
  reader.for_each(
      topic,
      [&](const RosMessage& message, std::int64_t record_ns) {
        samples.push_back(read_imu_sample(message));
        if (record_times) samples.back().stamp_ns = record_ns;
        ++faults.records;
      },
      [&](const std::string& fault) {
        if (faults.unreadable++ > 0) return;
        first_fault = fault;
        faults.first_unreadable = faults.records;
      });
  faults.records += faults.unreadable;
  if (2 * faults.unreadable > faults.records)
    throw std::invalid_argument(fmt::format("{} of its {} messages cannot be used, the first because {}",
                                            faults.unreadable, faults.records, first_fault));
  const auto unstamped = std::ranges::count(samples, 0, &ImuSample::stamp_ns);
  if (unstamped > 1 && 2 * static_cast<std::size_t>(unstamped) >= samples.size())
    throw std::invalid_argument(
        "the stamps in its headers are zero; the option --record-times uses the times at which they were "
        "recorded, or correct the driver and record again");
  return usable_samples(std::move(samples), faults);
}

/// The description of the IMU beside the bag or the calibration.
[[nodiscard]] std::optional<ImuDescription> imu_description(const fs::path& recording,
                                                            const fs::path& calibration) {
  auto file = find_imu_description(fs::absolute(bag_files(recording).files.front()).parent_path());
  if (!file && !calibration.empty()) file = find_imu_description(fs::absolute(calibration).parent_path());
  return file ? std::optional(read_imu_description(*file)) : std::nullopt;
}

/// The IMU of a bag.
[[nodiscard]] ImuRecording imu_in(BagReader& reader, const fs::path& recording, const BagOptions& options,
                                  const CameraAndImu& camera) {
  std::string topic;
  try {
    topic = choose_imu_topic(reader.topics(), options.imu_topic);
  } catch (const std::invalid_argument& error) {
    fail(recording, error.what());
  }
  try {
    return imu_recording(recording, samples_of(reader, topic, options.record_times),
                         imu_description(recording, options.calibration), camera);
  } catch (const std::invalid_argument& error) {
    fail(recording, "{}: {}", topic, error.what());
  }
}

/// Everything but the checks of scan_bag(). Throws std::runtime_error that names the recording.
void read_recording(const std::shared_ptr<BagReader>& reader, const BagOptions& options, SequenceScan& scan) {
  auto& sequence = scan.sequence;
  const fs::path& recording = sequence.folder;
  TopicPair topics;
  try {
    topics = topics_of(*reader, recording, options, scan.problems);
  } catch (const std::invalid_argument& error) {
    fail(recording, error.what());
  }
  sequence.left_name = topics.left;
  sequence.right_name = topics.right;
  sequence.right_half_first = options.pairing.right_half_first;
  if (sequence.right_half_first && !topics.side_by_side())
    fail(recording,
         "its images are not side by side, so --right-half-first does not apply; exchange the topics");
  const OwnCamera own = calibration_of(*reader, topics, recording, options);
  for (const auto& warning : own.warnings) scan.problems.push_back({Problem::Severity::kWarning, warning});
  const auto images = std::make_shared<BagImages>(reader, topics, recording);
  pair_images(*reader, topics, options, *images, scan);
  if (own.rectified) require_size(*own.rectified, topics, *images, recording);
  sequence.source = images;
  sequence.recorded_imu = [reader, recording, options](const CameraAndImu& camera) {
    return imu_in(*reader, recording, options, camera);
  };
  set_camera(own, options.calibration.empty() ? recording : options.calibration, sequence);
}

}  // namespace

std::vector<BagTopic> list_topics(const fs::path& recording) { return BagReader(recording).topics(); }

SequenceScan scan_bag(const fs::path& recording, const BagOptions& options) {
  SequenceScan scan;
  scan.sequence.folder = recording;
  scan.sequence.format = "bag";
  std::shared_ptr<BagReader> reader;
  attempt(scan.problems, Problem::Severity::kError, [&] {
    reader = std::make_shared<BagReader>(recording);
    read_recording(reader, options, scan);
  });
  for (const auto& warning : reader ? reader->warnings() : std::vector<std::string>{})
    scan.problems.push_back({Problem::Severity::kWarning, warning});
  check_rig(scan);
  check_camera(scan);
  find_scale(scan);
  return scan;
}

}  // namespace stereo_slam
