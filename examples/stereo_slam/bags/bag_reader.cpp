// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/bag_lengths.hpp"
#include "stereo_slam/bags/image_message.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A serialised message, whose fields are read one after another.
class Message {
 public:
  explicit Message(const rosbag::MessageInstance& recorded) : bytes_(recorded.size()) {
    ros::serialization::OStream out(bytes_.data(), static_cast<std::uint32_t>(bytes_.size()));
    recorded.write(out);
  }

  template <class Value>
  Value next() {
    Value value{};
    stream_.next(value);
    return value;
  }

  std::span<const std::uint8_t> bytes() {
    const auto count = next<std::uint32_t>();
    return {stream_.advance(count), count};
  }

  std::vector<double> numbers(std::size_t count) {
    std::vector<double> values(count);
    for (double& value : values) value = next<double>();
    return values;
  }

  /// Reads std_msgs/Header and returns its stamp.
  std::int64_t header_stamp_ns() {
    (void)next<std::uint32_t>();  // seq
    const auto seconds = next<std::uint32_t>();
    const auto nanoseconds = next<std::uint32_t>();
    (void)next<std::string>();  // frame_id
    return std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  ros::serialization::IStream stream_{bytes_.data(), static_cast<std::uint32_t>(bytes_.size())};
};

bool is_compressed(const rosbag::MessageInstance& recorded) {
  return recorded.getDataType() == "sensor_msgs/CompressedImage";
}

/// Reads a sensor_msgs/Image. The pixels belong to the message.
ImageMessage next_image(Message& message) {
  (void)message.header_stamp_ns();
  ImageMessage image;
  image.height = message.next<std::uint32_t>();
  image.width = message.next<std::uint32_t>();
  image.encoding = message.next<std::string>();
  image.big_endian = message.next<std::uint8_t>() != 0;
  image.step = message.next<std::uint32_t>();
  image.data = message.bytes();
  return image;
}

/// Reads a sensor_msgs/CompressedImage. The bytes belong to the message.
std::span<const std::uint8_t> next_compressed(Message& message) {
  (void)message.header_stamp_ns();
  (void)message.next<std::string>();  // format
  return message.bytes();
}

cv::Mat read_image(const rosbag::MessageInstance& recorded, const GreyScale& scale) {
  Message message(recorded);
  return is_compressed(recorded) ? decode_grey(next_compressed(message), scale)
                                 : to_grey(next_image(message), scale);
}

cv::Mat read_values(const rosbag::MessageInstance& recorded) {
  Message message(recorded);
  return is_compressed(recorded) ? decode_16_bit(next_compressed(message))
                                 : values_of_16(next_image(message));
}

CameraInfo read_camera_info(const rosbag::MessageInstance& recorded) {
  constexpr std::uint32_t kMostCoefficients = 14;
  Message message(recorded);
  (void)message.header_stamp_ns();
  CameraInfo info;
  info.height_px = message.next<std::uint32_t>();
  info.width_px = message.next<std::uint32_t>();
  info.distortion_model = message.next<std::string>();
  const auto count = message.next<std::uint32_t>();
  if (count > kMostCoefficients)
    throw std::invalid_argument("the camera_info has too many distortion coefficients");
  info.D = message.numbers(count);
  const auto read_into = [&](auto& numbers) {
    const auto values = message.numbers(numbers.size());
    std::ranges::copy(values, numbers.begin());
  };
  read_into(info.K);
  read_into(info.R);
  read_into(info.P);
  return info;
}

/// The message of an error with advice. Errors of this program (std::invalid_argument) contain advice
/// already; those of the libraries that read bags and messages get it here, some in plain words.
std::string with_advice(const std::exception& error) {
  if (dynamic_cast<const std::invalid_argument*>(&error) != nullptr) return error.what();
  const std::string text = error.what();
  constexpr std::string_view kVersion = "Unsupported bag file version: ";
  if (const auto at = text.find(kVersion); at != std::string::npos) {
    return fmt::format("is a bag of version {}, which is not read; convert it to version 2.0",
                       text.substr(at + kVersion.size()));
  }
  constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kWords = {{
      {"Buffer Overrun", "a message ends within its fields"},
      {"Error reading version line", "the first line, '#ROSBAG V2.0', is not there"},
  }};
  const auto* words = std::ranges::find_if(
      kWords, [&](const auto& known) { return text.find(known.first) != std::string::npos; });
  return fmt::format("{}; the bag is cut off or damaged, try `rosbag reindex`",
                     words == kWords.end() ? std::string_view(text) : words->second);
}

/// Whether a file begins as bags do, or is empty.
bool begins_as_bag(const fs::path& file) {
  constexpr std::string_view kBeginning = "#ROSBAG";
  std::array<char, kBeginning.size()> bytes{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), bytes.size());
  return stream.gcount() == 0 || std::string_view(bytes.data(), bytes.size()) == kBeginning;
}

}  // namespace

struct BagReader::Bag {
  struct Part {
    fs::path file;
    rosbag::Bag bag;
  };

  fs::path recording;
  std::vector<std::unique_ptr<Part>> parts;                            // by time
  std::map<std::string, std::vector<rosbag::MessageInstance>> images;  // by topic
  std::mutex mutex;                                                    // rosbag::Bag is not thread-safe

  explicit Bag(const fs::path& path) : recording(path) {
    for (const auto& file : bag_files(path)) parts.push_back(open(file));
    if (parts.size() < 2) return;
    std::ranges::sort(parts, [](const auto& a, const auto& b) { return begin_of(*a) < begin_of(*b); });
    for (std::size_t i = 1; i < parts.size(); ++i) require_continuation(*parts[i - 1], *parts[i]);
  }

  static std::unique_ptr<Part> open(const fs::path& file) {
    if (!fs::exists(file)) fail(file, "no such file");
    if (fs::is_directory(file)) fail(file, "is a folder with the name of a bag; rename it");
    if (!fs::is_regular_file(file)) fail(file, "it is not an ordinary file; copy the bag to one");
    if (!begins_as_bag(file)) fail(file, "is no bag of ROS 1; check its name, or convert it to one");
    auto part = std::make_unique<Part>();
    part->file = file;
    call(file, [&] {
      require_possible_lengths(file);
      part->bag.open(file.string(), rosbag::bagmode::Read);
    });
    return part;
  }

  /// Seconds since 1970 of the first message.
  static double begin_of(const Part& part) { return rosbag::View(part.bag).getBeginTime().toSec(); }

  /// Bags of one recording follow each other within seconds.
  static void require_continuation(const Part& before, const Part& after) {
    constexpr double kLongestGap_s = 10.0;
    constexpr double kLongestOverlap_s = 0.1;
    const double gap_s = begin_of(after) - rosbag::View(before.bag).getEndTime().toSec();
    if (gap_s >= -kLongestOverlap_s && gap_s <= kLongestGap_s) return;
    fail(after.file,
         "begins {:.6g} s {} the end of {}, so they are no parts of one recording; name one of them",
         std::abs(gap_s), gap_s > 0.0 ? "after" : "before", before.file.filename().string());
  }

  /// Calls a function that reads a bag, and adds the name of the bag to its errors.
  static void call(const fs::path& name, const std::function<void()>& read) {
    try {
      read();
    } catch (const rosbag::BagUnindexedException&) {
      fail(name, "the bag has no index, its recording was not ended; call `rosbag reindex`");
    } catch (const std::exception& error) {
      fail(name, with_advice(error));
    }
  }

  void call(const std::function<void()>& read) const { call(recording, read); }

  /// Calls `read_message` with image `i` of an indexed topic, and adds the names of both to its errors.
  void read(const std::string& topic, std::size_t i,
            const std::function<void(const rosbag::MessageInstance&)>& read_message) {
    const std::lock_guard lock(mutex);
    try {
      read_message(images.at(topic).at(i));
    } catch (const std::exception& error) {
      fail(recording, "image {} of {}: {}", i, topic, with_advice(error));
    }
  }

  /// Adds the messages of a topic, or of all if its name is empty, to a view.
  void add_messages(const std::string& topic, rosbag::View& view) const {
    for (const auto& part : parts) {
      view.addQuery(part->bag, [&](const rosbag::ConnectionInfo* info) {
        return topic.empty() || info->topic == topic;
      });
    }
  }

  /// Calls `visit_message` with each message of a topic, until it returns false.
  void visit(const std::string& topic,
             const std::function<bool(const rosbag::MessageInstance&)>& visit_message) const {
    call([&] {
      rosbag::View view;
      add_messages(topic, view);
      for (const rosbag::MessageInstance& message : view) {
        if (!visit_message(message)) return;
      }
    });
  }
};

BagReader::BagReader(const fs::path& recording) : bag_(std::make_unique<Bag>(recording)) {}
BagReader::~BagReader() = default;

std::vector<BagTopic> BagReader::topics() const {
  std::map<std::string, BagTopic> by_name;
  bag_->call([&] {
    rosbag::View view;
    bag_->add_messages("", view);
    for (const rosbag::ConnectionInfo* info : view.getConnections()) {
      rosbag::View topic;
      bag_->add_messages(info->topic, topic);
      by_name[info->topic] = {info->topic, info->datatype, topic.size()};
    }
  });
  std::vector<BagTopic> topics;
  topics.reserve(by_name.size());
  for (auto& [name, topic] : by_name) topics.push_back(std::move(topic));
  return topics;
}

std::vector<MessageTime> BagReader::index_images(const std::string& topic) {
  auto& images = bag_->images[topic];
  images.clear();
  std::vector<MessageTime> times;
  bag_->visit(topic, [&](const rosbag::MessageInstance& message) {
    times.push_back({.header_ns = Message(message).header_stamp_ns(),
                     .record_ns = static_cast<std::int64_t>(message.getTime().toNSec())});
    images.push_back(message);
    return true;
  });
  return times;
}

cv::Mat BagReader::image(const std::string& topic, std::size_t i, const GreyScale& scale) {
  cv::Mat image;
  bag_->read(topic, i, [&](const rosbag::MessageInstance& message) { image = read_image(message, scale); });
  return image;
}

bool BagReader::add_values(const std::string& topic, std::size_t i, ValueCounts& values) {
  cv::Mat image;
  bag_->read(topic, i, [&](const rosbag::MessageInstance& message) { image = read_values(message); });
  if (!image.empty()) values.add(image);
  return !image.empty();
}

CameraInfo BagReader::camera_info(const std::string& topic) {
  CameraInfo info;
  bag_->visit(topic, [&](const rosbag::MessageInstance& message) {
    try {
      info = read_camera_info(message);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", topic, error.what()));
    }
    return !is_calibrated(info);
  });
  return info;
}

}  // namespace stereo_slam
