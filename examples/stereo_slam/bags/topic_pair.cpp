// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/topic_pair.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stereo_slam {
namespace {

[[nodiscard]] bool has_images(const BagTopic& topic) {
  constexpr std::string_view kDepth = "/compressedDepth";  // a transport of image_transport
  return is_sensor_type(topic.type, "Image") ||
         (is_sensor_type(topic.type, "CompressedImage") && !topic.name.ends_with(kDepth));
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

/// "/Cam_12/l" as "/", "cam", "_", "12", "/", "l".
[[nodiscard]] std::vector<std::string> words_of(const std::string& name) {
  const auto kind = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return std::isdigit(byte) != 0 ? 'd' : std::isalpha(byte) != 0 ? 'a' : c;
  };
  std::vector<std::string> words;
  char last = 0;
  for (const char c : name) {
    if (kind(c) != last || words.empty()) words.emplace_back();
    words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    last = kind(c);
  }
  return words;
}

/// Whether two words are those of a left and a right camera, or count two cameras.
[[nodiscard]] bool are_sides(const std::string& left, const std::string& right) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kSides = {
      {{"left", "right"}, {"l", "r"}, {"a", "b"}, {"port", "starboard"}}};
  for (const auto& side : kSides) {
    if (left == side.first && right == side.second) return true;
  }
  const auto number_of = [](const std::string& word) {
    std::uint64_t number = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, number);
    return error == std::errc{} && stop == end ? std::pair(true, number) : std::pair(false, number);
  };
  const auto [left_counts, left_number] = number_of(left);
  const auto [right_counts, right_number] = number_of(right);
  return left_counts && right_counts && right_number - left_number == 1;
}

/// Whether two names differ only in words that are sides.
[[nodiscard]] bool differ_by_sides(const std::string& left, const std::string& right) {
  const auto left_words = words_of(left);
  const auto right_words = words_of(right);
  if (left_words.size() != right_words.size() || left_words == right_words) return false;
  for (std::size_t i = 0; i < left_words.size(); ++i) {
    if (left_words[i] != right_words[i] && !are_sides(left_words[i], right_words[i])) return false;
  }
  return true;
}

/// Whether two names differ in exactly one part between slashes.
[[nodiscard]] bool differ_in_one_part(const std::string& a, const std::string& b) {
  const std::filesystem::path first(a);
  const std::filesystem::path second(b);
  if (std::distance(first.begin(), first.end()) != std::distance(second.begin(), second.end())) return false;
  std::size_t differing = 0;
  std::mismatch(first.begin(), first.end(), second.begin(), [&](const auto& x, const auto& y) {
    differing += x == y ? 0 : 1;
    return true;
  });
  return differing == 1;
}

/// The topics of images by name.
class ImageTopics {
 public:
  explicit ImageTopics(const std::vector<BagTopic>& topics) {
    for (const auto& topic : topics) {
      if (has_images(topic)) names_.push_back(topic.name);
    }
  }

  /// Those among which a pair is looked for: not a compressed copy of images that are there.
  [[nodiscard]] static ImageTopics candidates(const std::vector<BagTopic>& topics) {
    ImageTopics images(topics);
    const ImageTopics all = images;
    std::erase_if(images.names_, [&](const std::string& name) {
      const std::string raw = without_transport(name);
      return raw != name && all.contain(raw);
    });
    return images;
  }

  [[nodiscard]] bool contain(const std::string& name) const {
    return std::ranges::find(names_, name) != names_.end();
  }

  [[nodiscard]] std::string list() const {
    return names_.empty() ? "there are none" : fmt::format("there are {}", fmt::join(names_, ", "));
  }

  /// Pairs whose names say which is left.
  [[nodiscard]] std::vector<TopicPair> named_pairs() const {
    std::vector<TopicPair> pairs;
    for (const auto& left : names_) {
      for (const auto& right : partners_of(left)) {
        if (contain(right)) pairs.push_back({left, right});
      }
    }
    return pairs;
  }

  /// Pairs whose names count the cameras or name them otherwise.
  [[nodiscard]] std::vector<TopicPair> other_pairs() const {
    std::vector<TopicPair> pairs;
    for (const auto& left : names_) {
      for (const auto& right : names_) {
        if (differ_by_sides(left, right)) pairs.push_back({left, right, true});
      }
    }
    return pairs;
  }

  /// The only two topics, if they are of one kind.
  [[nodiscard]] std::vector<TopicPair> unnamed_pairs() const {
    if (names_.size() != 2 || !differ_in_one_part(names_[0], names_[1])) return {};
    return {{names_[0], names_[1], true, true}};
  }

  /// What to do if no pair or more than one is found.
  [[nodiscard]] std::string advice() const {
    if (names_.size() == 1) {
      return fmt::format(
          "if {0} shows both cameras side by side, name it for both: --left-topic {0} --right-topic {0}; {1}",
          names_.front(), list());
    }
    return fmt::format("name them: --left-topic, --right-topic; {}", list());
  }

 private:
  std::vector<std::string> names_;
};

/// The pairs by the best of the rules that find any.
[[nodiscard]] std::vector<TopicPair> pairs_of(const ImageTopics& images) {
  auto pairs = images.named_pairs();
  if (pairs.empty()) pairs = images.other_pairs();
  if (pairs.empty()) pairs = images.unnamed_pairs();
  return pairs;
}

/// "/scan (foxglove.PointCloud, protobuf)".
[[nodiscard]] std::string described(const BagTopic& topic) {
  const std::string type = topic.type.empty() ? "of unknown type" : topic.type;
  return fmt::format("{} ({}{}{})", topic.name, type, topic.serialization.empty() ? "" : ", ",
                     topic.serialization);
}

}  // namespace

std::string without_transport(std::string image_topic) {
  constexpr std::string_view kCompressed = "/compressed";
  if (image_topic.ends_with(kCompressed)) image_topic.resize(image_topic.size() - kCompressed.size());
  return image_topic;
}

bool is_sensor_type(std::string_view type, std::string_view name) {
  for (const std::string_view package : {"sensor_msgs/", "sensor_msgs/msg/"}) {  // of ROS 1 and 2
    if (type.starts_with(package) && type.substr(package.size()) == name) return true;
  }
  return false;
}

TopicPair choose_topics(const std::vector<BagTopic>& topics, const std::string& left,
                        const std::string& right) {
  const ImageTopics images(topics);
  if (!left.empty() || !right.empty()) {
    for (const auto& name : {left, right}) {
      if (!images.contain(name))
        throw std::invalid_argument(fmt::format("'{}' is no topic of images; {}", name, images.list()));
    }
    return {left, right};
  }
  std::vector<BagTopic> filled = topics;
  std::erase_if(filled, [](const BagTopic& topic) { return topic.messages == 0; });
  auto pairs = pairs_of(ImageTopics::candidates(filled));
  if (pairs.empty()) pairs = pairs_of(ImageTopics::candidates(topics));
  if (pairs.size() == 1) return pairs.front();
  if (pairs.empty()) refuse_topics(topics);
  throw std::invalid_argument(fmt::format("several pairs of image topics; {}", images.advice()));
}

std::string choose_imu_topic(const std::vector<BagTopic>& topics, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& topic : topics) {
    if (is_sensor_type(topic.type, "Imu") && topic.messages > 0) names.push_back(topic.name);
  }
  const std::string list =
      names.empty() ? "there are none with messages" : fmt::format("there are {}", fmt::join(names, ", "));
  if (!name.empty()) {
    if (std::ranges::find(names, name) != names.end()) return name;
    throw std::invalid_argument(fmt::format("'{}' is no topic of an IMU (sensor_msgs/Imu); {}", name, list));
  }
  if (names.size() == 1) return names.front();
  throw std::invalid_argument(
      names.empty() ? "has no messages of an IMU (sensor_msgs/Imu); name a file of samples: --imu-file, or "
                      "leave out --imu"
                    : fmt::format("has several topics of an IMU; name one: --imu-topic; {}", list));
}

void refuse_topics(const std::vector<BagTopic>& topics) {
  if (std::ranges::all_of(topics, [](const BagTopic& topic) { return topic.messages == 0; }))
    throw std::invalid_argument("contains no messages; record it again");
  if (std::ranges::none_of(topics, has_images)) {
    std::vector<std::string> descriptions;
    std::ranges::transform(topics, std::back_inserter(descriptions), described);
    throw std::invalid_argument(
        fmt::format("has no images that are read (sensor_msgs Image or CompressedImage, cdr or ros1); its "
                    "topics are {}",
                    fmt::join(descriptions, ", ")));
  }
  throw std::invalid_argument(fmt::format("no pairs of image topics; {}", ImageTopics(topics).advice()));
}

}  // namespace stereo_slam
