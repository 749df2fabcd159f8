// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <map>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/ros1_bag_lengths.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The message of an error of the library that reads bags, with advice and some in plain words.
std::string with_advice(const std::exception& error) {
  const std::string text = error.what();
  constexpr std::string_view kVersion = "Unsupported bag file version: ";
  if (const auto at = text.find(kVersion); at != std::string::npos) {
    return fmt::format("is a bag of version {}, which is not read; convert it to version 2.0",
                       text.substr(at + kVersion.size()));
  }
  constexpr std::string_view kFirstLine = "Error reading version line";
  const bool in_first_line = text.find(kFirstLine) != std::string::npos;
  return fmt::format("{}; the bag is cut off or damaged, try `rosbag reindex`",
                     in_first_line ? "the first line, '#ROSBAG V2.0', is not there" : text);
}

/// Calls a function of the library, whose errors become std::runtime_error.
void call(const std::function<void()>& function) {
  try {
    function();
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error("the bag has no index, its recording was not ended; call `rosbag reindex`");
  } catch (const std::exception& error) {
    throw std::runtime_error(with_advice(error));
  }
}

/// Whether a file begins as bags do, or is empty.
bool begins_as_bag(const fs::path& file) {
  constexpr std::string_view kBeginning = "#ROSBAG";
  std::array<char, kBeginning.size()> bytes{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), bytes.size());
  return stream.gcount() == 0 || std::string_view(bytes.data(), bytes.size()) == kBeginning;
}

/// A bag through rosbag_storage. The offset of a place is an index of `messages_`.
class Ros1Bag : public MessageFile {
 public:
  explicit Ros1Bag(const fs::path& file) {
    if (!begins_as_bag(file))
      throw std::runtime_error("is no bag of ROS 1; check its name, or convert it to one");
    call([&] {
      require_possible_lengths(file);
      bag_.open(file.string(), rosbag::bagmode::Read);
    });
  }

  [[nodiscard]] std::vector<BagTopic> topics() override {
    std::map<std::string, BagTopic> by_name;
    call([&] {
      for (const rosbag::ConnectionInfo* info : rosbag::View(bag_).getConnections()) {
        rosbag::View topic(bag_, rosbag::TopicQuery(info->topic));
        by_name[info->topic] = {
            .name = info->topic, .type = info->datatype, .messages = topic.size(), .serialization = "ros1"};
      }
    });
    std::vector<BagTopic> topics;
    topics.reserve(by_name.size());
    for (auto& [name, topic] : by_name) topics.push_back(std::move(topic));
    return topics;
  }

  [[nodiscard]] std::optional<RecordTimes> times() override {
    std::optional<RecordTimes> times;
    call([&] {
      rosbag::View view(bag_);
      if (view.size() > 0) times = RecordTimes{to_ns(view.getBeginTime()), to_ns(view.getEndTime())};
    });
    return times;
  }

  [[nodiscard]] std::vector<MessagePlace> places(const std::string& topic) override {
    std::vector<MessagePlace> places;
    call([&] {
      rosbag::View view(bag_, rosbag::TopicQuery(topic));
      for (const rosbag::MessageInstance& message : view) {
        places.push_back({.record_ns = to_ns(message.getTime()), .block = 0, .offset = messages_.size()});
        messages_.push_back(message);
      }
    });
    return places;
  }

  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place) override {
    call([&] {
      const rosbag::MessageInstance& message = messages_.at(place.offset);
      bytes_.resize(message.size());
      ros::serialization::OStream out(bytes_.data(), static_cast<std::uint32_t>(bytes_.size()));
      message.write(out);
    });
    return bytes_;
  }

 private:
  static std::int64_t to_ns(const ros::Time& time) { return static_cast<std::int64_t>(time.toNSec()); }

  rosbag::Bag bag_;
  std::vector<rosbag::MessageInstance> messages_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<MessageFile> open_ros1_bag(const fs::path& file) { return std::make_unique<Ros1Bag>(file); }

}  // namespace stereo_slam
