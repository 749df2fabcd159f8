// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_reader.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "stereo_slam/bags/bag_files.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/ros_message.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A time of a file as one whose differences do not overflow.
[[nodiscard]] std::int64_t bounded(std::int64_t record_ns) {
  return std::clamp(record_ns, std::int64_t{0}, kLatestStamp_ns);
}

/// A file of the recording.
struct BagPart {
  fs::path file;
  std::unique_ptr<MessageFile> messages;
  std::optional<RecordTimes> times;  ///< nothing if it has no messages

  /// Calls a function that reads the file, and adds its name to errors.
  template <class Read>
  auto call(const Read& read) const {
    try {
      return read();
    } catch (const std::exception& error) {
      fail(file, error.what());
    }
  }
};

/// A message of the recording.
struct RecordedMessage {
  const BagPart* part = nullptr;
  MessagePlace place;
};

[[nodiscard]] BagPart open_part(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "no such file");
  if (fs::is_directory(file)) fail(file, "is a folder with the name of a bag; rename it");
  if (!fs::is_regular_file(file)) fail(file, "it is not an ordinary file; copy the bag to one");
  BagPart part{.file = file, .messages = nullptr, .times = {}};
  part.messages = part.call([&] { return open_message_file(file); });
  part.times = part.call([&] { return part.messages->times(); });
  if (part.times) part.times = RecordTimes{bounded(part.times->first_ns), bounded(part.times->last_ns)};
  return part;
}

/// Bags of one recording follow each other within seconds.
void require_continuation(const BagPart& before, const BagPart& after) {
  constexpr double kLongestGap_s = 10.0;
  constexpr double kLongestOverlap_s = 0.1;
  const double gap_s = 1e-9 * static_cast<double>(after.times->first_ns - before.times->last_ns);
  if (gap_s >= -kLongestOverlap_s && gap_s <= kLongestGap_s) return;
  fail(after.file,
       "begins {:.6g} s {} the end of {}, so they are no parts of one recording; name one of them",
       std::abs(gap_s), gap_s > 0.0 ? "after" : "before", before.file.filename().string());
}

/// The parts of a recording: as metadata.yaml lists them, or by time.
[[nodiscard]] std::vector<BagPart> open_parts(const fs::path& recording) {
  const auto [files, are_parts] = bag_files(recording);
  std::vector<BagPart> parts;
  parts.reserve(files.size());
  for (const auto& file : files) parts.push_back(open_part(file));
  if (are_parts) return parts;
  std::vector<const BagPart*> filled;
  std::ranges::stable_sort(parts, {},
                           [](const BagPart& part) { return part.times.value_or(RecordTimes{}).first_ns; });
  for (const auto& part : parts) {
    if (part.times) filled.push_back(&part);
  }
  for (std::size_t i = 1; i < filled.size(); ++i) require_continuation(*filled[i - 1], *filled[i]);
  return parts;
}

}  // namespace

struct BagReader::Bag {
  fs::path recording;
  std::vector<BagPart> parts;
  const BagPart* last_read = nullptr;
  std::map<std::string, BagTopic> topics;
  std::map<std::string, std::vector<RecordedMessage>> images;  // by topic
  std::mutex mutex;                                            // files are not thread-safe

  explicit Bag(const fs::path& path) : recording(path), parts(open_parts(path)) {
    for (const auto& part : parts) {
      for (const auto& topic : part.call([&] { return part.messages->topics(); })) {
        const auto [known, is_new] = topics.try_emplace(topic.name, topic);
        if (!is_new) known->second.messages += topic.messages;
      }
    }
  }

  /// From the first to the last message.
  [[nodiscard]] double duration_s() const {
    std::int64_t first_ns = kLatestStamp_ns;
    std::int64_t last_ns = 0;
    for (const auto& part : parts) {
      if (!part.times) continue;
      first_ns = std::min(first_ns, part.times->first_ns);
      last_ns = std::max(last_ns, part.times->last_ns);
    }
    return 1e-9 * static_cast<double>(last_ns - first_ns);
  }

  /// The messages of a topic in order of recording.
  [[nodiscard]] std::vector<RecordedMessage> messages(const std::string& topic) const {
    std::vector<RecordedMessage> messages;
    for (const auto& part : parts) {
      for (const auto& place : part.call([&] { return part.messages->places(topic); })) {
        messages.push_back({&part, place});
        messages.back().place.record_ns = bounded(place.record_ns);
      }
    }
    sort_by_time(messages);
    return messages;
  }

  template <class Messages>
  static void sort_by_time(Messages& messages) {
    std::ranges::stable_sort(messages, {}, [](const auto& message) { return message.place.record_ns; });
  }

  /// A message of a topic, or at least its first bytes. Throws without the name of the file. Only the part
  /// that was read last keeps messages in memory.
  [[nodiscard]] RosMessage read(const std::string& topic, const RecordedMessage& message,
                                std::size_t most_bytes = std::numeric_limits<std::size_t>::max()) {
    const BagTopic& of = topics.at(topic);
    if (last_read != nullptr && last_read != message.part) last_read->messages->release();
    last_read = message.part;
    return {of.type, serialization_of(of.serialization),
            message.part->messages->read(message.place, most_bytes)};
  }

  /// Calls `use` with image `i` of an indexed topic, and adds the names of both to its errors.
  void read_image(const std::string& topic, std::size_t i,
                  const std::function<void(const RosMessage&)>& use) {
    const std::lock_guard lock(mutex);
    try {
      use(read(topic, images.at(topic).at(i)));
    } catch (const std::exception& error) {
      fail(recording, "image {} of {}: {}", i, topic, error.what());
    }
  }
};

BagReader::BagReader(const fs::path& recording) : bag_(std::make_unique<Bag>(recording)) {}
BagReader::~BagReader() = default;

std::vector<BagTopic> BagReader::topics() const {
  std::vector<BagTopic> topics;
  topics.reserve(bag_->topics.size());
  const double duration_s = bag_->duration_s();
  for (const auto& [name, topic] : bag_->topics) {
    topics.push_back(topic);
    if (topic.messages > 1 && duration_s > 0.0)
      topics.back().rate_hz = static_cast<double>(topic.messages - 1) / duration_s;
  }
  return topics;
}

std::vector<IndexedImages> BagReader::index_images(const std::vector<std::string>& topics) {
  struct Image : RecordedMessage {
    std::size_t topic = 0;
  };
  std::vector<Image> all;
  for (std::size_t topic = 0; topic < topics.size(); ++topic) {
    for (const auto& message : bag_->messages(topics[topic])) all.push_back({message, topic});
    bag_->images[topics[topic]].clear();
  }
  Bag::sort_by_time(all);  // so that no part of a file is read twice
  std::vector<IndexedImages> indexed(topics.size());
  for (const auto& image : all) {
    const std::string& topic = topics[image.topic];
    auto& [times, unreadable, first_fault] = indexed[image.topic];
    try {
      const auto stamp_ns = header_stamp_ns(bag_->read(topic, image, kStampedBytes));
      times.push_back({.header_ns = stamp_ns, .record_ns = image.place.record_ns});
      bag_->images[topic].push_back(image);
    } catch (const std::exception& error) {
      if (unreadable++ == 0) first_fault = error.what();
    }
  }
  for (std::size_t topic = 0; topic < topics.size(); ++topic) {
    if (indexed[topic].times.empty() && indexed[topic].unreadable > 0)
      fail(bag_->recording, "{}: {}", topics[topic], indexed[topic].first_fault);
  }
  return indexed;
}

cv::Mat BagReader::image(const std::string& topic, std::size_t i, const GreyScale& scale) {
  cv::Mat image;
  bag_->read_image(topic, i, [&](const RosMessage& message) { image = read_grey(message, scale); });
  return image;
}

bool BagReader::add_values(const std::string& topic, std::size_t i, ValueCounts& values) {
  cv::Mat image;
  bag_->read_image(topic, i, [&](const RosMessage& message) { image = read_16_bit(message); });
  if (!image.empty()) values.add(image);
  return !image.empty();
}

CameraInfo BagReader::camera_info(const std::string& topic) {
  CameraInfo info;
  for (const auto& message : bag_->messages(topic)) {
    try {
      info = read_camera_info(bag_->read(topic, message));
    } catch (const std::exception& error) {
      fail(message.part->file, "{}: {}", topic, error.what());
    }
    if (is_calibrated(info)) break;
  }
  return info;
}

std::vector<std::string> BagReader::warnings() const {
  std::vector<std::string> warnings;
  for (const auto& part : bag_->parts) {
    if (const auto warning = part.messages->warning(); !warning.empty())
      warnings.push_back(part.file.string() + ": " + warning);
  }
  return warnings;
}

}  // namespace stereo_slam
