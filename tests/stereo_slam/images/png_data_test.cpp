// SPDX-License-Identifier: MIT
#include "stereo_slam/images/png_data.hpp"

#include <cstdlib>
#include <random>
#include <string>
#include <vector>
#include <zlib.h>

#include <opencv2/imgcodecs.hpp>

#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

using Bytes = std::vector<std::uint8_t>;

void append_big_endian(Bytes& bytes, std::uint32_t value) {
  for (const int shift : {24, 16, 8, 0}) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

void append_chunk(Bytes& png, const std::string& type, const Bytes& data) {
  append_big_endian(png, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = png.size();
  png.insert(png.end(), type.begin(), type.end());
  png.insert(png.end(), data.begin(), data.end());
  append_big_endian(
      png, static_cast<std::uint32_t>(::crc32(0, png.data() + begin, static_cast<uInt>(png.size() - begin))));
}

Bytes deflated(const Bytes& bytes) {
  uLongf size = compressBound(bytes.size());
  Bytes result(size);
  REQUIRE(compress(result.data(), &size, bytes.data(), bytes.size()) == Z_OK);
  result.resize(size);
  return result;
}

/// What the filter of this type subtracts from a pixel, as the PNG specification writes it.
int prediction(int type, int a, int b, int c) {
  switch (type) {
    case 1:
      return a;
    case 2:
      return b;
    case 3:
      return (a + b) / 2;
    case 4: {
      const int p = a + b - c;
      const int pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
      return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
    }
    default:
      return 0;
  }
}

/// The rows of an image after the filters of these types.
Bytes filtered(const cv::Mat1b& image, const std::vector<int>& types) {
  const auto pixel = [&](int y, int x) { return y < 0 || x < 0 ? 0 : int{image(y, x)}; };
  Bytes rows;
  for (int y = 0; y < image.rows; ++y) {
    const int type = types[static_cast<std::size_t>(y)];
    rows.push_back(static_cast<std::uint8_t>(type));
    for (int x = 0; x < image.cols; ++x) {
      const int predicted = prediction(type, pixel(y, x - 1), pixel(y - 1, x), pixel(y - 1, x - 1));
      rows.push_back(static_cast<std::uint8_t>(pixel(y, x) - predicted));
    }
  }
  return rows;
}

/// A grey PNG with these filtered rows, in two chunks.
Bytes png_of(cv::Size size, const Bytes& compressed) {
  Bytes png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  Bytes header;
  append_big_endian(header, static_cast<std::uint32_t>(size.width));
  append_big_endian(header, static_cast<std::uint32_t>(size.height));
  header.insert(header.end(), {8, 0, 0, 0, 0});
  append_chunk(png, "IHDR", header);
  const auto middle = compressed.begin() + static_cast<std::ptrdiff_t>(compressed.size() / 2);
  append_chunk(png, "IDAT", Bytes(compressed.begin(), middle));
  append_chunk(png, "IDAT", Bytes(middle, compressed.end()));
  append_chunk(png, "IEND", {});
  return png;
}

cv::Mat1b random_image(cv::Size size, std::mt19937& random) {
  cv::Mat1b image(size);
  for (auto& pixel : image) pixel = static_cast<std::uint8_t>(random() % 256);
  return image;
}

}  // namespace

TEST_CASE("PNGs with all filters are decoded to the images that were encoded", "[image][png]") {
  std::mt19937 random(3);
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(1, 40), cv::Size(40, 1), cv::Size(37, 64)}) {
    const cv::Mat1b image = random_image(size, random);
    std::vector<int> types;
    for (int y = 0; y < size.height; ++y) types.push_back(static_cast<int>(random() % 5));
    const Bytes png = png_of(size, deflated(filtered(image, types)));
    CAPTURE(size.width, size.height);
    REQUIRE(cv::norm(cv::imdecode(png, cv::IMREAD_UNCHANGED), image, cv::NORM_INF) == 0.0);
    CHECK(check_png_data("a.png", png).plain_grey);
    const cv::Mat decoded = decode_plain_grey_png(png);
    REQUIRE(decoded.size() == size);
    CHECK(cv::norm(decoded, image, cv::NORM_INF) == 0.0);
  }
}

TEST_CASE("A PNG whose data are damaged or of another size is not decoded", "[image][png]") {
  std::mt19937 random(4);
  const cv::Size size(30, 20);
  const cv::Mat1b image = random_image(size, random);
  const Bytes rows = filtered(image, std::vector<int>(20, 1));
  REQUIRE_FALSE(decode_plain_grey_png(png_of(size, deflated(rows))).empty());

  Bytes damaged = deflated(rows);
  damaged[damaged.size() / 2] ^= 1;
  CHECK(decode_plain_grey_png(png_of(size, damaged)).empty());
  CHECK(decode_plain_grey_png(png_of(size, {})).empty());
  CHECK(decode_plain_grey_png(png_of(size, deflated(Bytes(rows.begin(), rows.end() - 1)))).empty());
  Bytes longer = rows;
  longer.push_back(0);
  CHECK(decode_plain_grey_png(png_of(size, deflated(longer))).empty());
  Bytes unknown_filter = rows;
  unknown_filter[31] = 5;
  CHECK(decode_plain_grey_png(png_of(size, deflated(unknown_filter))).empty());
  CHECK(decode_plain_grey_png({}).empty());
  CHECK(decode_plain_grey_png(png_of(cv::Size(30, 19), deflated(rows))).empty());
}

TEST_CASE("Only PNGs of eight grey bits without transparency are plain", "[image][png]") {
  const auto is_plain = [](const cv::Mat& image) {
    Bytes png;
    REQUIRE(cv::imencode(".png", image, png));
    return check_png_data("a.png", png).plain_grey;
  };
  CHECK(is_plain(cv::Mat(5, 7, CV_8UC1, cv::Scalar(9))));
  CHECK_FALSE(is_plain(cv::Mat(5, 7, CV_8UC3, cv::Scalar::all(9))));
  CHECK_FALSE(is_plain(cv::Mat(5, 7, CV_16UC1, cv::Scalar(9))));
  Bytes bilevel;
  REQUIRE(
      cv::imencode(".png", cv::Mat(5, 7, CV_8UC1, cv::Scalar(255)), bilevel, {cv::IMWRITE_PNG_BILEVEL, 1}));
  CHECK_FALSE(check_png_data("a.png", bilevel).plain_grey);
}
