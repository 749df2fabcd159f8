// SPDX-License-Identifier: MIT
#include "stereo_slam/images/image_file.hpp"

#include <cmath>

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

TEST_CASE("A TIFF with 32 bits a pixel is refused with its bits", "[image]") {
  const TemporaryFolder folder;
  if (!cv::haveImageWriter(".tif")) return;
  cv::imwrite((folder / "a.tif").string(), cv::Mat(64, 64, CV_32F, 0.5));
  CHECK_THAT(message_of([&] { (void)load_gray_image(folder / "a.tif"); }),
             Catch::Contains("a.tif: has pixels of 32 bits; convert it to grey or colour with 8 or 16 bits"));
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
