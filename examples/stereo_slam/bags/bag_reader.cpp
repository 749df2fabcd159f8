// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_reader.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "stereo_slam/bags/bag_files.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A time of a file as one whose differences do not overflow.
[[nodiscard]] std::int64_t bounded(std::int64_t record_ns) {
  return std::clamp(record_ns, std::int64_t{0}, kLatestStamp_ns);
}

/// Calls a function that reads a part, and adds the name of its file to errors.
template <class Read>
auto call(const BagPart& part, const Read& read) {
  try {
    return read(*part.messages);
  } catch (const std::exception& error) {
    fail(part.file, error.what());
  }
}

[[nodiscard]] BagPart open_part(const fs::path& file) {
  std::error_code error;  // a name may be too long
  if (!fs::exists(file, error)) fail(file, "no such file");
  if (fs::is_directory(file, error)) fail(file, "is a folder with the name of a bag; rename it");
  if (!fs::is_regular_file(file, error)) fail(file, "it is not an ordinary file; copy the bag to one");
  BagPart part{.file = file, .messages = nullptr, .times = {}};
  try {
    part.messages = open_message_file(file);
  } catch (const std::exception& error) {
    fail(file, error.what());
  }
  part.times = call(part, [](MessageFile& messages) { return messages.times(); });
  if (part.times) part.times = RecordTimes{bounded(part.times->first_ns), bounded(part.times->last_ns)};
  return part;
}

/// A longer time between two parts means that one is missing, or nothing was recorded.
constexpr double kUsualGap_s = 0.5;

/// Bags of one recording follow each other within seconds: this many.
[[nodiscard]] double require_continuation(const BagPart& before, const BagPart& after) {
  constexpr double kLongestGap_s = 10.0;
  constexpr double kLongestOverlap_s = 0.1;
  const double gap_s = 1e-9 * static_cast<double>(after.times->first_ns - before.times->last_ns);
  if (gap_s >= -kLongestOverlap_s && gap_s <= kLongestGap_s) return gap_s;
  fail(after.file,
       "begins {:.6g} s {} the end of {}, so they are no parts of one recording; name one of them",
       std::abs(gap_s), gap_s > 0.0 ? "after" : "before", before.file.filename().string());
}

/// The parts of a recording: as metadata.yaml lists them, or by time. Adds warnings for what is not read.
[[nodiscard]] std::vector<BagPart> open_parts(const fs::path& recording, std::vector<std::string>& warnings) {
  const auto [files, are_parts, unnamed] = bag_files(recording);
  for (const auto& file : unnamed)
    warnings.push_back(fmt::format("{}: is not in metadata.yaml, so it is not read", file.string()));
  std::vector<BagPart> parts;
  parts.reserve(files.size());
  for (const auto& file : files) {
    std::error_code error;
    const bool is_begun = files.size() == 1 || fs::file_size(file, error) > 0 || error;
    if (is_begun) {
      parts.push_back(open_part(file));
    } else {
      warnings.push_back(fmt::format("{}: is empty; the other parts are read", file.string()));
    }
  }
  if (are_parts) return parts;
  std::vector<const BagPart*> filled;
  std::ranges::stable_sort(parts, {},
                           [](const BagPart& part) { return part.times.value_or(RecordTimes{}).first_ns; });
  for (const auto& part : parts) {
    if (part.times) filled.push_back(&part);
  }
  for (std::size_t i = 1; i < filled.size(); ++i) {
    if (const double gap_s = require_continuation(*filled[i - 1], *filled[i]); gap_s > kUsualGap_s) {
      warnings.push_back(fmt::format("{}: begins {:.3g} s after the end of {}; is a part missing?",
                                     filled[i]->file.string(), gap_s,
                                     filled[i - 1]->file.filename().string()));
    }
  }
  return parts;
}

template <class Messages>
void sort_by_time(Messages& messages) {
  std::ranges::stable_sort(messages, {}, [](const auto& message) { return message.place.record_ns; });
}

}  // namespace

BagReader::BagReader(const fs::path& recording)
    : recording_(recording), parts_(open_parts(recording, warnings_)) {
  for (const auto& part : parts_) {
    for (const auto& topic : call(part, [](MessageFile& messages) { return messages.topics(); })) {
      const auto [known, is_new] = topics_.try_emplace(topic.name, topic);
      if (!is_new) known->second.messages += topic.messages;
    }
  }
}

double BagReader::duration_s() const {
  std::int64_t first_ns = kLatestStamp_ns;
  std::int64_t last_ns = 0;
  for (const auto& part : parts_) {
    if (!part.times) continue;
    first_ns = std::min(first_ns, part.times->first_ns);
    last_ns = std::max(last_ns, part.times->last_ns);
  }
  return 1e-9 * static_cast<double>(last_ns - first_ns);
}

std::vector<BagReader::Message> BagReader::messages(const std::string& topic) const {
  std::vector<Message> found;
  for (const auto& part : parts_) {
    for (const auto& place : call(part, [&](MessageFile& file) { return file.places(topic); })) {
      found.push_back({&part, place});
      found.back().place.record_ns = bounded(place.record_ns);
    }
  }
  sort_by_time(found);
  return found;
}

RosMessage BagReader::read(const std::string& topic, const Message& message) {
  const BagTopic& of = topics_.at(topic);
  if (last_read_ != nullptr && last_read_ != message.part) last_read_->messages->release();
  last_read_ = message.part;
  return {of.type, serialization_of(of.serialization), message.part->messages->read(message.place)};
}

void BagReader::read_image(const std::string& topic, std::size_t i,
                           const std::function<void(const RosMessage&)>& use) {
  const std::lock_guard lock(mutex_);
  try {
    use(read(topic, images_.at(topic).at(i)));
  } catch (const std::exception& error) {
    fail(recording_, "image {} of {}: {}", i, topic, error.what());
  }
}

std::vector<BagTopic> BagReader::topics() const {
  std::vector<BagTopic> topics;
  topics.reserve(topics_.size());
  const double recorded_s = duration_s();
  for (const auto& [name, topic] : topics_) {
    topics.push_back(topic);
    if (topic.messages > 1 && recorded_s > 0.0)
      topics.back().rate_hz = static_cast<double>(topic.messages - 1) / recorded_s;
  }
  return topics;
}

std::vector<BagReader::Indexed> BagReader::read_beginnings(const BagPart& part,
                                                           const std::vector<std::string>& topics) {
  std::vector<Indexed> messages;
  std::vector<MessagePlace> places;
  for (std::size_t topic = 0; topic < topics.size(); ++topic) {
    const auto more = call(part, [&](MessageFile& file) { return file.places(topics[topic]); });
    places.insert(places.end(), more.begin(), more.end());
    messages.resize(places.size(), {{&part, {}}, topic, {}});
  }
  const auto beginnings = call(part, [&](MessageFile& file) { return file.read_beginnings(places); });
  part.messages->release();
  for (std::size_t i = 0; i < places.size(); ++i) {
    messages[i].place = places[i];
    messages[i].place.record_ns = bounded(places[i].record_ns);
    messages[i].beginning = beginnings[i];
  }
  return messages;
}

std::vector<IndexedImages> BagReader::index_images(const std::vector<std::string>& topics) {
  std::vector<Indexed> all;
  for (const auto& part : parts_) {
    auto messages = read_beginnings(part, topics);
    std::ranges::move(messages, std::back_inserter(all));
  }
  sort_by_time(all);
  for (const auto& topic : topics) images_[topic].clear();
  std::vector<IndexedImages> indexed(topics.size());
  for (const auto& image : all) {
    const BagTopic& topic = topics_.at(topics[image.topic]);
    auto& [times, unreadable, first_fault] = indexed[image.topic];
    try {
      const auto& beginning = image.beginning;
      if (!beginning.fault.empty()) throw std::runtime_error(beginning.fault);
      const auto bytes = std::span(beginning.bytes).first(beginning.count);
      const auto stamp_ns = header_stamp_ns({topic.type, serialization_of(topic.serialization), bytes});
      times.push_back({.header_ns = stamp_ns, .record_ns = image.place.record_ns});
      images_[topic.name].push_back(image);
    } catch (const std::exception& error) {
      if (unreadable++ == 0) first_fault = error.what();
    }
  }
  for (std::size_t topic = 0; topic < topics.size(); ++topic) {
    if (!indexed[topic].times.empty()) continue;
    fail(recording_, "{}: {}", topics[topic],
         indexed[topic].unreadable > 0 ? indexed[topic].first_fault
                                       : "has no messages; record it again, or name another topic");
  }
  return indexed;
}

cv::Mat BagReader::image(const std::string& topic, std::size_t i, const GreyScale& scale) {
  cv::Mat image;
  read_image(topic, i, [&](const RosMessage& message) { image = read_grey(message, scale); });
  return image;
}

bool BagReader::add_values(const std::string& topic, std::size_t i, ValueCounts& values) {
  cv::Mat image;
  read_image(topic, i, [&](const RosMessage& message) { image = read_16_bit(message); });
  if (!image.empty()) values.add(image);
  return !image.empty();
}

CameraInfo BagReader::read_camera_info(const std::string& topic, const Message& message) {
  try {
    return stereo_slam::read_camera_info(read(topic, message));
  } catch (const std::exception& error) {
    fail(message.part->file, "{}: {}", topic, error.what());
  }
}

CameraInfo BagReader::camera_info(const std::string& topic) {
  CameraInfo info;
  for (const auto& message : messages(topic)) {
    info = read_camera_info(topic, message);
    if (is_calibrated(info)) break;
  }
  return info;
}

CameraInfo BagReader::last_camera_info(const std::string& topic) {
  return read_camera_info(topic, messages(topic).back());
}

void BagReader::for_each(const std::string& topic,
                         const std::function<void(const RosMessage&, std::int64_t)>& use,
                         const std::function<void(const std::string&)>& fault) {
  const std::lock_guard lock(mutex_);
  for (const auto& message : messages(topic)) {
    try {
      use(read(topic, message), message.place.record_ns);
    } catch (const std::exception& error) {
      fault(error.what());
    }
  }
}

std::vector<std::string> BagReader::warnings() const {
  std::vector<std::string> warnings = warnings_;
  for (const auto& part : parts_) {
    if (const auto warning = part.messages->warning(); !warning.empty())
      warnings.push_back(part.file.string() + ": " + warning);
  }
  return warnings;
}

}  // namespace stereo_slam
