// SPDX-License-Identifier: MIT
#include "stereo_slam/images/image_file.hpp"

#include <cmath>
#include <functional>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("A grey PNG is read as it was written", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(97);
  cv::imwrite((folder / "a.png").string(), image);
  const cv::Mat loaded = load_gray_image(folder / "a.png");
  REQUIRE(loaded.type() == CV_8UC1);
  REQUIRE(loaded.size() == image.size());
  CHECK(cv::norm(loaded, image, cv::NORM_INF) == 0.0);
  const auto header = check_image(folder / "a.png");
  CHECK(header.width_px == 97);
  CHECK(header.height_px == TinySequence::kHeight);
  CHECK_FALSE(header.colour);
}

TEST_CASE("A colour PNG is recognised and converted to grey", "[image]") {
  const TemporaryFolder folder;
  cv::imwrite((folder / "a.png").string(), cv::Mat(10, 20, CV_8UC3, cv::Scalar(0, 255, 0)));
  CHECK(check_image(folder / "a.png").colour);
  const cv::Mat loaded = load_gray_image(folder / "a.png");
  REQUIRE(loaded.type() == CV_8UC1);
  CHECK(std::abs(loaded.at<std::uint8_t>(5, 5) - 150) <= 1);  // 0.587 * 255
}

TEST_CASE("A PNG cut at any byte is reported as truncated", "[image]") {
  const TemporaryFolder folder;
  cv::imwrite((folder / "a.png").string(), tiny_texture(64));
  for (const double share : {0.001, 0.01, 0.3, 0.9, 0.9999}) {
    CAPTURE(share);
    fs::copy_file(folder / "a.png", folder / "b.png", fs::copy_options::overwrite_existing);
    truncate_file(folder / "b.png", share);
    CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "b.png"); }),
               Catch::Contains("b.png: the PNG is truncated"));
  }
}

TEST_CASE("A PNG with a flipped bit is reported as damaged", "[image]") {
  const TemporaryFolder folder;
  cv::imwrite((folder / "a.png").string(), tiny_texture(64));
  std::string bytes = read_text(folder / "a.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write_text(folder / "a.png", bytes);
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "a.png"); }),
             Catch::Contains("damaged (checksum)"));
}

TEST_CASE("The orientation that a JPEG names is ignored: a calibration is that of the sensor", "[image]") {
  const TemporaryFolder folder;
  cv::imwrite((folder / "a.jpg").string(), tiny_texture(64));
  // APP1 with one entry: tag 0x0112 (orientation), type 3, count 1, value 6 (a quarter turn)
  const std::string exif(
      "\xFF\xE1\0\x22"
      "Exif\0\0MM\0\x2A\0\0\0\x08\0\1\x01\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0",
      36);
  const std::string bytes = read_text(folder / "a.jpg");
  write_text(folder / "b.jpg", bytes.substr(0, 2) + exif + bytes.substr(2));
  REQUIRE(cv::imread((folder / "b.jpg").string()).cols == TinySequence::kHeight);  // turned by OpenCV
  CHECK(cv::norm(load_gray_image(folder / "b.jpg"), load_gray_image(folder / "a.jpg"), cv::NORM_INF) == 0.0);
}

TEST_CASE("Damage in the middle of a JPEG is reported, whatever wrote the file", "[image]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.jpg";
  cv::Mat colour;
  cv::merge(std::vector{tiny_texture(100), tiny_texture(100), tiny_texture(100)}, colour);
  const std::vector<std::vector<int>> encoders = {{cv::IMWRITE_JPEG_QUALITY, 95},
                                                  {cv::IMWRITE_JPEG_QUALITY, 1},
                                                  {cv::IMWRITE_JPEG_OPTIMIZE, 1},
                                                  {cv::IMWRITE_JPEG_RST_INTERVAL, 3},
                                                  {cv::IMWRITE_JPEG_PROGRESSIVE, 1}};
  for (const auto& encoder : encoders) {
    for (const cv::Mat& image : {tiny_texture(97), colour}) {
      CAPTURE(encoder.front(), image.channels());
      cv::imwrite(file.string(), image, encoder);
      CHECK(load_gray_image(file).size() == image.size());
      if (encoder.front() == cv::IMWRITE_JPEG_PROGRESSIVE) continue;  // which is not checked
      std::string bytes = read_text(file);
      const std::string whole = bytes;
      bytes.erase(bytes.size() / 2, bytes.size() / 4);
      write_text(file, bytes);
      CHECK_THAT(message_of([&] { (void)load_gray_image(file); }),
                 Catch::Contains("a.jpg: the JPEG is damaged"));
      CHECK_THAT(message_of([&] { (void)check_image(file); }), Catch::Contains("a.jpg: the JPEG is damaged"));
      write_text(file, whole.substr(0, whole.size() - 2) + whole.substr(whole.size() / 2));
      CHECK_THAT(message_of([&] { (void)load_gray_image(file); }),
                 Catch::Contains("a.jpg: the JPEG is damaged"));
    }
  }
}

TEST_CASE("A BMP with run lengths is refused, one without is read", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(64);
  cv::imwrite((folder / "a.bmp").string(), image);
  CHECK(cv::norm(load_gray_image(folder / "a.bmp"), image, cv::NORM_INF) == 0.0);
  const std::string bytes = read_text(folder / "a.bmp");
  for (const char compression : {1, 2, 4, 6}) {
    std::string compressed = bytes;
    compressed[30] = compression;
    write_text(folder / "b.bmp", compressed);
    CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "b.bmp"); }),
               Catch::Contains("b.bmp: the BMP is compressed") && Catch::Contains("or as PNG"));
    CHECK_FALSE(message_of([&] { (void)check_image(folder / "b.bmp"); }).empty());
  }
}

TEST_CASE("A BMP whose pixels begin within its header or palette is refused", "[image]") {
  const TemporaryFolder folder;
  cv::Mat colour;
  cv::merge(std::vector{tiny_texture(64), tiny_texture(64), tiny_texture(64)}, colour);
  for (const cv::Mat& image : {tiny_texture(64), colour}) {
    CAPTURE(image.channels());
    cv::imwrite((folder / "a.bmp").string(), image);
    CHECK(message_of([&] { (void)load_gray_image(folder / "a.bmp"); }).empty());
    const std::string bytes = read_text(folder / "a.bmp");
    const unsigned pixels =
        static_cast<unsigned char>(bytes[10]) + 256U * static_cast<unsigned char>(bytes[11]);
    for (const unsigned offset : {0U, 14U, 53U, pixels - 1}) {
      std::string shifted = bytes;
      shifted[10] = static_cast<char>(offset & 0xFFU);
      shifted[11] = static_cast<char>(offset >> 8U);
      write_text(folder / "b.bmp", shifted);
      CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "b.bmp"); }),
                 Catch::Contains("b.bmp: the pixels of the BMP begin within its header or palette"));
    }
  }
}

TEST_CASE("A TIFF with an orientation is refused, as the decoder would turn it", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(64);
  // Tags 256 to 258, 262, 273, 274, 277 to 279 of one strip, each a SHORT, as cameras write them.
  const auto tiff = [&](int orientation) {
    std::string bytes("II*\0\x08\0\0\0\x09\0", 10);
    const int strip = 8 + 2 + 9 * 12 + 4;
    const std::vector<std::pair<int, int>> tags = {
        {256, image.cols}, {257, image.rows}, {258, 8},
        {262, 1},          {273, strip},      {274, orientation},
        {277, 1},          {278, image.rows}, {279, image.cols * image.rows}};
    for (const auto& [tag, value] : tags) {
      for (const int number : {tag, 3, 1, 0, value, 0}) {
        bytes += static_cast<char>(number & 0xFF);
        bytes += static_cast<char>(number >> 8);
      }
    }
    bytes += std::string(4, '\0');
    return bytes + std::string(image.begin<char>(), image.end<char>());
  };
  write_text(folder / "a.tif", tiff(1));
  CHECK(cv::norm(load_gray_image(folder / "a.tif"), image, cv::NORM_INF) == 0.0);
  for (const int orientation : {2, 3, 4, 6, 8}) {
    write_text(folder / "a.tif", tiff(orientation));
    CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "a.tif"); }),
               Catch::Contains("a.tif: the TIFF has an orientation other than 1"));
  }
}

TEST_CASE("A pointer of Git LFS in place of an image is named", "[image]") {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
    write_text(folder / name, "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
    const auto expected =
        Catch::Contains(std::string(name) + ": is a Git LFS pointer, not an image; run `git");
    CHECK_THAT(message_of([&] { (void)load_gray_image(folder / name); }), expected);
    CHECK_THAT(message_of([&] { (void)check_image(folder / name); }), expected);
  }
}

TEST_CASE("An image without pixels is called empty", "[image]") {
  const TemporaryFolder folder;
  write_text(folder / "a.pgm", "P5 0 370 255\n");
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "a.pgm"); }),
             Catch::Contains("a.pgm: is 0 x 370 pixels, an empty image; "));
}

TEST_CASE("A PGM whose header ends with CR LF is refused, as its pixels would be shifted", "[image]") {
  const TemporaryFolder folder;
  write_text(folder / "a.pgm", "P5\r\n# by hand\r\n4 1\r\n255\r\nabcd");
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "a.pgm"); }),
             Catch::Contains("a.pgm: the header ends with CR LF"));
  write_text(folder / "b.pgm", "P5\r\n4 1\r\n255\nabcd");
  CHECK(load_gray_image(folder / "b.pgm").at<unsigned char>(0, 0) == 'a');
}

TEST_CASE("Another file is reported as no PNG", "[image]") {
  const TemporaryFolder folder;
  write_text(folder / "text.png", "hello, I am not an image");
  write_text(folder / "empty.png", "");
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "text.png"); }),
             Catch::Contains("not a PNG image"));
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "empty.png"); }),
             Catch::Contains("the file is empty"));
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "none.png"); }),
             Catch::Contains("none.png: missing"));
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder.path()); }), Catch::Contains("cannot be read"));
}

TEST_CASE("Of an image with 16 bits a pixel, the bits that are used decide the grey level", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(64);
  const fs::path file = folder / "a.png";
  for (const int bits : {8, 10, 12, 14, 16}) {
    CAPTURE(bits);
    cv::Mat wide;
    image.convertTo(wide, CV_16U, std::ldexp(1.0, bits - 8));
    for (const auto* name : {"a.png", "a.pgm", "a.tiff"}) {
      cv::imwrite((folder / name).string(), wide);
      ValueCounts values;
      values.add(load_16_bit_image(folder / name));
      CHECK(values.bits() == bits);
      CHECK(values.scale() == GreyScale::of_bits(bits));
      CHECK(cv::norm(load_gray_image(folder / name, values.scale()), image, cv::NORM_INF) == 0.0);
    }
  }
  cv::imwrite(file.string(), image);
  CHECK(load_16_bit_image(file).empty());
  CHECK(cv::norm(load_gray_image(file, GreyScale::of_bits(12)), image, cv::NORM_INF) == 0.0);
}

TEST_CASE("A recording of a camera with 12 bits is read with its contrast, and a warning", "[image]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "8", 3);
  fs::copy(folder / "8", folder / "12", fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(folder / "12")) {
    if (entry.path().extension() != ".png") continue;
    cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
    image.convertTo(image, CV_16U, 16.0);
    cv::imwrite(entry.path().string(), image);
  }
  const SequenceScan scan = scan_sequence(folder / "12", "auto");
  CHECK(scan.sequence.scale == GreyScale::of_bits(12));
  REQUIRE(scan.problems.size() == 1);
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK_THAT(
      scan.problems[0].text,
      Catch::Contains("no value is above 4095 in the 3 pairs examined; they are read as images of 12"));
  const auto narrow = load_frame(open_sequence(folder / "8", "auto"), 1);
  const auto wide = load_frame(scan.sequence, 1);
  CHECK(cv::norm(narrow.left, wide.left, cv::NORM_INF) == 0.0);
  CHECK(cv::norm(narrow.right, wide.right, cv::NORM_INF) == 0.0);
}

namespace {

/// The tiny recording in `folder`/16, its grey levels `step` values apart from `black` on; `change` has the
/// last word on each image, with the number of its frame.
SequenceScan scan_16_bit(
    const fs::path& folder, double black, double step,
    const std::function<void(cv::Mat&, int)>& change = [](cv::Mat&, int) {}) {
  fs::remove_all(folder / "16");
  write_tiny_sequence(folder / "16", 6);
  for (int i = 0; i < 6; ++i) {
    for (const auto* camera : {"image_0", "image_1"}) {
      const std::string file = folder / "16" / camera / frame_name(i);
      cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
      image.convertTo(image, CV_16U, step, black);
      change(image, i);
      cv::imwrite(file, image);
    }
  }
  return scan_sequence(folder / "16", "auto");
}

/// The share of the pixels of an image with a grey level from `low` to `high`.
double share_between(const cv::Mat& image, int low, int high) {
  cv::Mat between;
  cv::inRange(image, low, high, between);
  return cv::countNonZero(between) / static_cast<double>(between.total());
}

}  // namespace

TEST_CASE("A thermal recording, which uses a small part of 16 bits, is read with contrast", "[image]") {
  const TemporaryFolder folder;
  const auto hot_pixel = [](cv::Mat& image, int frame) {
    if (frame == 2) image.at<std::uint16_t>(60, 100) = 65535;
  };
  const auto metadata = [](cv::Mat& image, int frame) {
    for (int x = 0; x < 64; ++x) image.at<std::uint16_t>(0, x) = x % 2 == 0 ? 65535 : 0;
    image.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(frame);
  };
  const auto cold_sky = [](cv::Mat& image, int) { image.rowRange(0, 1) = 0; };
  const std::vector<std::function<void(cv::Mat&, int)>> changes = {[](cv::Mat&, int) {}, hot_pixel, metadata,
                                                                   cold_sky};
  for (std::size_t k = 0; k < changes.size(); ++k) {
    CAPTURE(k);
    const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 900.0 / 255.0, changes[k]);
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text,
               Catch::Contains("98 % of the values in the 6 pairs examined are from 7") &&
                   Catch::Contains("in all frames"));
    for (const std::size_t i : {0U, 2U, 5U}) {
      const StereoFrame frame = load_frame(scan.sequence, i);
      CHECK(share_between(frame.left, 60, 196) > 0.95);
      CHECK(share_between(frame.left, 1, 254) > 0.98);
      CHECK(check_stereo_agreement({frame}).matches >= StereoAgreement::kEnoughMatches);
    }
  }
}

TEST_CASE("The scale of grey levels is the same for all frames, and follows no single one", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 2.0, [](cv::Mat& image, int frame) {
    image += frame == 3 ? 100 : 0;  // a warmer scene is brighter
  });
  const double before = cv::mean(load_frame(scan.sequence, 2).left)[0];
  const double warm = cv::mean(load_frame(scan.sequence, 3).left)[0];
  CHECK(warm - before == Approx(100.0 / scan.sequence.scale.step).margin(1.0));
}

TEST_CASE("Thermal images whose values drift, or differ between the cameras, keep their contrast",
          "[image]") {
  const TemporaryFolder folder;
  const SequenceScan still = scan_16_bit(folder / "still", 21000.0, 900.0 / 255.0);
  CHECK_FALSE(still.sequence.scale.by_median);
  const SequenceScan drifting = scan_16_bit(folder / "drifting", 21000.0, 900.0 / 255.0,
                                            [](cv::Mat& image, int i) { image += 700 * i; });
  int images = 0;  // left and right ones in turn
  const SequenceScan unlike =
      scan_16_bit(folder / "unlike", 21000.0, 900.0 / 255.0,
                  [&](cv::Mat& image, int) { image += images++ % 2 == 0 ? 0 : 9000; });
  const StereoFrame expected = load_frame(drifting.sequence, 0);
  for (const auto* scan : {&drifting, &unlike}) {
    CHECK(scan->sequence.scale.by_median);
    REQUIRE(scan->problems.size() == 1);
    CHECK_THAT(scan->problems[0].text, Catch::Contains("the median of each image is read as medium grey"));
    for (std::size_t i = 0; i < scan->sequence.frames.size(); ++i) {
      const StereoFrame frame = load_frame(scan->sequence, i);
      CHECK(share_between(frame.left, 1, 254) > 0.97);
      CHECK(check_stereo_agreement({frame}).matches >= StereoAgreement::kEnoughMatches);
    }
    CHECK(cv::norm(load_frame(scan->sequence, 0).left, expected.left, cv::NORM_INF) <= 1.0);
  }
}

TEST_CASE("Values that differ by noise only are not spread over all grey levels", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan scan = scan_16_bit(folder.path(), 7000.0, 4.0 / 255.0);
  CHECK(scan.sequence.scale.step == 1.0);
  double least = 0.0;
  double most = 0.0;
  cv::minMaxLoc(load_frame(scan.sequence, 1).left, &least, &most);
  CHECK(most - least <= 4.0);
}

TEST_CASE("A camera of 10 to 16 bits keeps the scale of its bits while the images have contrast", "[image]") {
  const TemporaryFolder folder;
  for (const int bits : {10, 12, 14, 16}) {
    CAPTURE(bits);
    const SequenceScan scan = scan_16_bit(folder.path(), 0.0, std::ldexp(1.0, bits - 8));
    CHECK(scan.sequence.scale == GreyScale::of_bits(bits));
    CHECK(scan.problems.size() == (bits == 16 ? 0 : 1));
  }
}

TEST_CASE("An unreadable pair among those examined does not change the scale", "[image]") {
  const TemporaryFolder folder;
  const SequenceScan whole = scan_16_bit(folder.path(), 7000.0, 3.0);
  truncate_file(folder / "16/image_1/000003.png", 0.5);
  const SequenceScan scan = scan_sequence(folder / "16", "auto");
  CHECK(scan.sequence.scale.step == Approx(whole.sequence.scale.step).epsilon(0.05));
  CHECK_THAT(scan.problems.at(0).text, Catch::Contains("in the 5 pairs examined"));
}

TEST_CASE("The content of an image decides on its format, not its name", "[image]") {
  const TemporaryFolder folder;
  const cv::Mat image = tiny_texture(64);
  const std::vector<std::string> formats = {".png", ".jpg", ".bmp", ".pgm", ".tif", ".webp"};
  for (const auto& format : formats) {
    if (!cv::haveImageWriter(format)) continue;
    const std::vector<int> lossless = {cv::IMWRITE_WEBP_QUALITY, 101};
    cv::imwrite((folder / ("a" + format)).string(), image, format == ".webp" ? lossless : std::vector<int>{});
    for (const auto* name : {"b.png", "b.jpg", "b.JPG", "b.tiff", "b.bmp", "b.pgm", "b.webp"}) {
      CAPTURE(format, name);
      fs::copy_file(folder / ("a" + format), folder / name, fs::copy_options::overwrite_existing);
      CHECK(cv::norm(load_gray_image(folder / name), image, cv::NORM_INF) <= (format == ".jpg" ? 40.0 : 0.0));
      CHECK(check_image(folder / name).width_px == 64);
      truncate_file(folder / name, 0.6);
      CHECK_THAT(message_of([&] { (void)load_gray_image(folder / name); }), Catch::Contains(name));
    }
  }
}

TEST_CASE("PPM and WebP in colour are read, whatever the case of their extensions", "[image]") {
  const TemporaryFolder folder;
  cv::Mat colour;
  cv::merge(std::vector{tiny_texture(64), tiny_texture(64), tiny_texture(64)}, colour);
  for (const std::string format : {".ppm", ".webp"}) {
    if (!cv::haveImageWriter(format)) continue;
    cv::imwrite((folder / ("a" + format)).string(), colour);
    CHECK(check_image(folder / ("a" + format)).colour);
    CHECK(load_gray_image(folder / ("a" + format)).size() == colour.size());
  }
  for (const auto* name : {"a.PNG", "a.Jpg", "a.PPM", "a.webp", "a.WEBP", "a.pnm"})
    CHECK(has_image_name(name));
  for (const auto* name : {"a.txt", "a", ".png"}) CHECK_FALSE(has_image_name(name));
}
