// SPDX-License-Identifier: MIT
#include "stereo_slam/results/map_file.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <zlib.h>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/results/byte_stream.hpp"

namespace stereo_slam {
namespace {

using namespace std::string_view_literals;

static_assert(sizeof(std::size_t) == 8 && sizeof(int) == 4, "the file has fields of these widths");

// Header and trailer stay the same in all versions.
constexpr std::string_view kMagic = "antipode map\r\n\x1a\n";
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kTrailerBytes = 4;

constexpr std::size_t kEstimateBytes = (8 + 36) * 8;
constexpr std::size_t kKeyframeBytes = 4 * 8 + 2 * kEstimateBytes + 8;  // without points
constexpr std::size_t kKeyframePointBytes = 3 * 4 + 32 + 4;
constexpr std::size_t kLoopBytes = 2 * 8 + kEstimateBytes;
constexpr std::size_t kMapPointBytes = 3 * 8 + 1 + 8 + 4;

constexpr auto kCopyAgain = "copy the file again, or save the map anew";
constexpr auto kNameAMap = "name a file that --save-map wrote";

std::uint32_t checksum(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

/// Writes fields to bytes. Decoder has the same functions, so that both share one description of the layout.
class Encoder {
 public:
  void number(const PlainNumber auto& value) { writer_.put(value); }

  void bytes(const Descriptor& value) {
    writer_.put_bytes({reinterpret_cast<const char*>(value.data()), value.size()});
  }

  /// Writes the elements row by row.
  template <class Derived>
  void matrix(const Eigen::MatrixBase<Derived>& M) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      for (Eigen::Index j = 0; j < M.cols(); ++j) writer_.put(M(i, j));
    }
  }

  void pose(const Pose& pose) { matrix(pose.coeffs()); }

  template <class Element, class Transfer>
  void list(const std::vector<Element>& elements, std::size_t, Transfer transfer) {
    writer_.put(std::uint64_t{elements.size()});
    for (const auto& element : elements) transfer(*this, element);
  }

  template <class Transfer>
  void section(std::string_view name, Transfer transfer) {
    Encoder content;
    transfer(content);
    writer_.put_bytes(name);
    writer_.put(std::uint64_t{content.writer_.bytes().size()});
    writer_.put_bytes(content.writer_.bytes());
  }

  [[nodiscard]] std::string take() { return writer_.take(); }

 private:
  ByteWriter writer_;
};

/// Reads fields from bytes. Throws std::out_of_range at the end of the bytes.
class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : reader_(bytes) {}

  template <PlainNumber Number>
  void number(Number& value) {
    value = reader_.get<Number>();
  }

  void bytes(Descriptor& value) {
    const auto stored = reader_.get_bytes(value.size());
    std::ranges::copy(stored, value.begin());
  }

  template <class Derived>
  void matrix(Eigen::MatrixBase<Derived>& M) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      for (Eigen::Index j = 0; j < M.cols(); ++j) number(M(i, j));
    }
  }

  void pose(Pose& pose) {
    antipode::Vector8<double> coefficients;
    matrix(coefficients);
    pose = Pose::unchecked(coefficients);
  }

  template <class Element, class Transfer>
  void list(std::vector<Element>& elements, std::size_t min_bytes, Transfer transfer) {
    elements.resize(reader_.get_count(min_bytes));
    for (auto& element : elements) transfer(*this, element);
  }

  template <class Transfer>
  void section(std::string_view name, Transfer transfer) {
    if (reader_.get_bytes(name.size()) != name) {
      throw std::out_of_range(fmt::format("another section where '{}' belongs", name));
    }
    Decoder content(reader_.get_bytes(reader_.get_count(1)));
    transfer(content);
    content.finish();
  }

  /// Throws std::out_of_range if bytes are left.
  void finish() const {
    if (reader_.left() > 0) throw std::out_of_range(fmt::format("{} bytes too many", reader_.left()));
  }

 private:
  ByteReader reader_;
};

// The layout: each function writes with an Encoder (its argument is const) and reads with a Decoder.

void transfer_estimate(auto& stream, auto& estimate) {
  stream.pose(estimate.pose);
  stream.matrix(estimate.covariance);
}

void transfer_camera(auto& stream, auto& camera) {
  stream.number(camera.fx);
  stream.number(camera.fy);
  stream.number(camera.cx);
  stream.number(camera.cy);
  stream.number(camera.baseline_m);
  stream.number(camera.width_px);
  stream.number(camera.height_px);
}

void transfer_rectification(auto& stream, auto& estimate) {
  stream.matrix(estimate.coefficients);
  stream.matrix(estimate.lens);
  stream.matrix(estimate.row_information);
  stream.matrix(estimate.row_vector);
  stream.matrix(estimate.disparity_information);
  stream.matrix(estimate.disparity_vector);
}

void transfer_keyframe_point(auto& stream, auto& point) {
  stream.matrix(point.z);
  stream.bytes(point.descriptor);
  stream.number(point.landmark);
}

void transfer_keyframe(auto& stream, auto& keyframe) {
  stream.number(keyframe.frame);
  stream.number(keyframe.stamp_ns);
  stream.number(keyframe.segment);
  stream.number(keyframe.path_length_m);
  transfer_estimate(stream, keyframe.T_previous_keyframe);
  transfer_estimate(stream, keyframe.T_world_keyframe);
  stream.list(keyframe.points, kKeyframePointBytes,
              [](auto& inner, auto& point) { transfer_keyframe_point(inner, point); });
}

void transfer_loop(auto& stream, auto& loop) {
  stream.number(loop.from);
  stream.number(loop.to);
  transfer_estimate(stream, loop.T_from_to);
}

void transfer_map_point(auto& stream, auto& point) {
  stream.matrix(point.position_world);
  stream.number(point.intensity);
  stream.number(point.keyframe);
  stream.number(point.landmark);
}

void transfer_map(auto& stream, auto& map) {
  stream.section("camera  "sv, [&](auto& content) { transfer_camera(content, map.camera); });
  stream.section("rectify "sv, [&](auto& content) { transfer_rectification(content, map.rectification); });
  stream.section("keyframe"sv, [&](auto& content) {
    content.list(map.keyframes, kKeyframeBytes,
                 [](auto& inner, auto& keyframe) { transfer_keyframe(inner, keyframe); });
  });
  stream.section("loops   "sv, [&](auto& content) {
    content.list(map.loops, kLoopBytes, [](auto& inner, auto& loop) { transfer_loop(inner, loop); });
  });
  stream.section("points  "sv, [&](auto& content) {
    content.list(map.points, kMapPointBytes,
                 [](auto& inner, auto& point) { transfer_map_point(inner, point); });
  });
}

/// A keyframe's id is its index; the file does not contain it.
void set_keyframe_ids(std::vector<Keyframe>& keyframes) {
  for (std::size_t id = 0; id < keyframes.size(); ++id) keyframes[id].id = id;
}

std::string encode_header(std::size_t file_bytes) {
  ByteWriter header;
  header.put_bytes(kMagic);
  header.put(kMapVersion);
  header.put(std::uint64_t{file_bytes});
  header.put(checksum(header.bytes()));
  return header.take();
}

/// The file size according to the header. Throws std::runtime_error unless this is the header of a map of
/// this version.
std::uint64_t decode_header(std::string_view header) {
  if (header.empty()) throw std::runtime_error(fmt::format("is empty; {}", kCopyAgain));
  if (!header.starts_with(kMagic.substr(0, header.size()))) {
    throw std::runtime_error(fmt::format("is not a map of stereo_slam; {}", kNameAMap));
  }
  if (header.size() < kHeaderBytes) {
    throw std::runtime_error(fmt::format("truncated: a map has {} bytes or more, this file {}; {}",
                                         kHeaderBytes + kTrailerBytes, header.size(), kCopyAgain));
  }
  ByteReader reader(header.substr(kMagic.size()));
  const auto version = reader.get<std::uint32_t>();
  const auto file_bytes = reader.get<std::uint64_t>();
  if (reader.get<std::uint32_t>() != checksum(header.substr(0, kHeaderBytes - sizeof(std::uint32_t)))) {
    throw std::runtime_error(fmt::format("damaged: the checksum of its header is wrong; {}", kCopyAgain));
  }
  if (version != kMapVersion) {
    throw std::runtime_error(fmt::format(
        "is of version {} of the format, this program reads version {}; use {}", version, kMapVersion,
        version > kMapVersion ? "a newer stereo_slam" : "the stereo_slam that wrote it"));
  }
  return file_bytes;
}

/// Opens a regular file or a symbolic link to one.
std::ifstream open_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw std::runtime_error("does not exist; check the path");
  }
  if (std::filesystem::is_directory(status)) {
    throw std::runtime_error(fmt::format("is a folder; {}", kNameAMap));
  }
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw std::runtime_error(fmt::format("is not an ordinary file; {}", kNameAMap));
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot be read; check its permissions");
  return stream;
}

/// Up to `size` bytes, fewer at the end of the stream.
std::string read_bytes(std::istream& stream, std::size_t size) {
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

std::uint64_t size_of(std::istream& stream) {
  const auto position = stream.tellg();
  const auto end = stream.seekg(0, std::ios::end).tellg();
  stream.seekg(position);
  return static_cast<std::uint64_t>(end);
}

/// The bytes between header and trailer, with verified checksum.
std::string read_body(std::istream& stream) {
  const std::string header = read_bytes(stream, kHeaderBytes);
  const std::uint64_t promised = decode_header(header);
  const std::uint64_t found = size_of(stream);
  if (found < promised) {
    throw std::runtime_error(fmt::format("truncated: {} of {} bytes found; {}", found, promised, kCopyAgain));
  }
  if (found > promised || promised < kHeaderBytes + kTrailerBytes) {
    throw std::runtime_error(
        fmt::format("damaged: has {} bytes, its header says {}; {}", found, promised, kCopyAgain));
  }
  std::string body = read_bytes(stream, promised - kHeaderBytes - kTrailerBytes);
  const std::string trailer = read_bytes(stream, kTrailerBytes);
  if (trailer.size() < kTrailerBytes) {
    throw std::runtime_error(fmt::format("truncated while it was read; {}", kCopyAgain));
  }
  if (ByteReader(trailer).get<std::uint32_t>() != checksum(body, checksum(header))) {
    throw std::runtime_error(fmt::format("damaged: its checksum is wrong; {}", kCopyAgain));
  }
  return body;
}

SavedMap decode(std::string_view body) {
  SavedMap map;
  Decoder decoder(body);
  try {
    transfer_map(decoder, map);
    decoder.finish();
    set_keyframe_ids(map.keyframes);
    check(map);
  } catch (const std::logic_error& error) {
    throw std::runtime_error(fmt::format("contradicts itself: {}; save the map anew", error.what()));
  }
  return map;
}

}  // namespace

bool is_map(std::string_view beginning) { return beginning.starts_with(kMagic); }

void save_map(const std::filesystem::path& file, const SavedMap& map) {
  check(map);
  Encoder encoder;
  transfer_map(encoder, map);
  const std::string body = encoder.take();
  const std::string header = encode_header(kHeaderBytes + body.size() + kTrailerBytes);
  ByteWriter trailer;
  trailer.put(checksum(body, checksum(header)));
  write_file(file, [&](std::ostream& out) { out << header << body << trailer.bytes(); });
}

SavedMap load_map(const std::filesystem::path& file) {
  try {
    auto stream = open_file(file);
    return decode(read_body(stream));
  } catch (const std::exception& error) {
    fail(file, error.what());
  }
}

}  // namespace stereo_slam
