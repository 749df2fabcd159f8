// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "stereo_slam/bags/bag_reader.hpp"
#include "stereo_slam/dataset/camera_info.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

[[nodiscard]] bool has_images(const BagTopic& topic) {
  return topic.type == "sensor_msgs/Image" || topic.type == "sensor_msgs/CompressedImage";
}

/// Possible names of the right camera's topic, if `left` is the name of a left camera's topic, such as
/// /cam0/image_raw (EuRoC, TUM-VI), /stereo/left/image_raw or /camera/infra1/image_rect_raw.
[[nodiscard]] std::vector<std::string> partners_of(const std::string& left) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kSides = {
      {{"left", "right"}, {"cam0", "cam1"}, {"camera0", "camera1"}, {"infra1", "infra2"}}};
  std::vector<std::string> names;
  for (const auto& [from, to] : kSides) {
    std::string all = left;
    std::size_t count = 0;
    for (auto at = left.find(from); at != std::string::npos; at = left.find(from, at + 1)) {
      names.push_back(std::string(left).replace(at, from.size(), to));
      all.replace(all.find(from), from.size(), to);
      ++count;
    }
    if (count > 1) names.push_back(std::move(all));  // /left/image_left and /right/image_right
  }
  return names;
}

/// "/cam0/image_raw/compressed" -> "/cam0/image_raw".
[[nodiscard]] std::string without_transport(std::string image_topic) {
  constexpr std::string_view kCompressed = "/compressed";
  if (image_topic.ends_with(kCompressed)) image_topic.resize(image_topic.size() - kCompressed.size());
  return image_topic;
}

/// "/cam0/image_raw" -> "/cam0/camera_info", also for ".../image_raw/compressed".
[[nodiscard]] std::string camera_info_topic(const std::string& image_topic) {
  const std::string name = without_transport(image_topic);
  return name.substr(0, name.rfind('/')) + "/camera_info";
}

/// The image pairs of a bag. A frame is a pair of image indices, one in each topic.
class BagImages : public PairSource {
 public:
  BagImages(std::shared_ptr<BagReader> reader, TopicPair topics)
      : reader_(std::move(reader)), topics_(std::move(topics)) {}

  void add(std::size_t left, std::size_t right) { frames_.emplace_back(left, right); }

  [[nodiscard]] std::optional<RawPair> read(std::size_t index) override {
    const auto [left, right] = frames_.at(index);
    return RawPair{reader_->image(topics_.left, left, bits_), reader_->image(topics_.right, right, bits_)};
  }

  [[nodiscard]] std::optional<int> bits_of_16(std::size_t index) override {
    const auto [left, right] = frames_.at(index);
    const auto of_left = reader_->bits_of_16(topics_.left, left);
    const auto of_right = of_left ? reader_->bits_of_16(topics_.right, right) : std::nullopt;
    return of_right ? std::optional(std::max(*of_left, *of_right)) : std::nullopt;
  }

  void use_bits(int bits) override { bits_ = bits; }

 private:
  std::shared_ptr<BagReader> reader_;
  TopicPair topics_;
  int bits_ = 16;
  std::vector<std::pair<std::size_t, std::size_t>> frames_;
};

/// Refuses stamps that go back: either the clock or the order of the messages is wrong, and which of both
/// cannot be known.
void require_order(const std::vector<std::int64_t>& stamps_ns, const std::string& topic,
                   const fs::path& file) {
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) {
    if (stamps_ns[i] >= stamps_ns[i - 1]) continue;
    fail(file,
         fmt::format("image {} of {}: its stamp {} s is earlier than that of the image before, {} s; write "
                     "the bag again with stamps in order",
                     i, topic, format_seconds(stamps_ns[i]), format_seconds(stamps_ns[i - 1])));
  }
}

/// Pairs images whose stamps differ by at most 1 ms. Of images with the same stamp, the first is used.
void pair_images(BagReader& reader, const TopicPair& topics, BagImages& images, SequenceScan& scan) {
  constexpr std::int64_t kTolerance_ns = 1'000'000;
  const auto left = reader.index_images(topics.left);
  const auto right = reader.index_images(topics.right);
  const fs::path& file = scan.sequence.folder;
  require_order(left, topics.left, file);
  require_order(right, topics.right, file);
  auto& frames = scan.sequence.frames;
  std::size_t repeated = 0;
  for (std::size_t i = 0, j = 0; i < left.size() && j < right.size();) {
    const std::int64_t later_ns = left[i] - right[j];
    if (std::abs(later_ns) <= kTolerance_ns) {
      if (frames.empty() || left[i] > frames.back().stamp_ns) {
        frames.push_back({left[i], file, file});
        images.add(i, j);
      } else {
        ++repeated;
      }
    }
    if (later_ns <= kTolerance_ns) ++i;
    if (later_ns >= -kTolerance_ns) ++j;
  }
  if (frames.size() < 2) {
    fail(file, fmt::format(
                   "{} of {} images of {} and {} of {} have the same stamp within 1 ms; the cameras must be "
                   "synchronised",
                   frames.size(), left.size(), topics.left, right.size(), topics.right));
  }
  if (repeated > 0) {
    scan.problems.push_back(
        {Problem::Severity::kWarning,
         fmt::format("{}: {} pairs of {} and {} have the stamp of the pair before; they are left out",
                     file.string(), repeated, topics.left, topics.right)});
  }
  const std::size_t alone = left.size() + right.size() - 2 * (frames.size() + repeated);
  if (alone > 0) {
    scan.problems.push_back(
        {Problem::Severity::kWarning,
         fmt::format("{}: {} images of {} and {} have no partner of the same stamp; they are left "
                     "out",
                     file.string(), alone, topics.left, topics.right)});
  }
}

/// The calibration in the folder of the bag: one of read_calibration()'s files, or as EuRoC or TUM-VI ship
/// it.
[[nodiscard]] std::optional<OwnCamera> calibration_beside(const fs::path& file) {
  const fs::path folder = fs::absolute(file).parent_path();
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

/// The calibration in the bag's camera_info.
[[nodiscard]] OwnCamera calibration_inside(BagReader& reader, const TopicPair& topics, const fs::path& file) {
  const std::string left = camera_info_topic(topics.left);
  const std::string right = camera_info_topic(topics.right);
  const auto all = reader.topics();
  for (const auto& name : {left, right}) {
    if (std::any_of(all.begin(), all.end(), [&](const BagTopic& topic) { return topic.name == name; }))
      continue;
    fail(file, fmt::format("has no {}; name the calibration of the camera: --calibration FILE", name));
  }
  const CameraInfo of_left = reader.camera_info(left);
  const CameraInfo of_right = reader.camera_info(right);
  for (const auto& [name, info] : {std::pair(left, of_left), {right, of_right}}) {
    if (is_calibrated(info) || info.P[0] != 0.0) continue;
    fail(file,
         fmt::format("{}: the camera matrix K is zero in all messages, which says that the camera was not "
                     "calibrated; name its calibration: --calibration FILE",
                     name));
  }
  OwnCamera own;
  try {
    if (is_named_rectified(topics.left)) {
      own.rectified = rectified_of(of_left, of_right);
    } else {
      own.rig = rig_of(of_left, of_right);
    }
  } catch (const std::invalid_argument& error) {
    fail(file, fmt::format("{}: {}", right, error.what()));
  }
  if (const auto warning = baseline_warning(of_left, of_right); !warning.empty())
    own.warnings.push_back(fmt::format("{}: {}: {}", file.string(), right, warning));
  return own;
}

/// Throws if rectified images have another size than the camera_info says.
void require_size(const StereoCamera& camera, const TopicPair& topics, BagImages& images,
                  const fs::path& file) {
  if (camera.width_px == 0) return;
  const auto pair = images.read(0);
  for (const auto& [topic, image] : {std::pair(topics.left, pair->left), {topics.right, pair->right}}) {
    if (image.cols == camera.width_px && image.rows == camera.height_px) continue;
    fail(file, fmt::format("{} says {}x{} pixels, but the images of {} have {}x{}; they may have been scaled "
                           "or cut out after the calibration: name one of this size, --calibration FILE",
                           camera_info_topic(topic), camera.width_px, camera.height_px, topic, image.cols,
                           image.rows));
  }
}

[[nodiscard]] OwnCamera calibration_of(BagReader& reader, const TopicPair& topics, const fs::path& file,
                                       const BagOptions& options) {
  if (!options.calibration.empty()) return read_calibration(options.calibration);
  if (auto beside = calibration_beside(file)) return std::move(*beside);
  return calibration_inside(reader, topics, file);
}

}  // namespace

bool has_bag_name(const fs::path& file) { return file.extension() == ".bag"; }

std::vector<BagTopic> list_topics(const fs::path& file) { return BagReader(file).topics(); }

TopicPair choose_topics(const std::vector<BagTopic>& topics, const BagOptions& options) {
  std::vector<std::string> images;
  for (const auto& topic : topics) {
    if (has_images(topic)) images.push_back(topic.name);
  }
  const auto is_there = [&](const std::string& name) {
    return std::find(images.begin(), images.end(), name) != images.end();
  };
  const std::string there =
      images.empty() ? "there are none" : fmt::format("there are {}", fmt::join(images, ", "));
  if (!options.left_topic.empty() || !options.right_topic.empty()) {
    for (const auto& name : {options.left_topic, options.right_topic}) {
      if (!is_there(name))
        throw std::invalid_argument(fmt::format("'{}' is no topic of images; {}", name, there));
    }
    if (options.left_topic == options.right_topic)
      throw std::invalid_argument(
          fmt::format("{} is the topic of both cameras; {}", options.left_topic, there));
    return {options.left_topic, options.right_topic};
  }
  std::vector<TopicPair> pairs;
  for (const auto& left : images) {
    for (const auto& right : partners_of(left)) {
      if (is_there(right)) pairs.push_back({left, right});
    }
  }
  if (pairs.size() != 1) {
    throw std::invalid_argument(
        fmt::format("{} pairs of image topics; name them: --left-topic, --right-topic; {}",
                    pairs.empty() ? "no" : "several", there));
  }
  return pairs.front();
}

SequenceScan scan_bag(const fs::path& file, const BagOptions& options) {
  SequenceScan scan;
  auto& sequence = scan.sequence;
  sequence.folder = file;
  sequence.format = "bag";
  attempt(scan.problems, Problem::Severity::kError, [&] {
    const auto reader = std::make_shared<BagReader>(file);
    TopicPair topics;
    try {
      topics = choose_topics(reader->topics(), options);
    } catch (const std::invalid_argument& error) {
      fail(file, error.what());
    }
    sequence.left_name = topics.left;
    sequence.right_name = topics.right;
    const OwnCamera own = calibration_of(*reader, topics, file, options);
    for (const auto& warning : own.warnings) scan.problems.push_back({Problem::Severity::kWarning, warning});
    const auto images = std::make_shared<BagImages>(reader, topics);
    pair_images(*reader, topics, *images, scan);
    if (own.rectified) require_size(*own.rectified, topics, *images, file);
    sequence.source = images;
    set_camera(own, options.calibration.empty() ? file : options.calibration, sequence);
  });
  check_rig(scan);
  check_camera(scan);
  find_bits(scan);
  return scan;
}

}  // namespace stereo_slam
