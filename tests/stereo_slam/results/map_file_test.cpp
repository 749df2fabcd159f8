// SPDX-License-Identifier: MIT
#include "stereo_slam/results/map_file.hpp"

#include <bit>
#include <csignal>
#include <cstring>
#include <limits>
#include <random>
#include <sys/resource.h>

#include "stereo_slam/support/random_map.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;
using test::map_of;
using test::message_of;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Where docs/map_file.md says things are.
constexpr std::size_t kVersionAt = 16;
constexpr std::size_t kSizeAt = 20;
constexpr std::size_t kHeaderChecksumAt = 28;
constexpr std::size_t kCameraAt = 32 + 16;
constexpr std::size_t kRectificationAt = kCameraAt + 48 + 16;
constexpr std::size_t kKeyframesAt = kRectificationAt + 2304 + 16;
constexpr std::size_t kKeyframeBytes = 744;  // without points
constexpr std::size_t kEmptyMapBytes = 2492;

/// CRC-32 by its definition, bit by bit: polynomial 0x04c11db7, reflected, inverted before and after.
std::uint32_t crc32_of(std::string_view bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320 : 0);
  }
  return ~crc;
}

/// Overwrites bytes with a number as this machine (little-endian, as all that run tests) holds it.
template <class Number>
void put_at(std::string& bytes, std::size_t at, Number value) {
  REQUIRE(at + sizeof(value) <= bytes.size());
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

/// The same file with sizes and checksums that fit it: only its contents can be wrong.
std::string sealed(std::string bytes) {
  put_at(bytes, kSizeAt, std::uint64_t{bytes.size()});
  put_at(bytes, kHeaderChecksumAt, crc32_of(std::string_view(bytes).substr(0, kHeaderChecksumAt)));
  put_at(bytes, bytes.size() - 4, crc32_of(std::string_view(bytes).substr(0, bytes.size() - 4)));
  return bytes;
}

SavedMap small_map() { return map_of(3, 2); }

template <class A, class B>
bool same_bits(const A& a, const B& b) {
  return std::memcmp(a.data(), b.data(), sizeof(*a.data()) * static_cast<std::size_t>(a.size())) == 0;
}

bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

bool same(const PoseGaussian& a, const PoseGaussian& b) {
  return same_bits(a.pose.coeffs(), b.pose.coeffs()) && same_bits(a.covariance, b.covariance);
}

bool same(const KeyframePoint& a, const KeyframePoint& b) {
  return same_bits(a.z, b.z) && a.descriptor == b.descriptor && a.landmark == b.landmark;
}

bool same(const Keyframe& a, const Keyframe& b) {
  const auto same_points = [](const auto& x, const auto& y) { return same(x, y); };
  return a.id == b.id && a.frame == b.frame && a.stamp_ns == b.stamp_ns && a.segment == b.segment &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), same_points) &&
         same(a.T_previous_keyframe, b.T_previous_keyframe) && same(a.T_world_keyframe, b.T_world_keyframe) &&
         same(a.path_length_m, b.path_length_m);
}

bool same(const PoseGraphEdge& a, const PoseGraphEdge& b) {
  return a.from == b.from && a.to == b.to && same(a.T_from_to, b.T_from_to);
}

bool same(const MapPoint& a, const MapPoint& b) {
  return same_bits(a.position_world, b.position_world) && a.intensity == b.intensity &&
         a.keyframe == b.keyframe && a.landmark == b.landmark;
}

template <class Element>
void check_same(const std::vector<Element>& a, const std::vector<Element>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(same(a[i], b[i]));
}

void check_same(const StereoCamera& a, const StereoCamera& b) {
  CHECK((same(a.fx, b.fx) && same(a.fy, b.fy) && same(a.cx, b.cx) && same(a.cy, b.cy)));
  CHECK(same(a.baseline_m, b.baseline_m));
  CHECK((a.width_px == b.width_px && a.height_px == b.height_px));
}

void check_same(const RectificationEstimate& a, const RectificationEstimate& b) {
  CHECK(same_bits(a.coefficients, b.coefficients));
  CHECK(same_bits(a.lens, b.lens));
  CHECK(same_bits(a.row_information, b.row_information));
  CHECK(same_bits(a.row_vector, b.row_vector));
  CHECK(same_bits(a.disparity_information, b.disparity_information));
  CHECK(same_bits(a.disparity_vector, b.disparity_vector));
}

void check_same(const SavedMap& a, const SavedMap& b) {
  check_same(a.camera, b.camera);
  check_same(a.rectification, b.rectification);
  check_same(a.keyframes, b.keyframes);
  check_same(a.loops, b.loops);
  check_same(a.points, b.points);
}

std::string file_of(const SavedMap& map) {
  const TemporaryFolder folder;
  save_map(folder / "map", map);
  return read_text(folder / "map");
}

/// What load_map() says about a file with these bytes, without its name; "" if it loads.
std::string refusal_of(const fs::path& file, std::string_view bytes) {
  write_text(file, std::string(bytes));
  const auto message = message_of([&] { static_cast<void>(load_map(file)); });
  const std::string prefix = file.string() + ": ";
  if (message.empty()) return "";
  CHECK_THAT(message, Catch::StartsWith(prefix) && !Catch::Contains("\n"));
  return message.substr(prefix.size());
}

std::string refusal_of(std::string_view bytes) {
  const TemporaryFolder folder;
  return refusal_of(folder / "map", bytes);
}

TEST_CASE("A map comes back bit for bit", "[stereo_slam][map_file]") {
  const TemporaryFolder folder;
  for (const auto& map : {small_map(), map_of(40, 300), map_of(1, 0)}) {
    save_map(folder / "map", map);
    check_same(load_map(folder / "map"), map);
  }
}

TEST_CASE("A map without keyframes can be saved and loaded", "[stereo_slam][map_file]") {
  SavedMap map;
  map.camera = test::kitti_camera();
  const auto bytes = file_of(map);
  CHECK(bytes.size() == kEmptyMapBytes);
  CHECK(refusal_of(bytes).empty());
}

TEST_CASE("The layout is the documented one", "[stereo_slam][map_file]") {
  CHECK(crc32_of("123456789") == 0xcbf43926);  // the check value of CRC-32
  const auto map = small_map();
  const auto bytes = file_of(map);
  CHECK(bytes.size() == kEmptyMapBytes + 3 * kKeyframeBytes + 6 * 48 + 368 + 2 * 37);
  CHECK(bytes == sealed(bytes));
  CHECK(bytes.substr(0, 16) == "antipode map\r\n\x1a\n");
  CHECK(bytes.substr(kVersionAt, 4) == std::string("\4\0\0\0", 4));
  CHECK(bytes.substr(kCameraAt - 16, 8) == "camera  ");
  CHECK(bytes.substr(kRectificationAt - 16, 8) == "rectify ");
  CHECK(bytes.substr(kKeyframesAt - 16, 8) == "keyframe");
  CHECK(std::memcmp(bytes.data() + kCameraAt, &map.camera.fx, 8) == 0);
  CHECK(std::memcmp(bytes.data() + kKeyframesAt + 8 + kKeyframeBytes, map.keyframes[0].points[0].z.data(),
                    12) == 0);
}

TEST_CASE("A file cut off anywhere is refused", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  const auto bytes = file_of(small_map());
  CHECK_THAT(refusal_of(folder / "map", ""), Catch::StartsWith("is empty"));
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    const auto refusal = refusal_of(folder / "map", std::string_view(bytes).substr(0, size));
    if (!Catch::StartsWith("truncated").match(refusal)) FAIL(size << " bytes: " << refusal);
  }
  CHECK(refusal_of(folder / "map", bytes.substr(0, 100)) ==
        "truncated: 100 of 5454 bytes found; copy the file again, or save the map anew");
}

TEST_CASE("A flipped bit in any byte is detected", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  auto bytes = file_of(small_map());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const auto bit = static_cast<char>(1U << (at % 8));
    bytes[at] = static_cast<char>(bytes[at] ^ bit);
    const auto refusal = refusal_of(folder / "map", bytes);
    const auto* expected = at < kVersionAt ? "is not a map" : "damaged";
    if (!Catch::StartsWith(expected).match(refusal)) FAIL("byte " << at << ": " << refusal);
    bytes[at] = static_cast<char>(bytes[at] ^ bit);
  }
  CHECK(refusal_of(folder / "map", bytes).empty());
}

TEST_CASE("Bytes after the end are detected", "[stereo_slam][map_file][error]") {
  CHECK_THAT(refusal_of(file_of(small_map()) + "\n"),
             Catch::StartsWith("damaged: has 5455 bytes, its header says 5454"));
}

TEST_CASE("Files of other kinds are refused", "[stereo_slam][map_file][error]") {
  const auto* const not_a_map = "is not a map of stereo_slam; name a file that --save-map wrote";
  CHECK(refusal_of("\x89PNG\r\n\x1a\n and what follows, longer than a header of a map") == not_a_map);
  CHECK(refusal_of("x") == not_a_map);
  CHECK(refusal_of("antipode map\nof a text editor, longer than a header of a map is") == not_a_map);
  CHECK(refusal_of("ply\nformat binary_little_endian 1.0\nelement vertex 0\nend_header\n") == not_a_map);
}

TEST_CASE("Maps of other versions are refused with their version", "[stereo_slam][map_file][error]") {
  auto bytes = file_of(small_map());
  put_at(bytes, kVersionAt, std::uint32_t{5});
  CHECK(refusal_of(sealed(bytes)) ==
        "is of version 5 of the format, this program reads version 4; use a newer stereo_slam");
  put_at(bytes, kVersionAt, std::uint32_t{2});
  CHECK_THAT(refusal_of(sealed(bytes)), Catch::Contains("version 2") && Catch::Contains("that wrote it"));
}

TEST_CASE("Missing files and folders are refused", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  const auto refusal = [](const fs::path& file) {
    return message_of([&] { static_cast<void>(load_map(file)); });
  };
  CHECK(refusal(folder / "none") == (folder / "none").string() + ": does not exist; check the path");
  CHECK_THAT(refusal(folder.path()), Catch::EndsWith("is a folder; name a file that --save-map wrote"));
  CHECK_THAT(refusal("/dev/zero"),
             Catch::EndsWith("is not an ordinary file; name a file that --save-map wrote"));
  write_text(folder / "file", "");
  CHECK_THAT(refusal(folder / "file/map"), Catch::EndsWith("does not exist; check the path"));
}

TEST_CASE("A read-only map is loaded", "[stereo_slam][map_file]") {
  const TemporaryFolder folder;
  save_map(folder / "map", small_map());
  fs::permissions(folder / "map", fs::perms::owner_read);
  fs::create_symlink(folder / "map", folder / "link");
  check_same(load_map(folder / "link"), small_map());
}

TEST_CASE("Contradictory contents are refused although the checksum is right",
          "[stereo_slam][map_file][error]") {
  struct Wrong {
    std::size_t at;
    double value;
    const char* refusal;
  };
  const std::size_t first = kKeyframesAt + 8;
  const auto wrong = GENERATE_COPY(values<Wrong>({
      {kCameraAt, -700.0, "camera has no positive focal length"},
      {kCameraAt + 32, kNaN, "camera has no positive baseline"},
      {kRectificationAt, kNaN, "rectification is not finite"},
      {kRectificationAt + 176, -1.0, "rectification has an information that is not positive definite"},
      {first + 24, kNaN, "keyframe 0 has no valid path length"},
      {first + 32, 0.5, "keyframe 0: T_previous_keyframe is not a unit dual quaternion"},
      {first + 32 + 352 + 64, -1.0, "keyframe 0: T_world_keyframe has a matrix that is not a covariance"},
      {first + kKeyframeBytes, -1e300, "keyframe 0 has a point outside the image"},
  }));
  auto bytes = file_of(small_map());
  put_at(bytes, wrong.at, wrong.value);
  CHECK_THAT(refusal_of(sealed(bytes)),
             Catch::StartsWith("contradicts itself: " + std::string(wrong.refusal)) &&
                 Catch::EndsWith("; save the map anew"));
}

TEST_CASE("Counts beyond the file are refused before memory is allocated", "[stereo_slam][map_file][error]") {
  const std::size_t points_at = kKeyframesAt + kKeyframeBytes;  // of the first keyframe's number of points
  const auto count = GENERATE(std::uint64_t{1'000'000'000'000'000'000}, std::uint64_t{6}, ~std::uint64_t{0});
  for (const std::size_t at : {kKeyframesAt, points_at}) {
    auto bytes = file_of(small_map());
    put_at(bytes, at, count);
    CHECK_THAT(refusal_of(sealed(bytes)), Catch::StartsWith("contradicts itself: "));
  }
}

TEST_CASE("Sections of another name or length are refused", "[stereo_slam][map_file][error]") {
  auto bytes = file_of(small_map());
  put_at(bytes, kCameraAt - 16, 'C');
  CHECK(refusal_of(sealed(bytes)) ==
        "contradicts itself: another section where 'camera  ' belongs; save the map anew");
  for (const std::uint64_t size :
       {std::uint64_t{0}, std::uint64_t{47}, std::uint64_t{49}, ~std::uint64_t{0}}) {
    bytes = file_of(small_map());
    put_at(bytes, kCameraAt - 8, size);
    CHECK_THAT(refusal_of(sealed(bytes)), Catch::StartsWith("contradicts itself: "));
  }
  bytes = file_of(small_map());
  CHECK_THAT(refusal_of(sealed(bytes + "more")), Catch::Contains("4 bytes too many"));
}

TEST_CASE("Random contents with right checksums are a valid map or refused",
          "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  const auto map = file_of(small_map());
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::size_t> place(kHeaderChecksumAt + 4, map.size() - 5);
  int refused = 0;
  for (int i = 0; i < 1000; ++i) {
    auto bytes = map;
    for (int k = 0; k < 3; ++k) bytes[place(random)] = static_cast<char>(random());
    if (i % 4 == 0) bytes.resize(place(random) + 4);
    refused += refusal_of(folder / "map", sealed(bytes)).empty() ? 0 : 1;
  }
  CHECK(refused > 500);
}

TEST_CASE("An invalid map is not saved", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  auto map = small_map();
  const auto refusal = [&] { return message_of([&] { save_map(folder / "map", map); }); };
  const auto expect = [&](const std::string& message) {
    CHECK(refusal() == message);
    CHECK_FALSE(fs::exists(folder / "map"));
    map = small_map();
  };
  map.keyframes[1].id = 2;
  expect("keyframe 1 has the id 2");
  map.keyframes[2].frame = map.keyframes[1].frame;
  expect("keyframe 2 is not of a later frame than the keyframe before");
  map.keyframes[2].segment = 0;
  map.keyframes[1].segment = 1;
  expect("keyframe 2 is of an earlier segment than the keyframe before");
  map.keyframes[1].path_length_m = 100.0;
  expect("keyframe 2 has a shorter path length than the keyframe before");
  map.keyframes[1].T_previous_keyframe.covariance.setZero();
  expect("keyframe 1: T_previous_keyframe has a covariance that is not positive definite");
  map.keyframes[2].T_previous_keyframe.covariance.setZero();  // a segment's first
  expect("keyframe 2: T_previous_keyframe has a covariance that is not positive definite");
  map.rectification.coefficients(1, 2) = 1e4;
  expect("rectification moves points out of the image");
  map.keyframes[1].T_world_keyframe.covariance(0, 4) *= -1.0;
  expect("keyframe 1: T_world_keyframe has a matrix that is not a covariance");
  map.keyframes[1].points[1].z.z() = -1.0F;
  expect("keyframe 1 has a point with a negative disparity");
  map.loops[0].to = 3;
  expect("loop 0 connects keyframe 0 with 3 of 3");
  map.loops[0].to = 0;
  expect("loop 0 connects keyframe 0 with itself");
  map.points[1].position_world.y() = kNaN;
  expect("map point 1 is not finite, or farther than 1e9 m");
  map.points[1].keyframe = 3;
  expect("map point 1 belongs to keyframe 3 of 3");
  map.points[1].landmark = 0xffffffff;
  expect("map point 1 has a landmark id beyond 2^31");
  map.keyframes[1].points[0].landmark = 0xffffffff;
  expect("keyframe 1 has a point with a landmark id beyond 2^31");
  map.keyframes[2].frame = std::numeric_limits<std::size_t>::max();
  expect("keyframe 2 has a frame index beyond 2^53");
  map.keyframes[2].segment = 2;
  expect("keyframe 2 skips a segment");
  for (auto& keyframe : map.keyframes) ++keyframe.segment;
  expect("keyframe 0 is not of segment 0");
  map.camera.width_px = 0;
  expect("camera has an image without pixels");
}

TEST_CASE("A full disk keeps the earlier map", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  const auto file = folder / "map";
  save_map(file, small_map());
  const auto before = read_text(file);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit unlimited = {};
  getrlimit(RLIMIT_FSIZE, &unlimited);
  const rlimit limited = {before.size(), unlimited.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limited);
  const auto message = message_of([&] { save_map(file, map_of(40, 300)); });
  setrlimit(RLIMIT_FSIZE, &unlimited);
  CHECK(message == file.string() + ": cannot be written (File too large); check permissions and free space");
  CHECK(read_text(file) == before);
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("A map is not saved into a missing folder nor over a folder", "[stereo_slam][map_file][error]") {
  const TemporaryFolder folder;
  write_text(folder / "file", "");
  fs::create_directories(folder / "taken");
  for (const fs::path& file : {folder / "none/map", folder / "file/map", fs::path("/proc/map")}) {
    CHECK_THAT(message_of([&] { save_map(file, small_map()); }), Catch::Contains("cannot be written"));
  }
  CHECK_THAT(message_of([&] { save_map(folder / "taken", small_map()); }), Catch::Contains("is a folder"));
  CHECK(fs::is_directory(folder / "taken"));
}

}  // namespace
}  // namespace stereo_slam
