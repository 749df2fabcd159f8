// SPDX-License-Identifier: MIT
#include "artwork.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace object_pose {
namespace {

using Rng = std::mt19937_64;

constexpr double kTexels_per_m = 2560.0;  // 512 for 20 cm

int uniform(Rng& rng, int lowest, int highest) {
  return std::uniform_int_distribution<int>(lowest, highest)(rng);
}

cv::Point random_point(cv::Rect area, Rng& rng) {
  return {area.x + uniform(rng, 0, area.width - 1), area.y + uniform(rng, 0, area.height - 1)};
}

std::string random_word(Rng& rng, int length) {
  std::string word;
  while (static_cast<int>(word.size()) < length) word.push_back(static_cast<char>('A' + uniform(rng, 0, 25)));
  return word;
}

/// Draws a random word as high as the area, with as many letters as fit.
void draw_word(cv::Mat1b& image, cv::Rect area, int grey, Rng& rng) {
  constexpr int kFonts[] = {cv::FONT_HERSHEY_DUPLEX, cv::FONT_HERSHEY_TRIPLEX, cv::FONT_HERSHEY_COMPLEX};
  const int font = kFonts[uniform(rng, 0, 2)];
  const int thickness = std::max(1, area.height / 14);
  const double scale = cv::getFontScaleFromHeight(font, area.height * 3 / 4, thickness);
  std::string word = random_word(rng, 40);
  int baseline = 0;
  while (word.size() > 1 && cv::getTextSize(word, font, scale, thickness, &baseline).width > area.width) {
    word.pop_back();
  }
  cv::putText(image, word, {area.x, area.y + area.height * 7 / 8}, font, scale, cv::Scalar(grey), thickness,
              cv::LINE_AA);
}

void draw_mountain(cv::Mat1b& image, cv::Rect area, Rng& rng) {
  std::vector<cv::Point> ridge = {{area.x, area.br().y}};
  const int steps = uniform(rng, 5, 8);
  for (int k = 1; k < steps; ++k) {
    ridge.emplace_back(area.x + area.width * k / steps, area.y + uniform(rng, 0, area.height * 2 / 3));
  }
  ridge.emplace_back(area.br().x, area.br().y);
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{ridge}, cv::Scalar(uniform(rng, 40, 90)),
               cv::LINE_AA);
  for (std::size_t k = 1; k + 1 < ridge.size(); ++k) {  // snow
    const cv::Point top = ridge[k];
    const int w = uniform(rng, 8, 20);
    const std::vector<cv::Point> cap = {top, top + cv::Point(w, 2 * w), top + cv::Point(0, w),
                                        top + cv::Point(-w, 2 * w)};
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{cap}, cv::Scalar(240), cv::LINE_AA);
  }
}

void draw_shape(cv::Mat1b& image, cv::Rect area, Rng& rng) {
  const cv::Point center = random_point(area, rng);
  const int radius = uniform(rng, 6, 26);
  const cv::Scalar grey(uniform(rng, 10, 245));
  switch (uniform(rng, 0, 2)) {
    case 0: {
      const int angle_deg = uniform(rng, 0, 179);
      const cv::Size axes(radius, uniform(rng, 6, 26));
      cv::ellipse(image, center, axes, angle_deg, 0, 360, grey, cv::FILLED, cv::LINE_AA);
      break;
    }
    case 1:
      cv::circle(image, center, radius, grey, uniform(rng, 2, 5), cv::LINE_AA);
      break;
    default: {
      std::vector<cv::Point> star;
      const int corners = uniform(rng, 3, 7);
      const double turn = uniform(rng, 0, 359) * std::numbers::pi / 180.0;
      for (int k = 0; k < 2 * corners; ++k) {
        const double angle = turn + std::numbers::pi * k / corners;
        const double r = k % 2 ? 0.45 * radius : radius;
        star.emplace_back(center.x + cvRound(r * std::cos(angle)), center.y + cvRound(r * std::sin(angle)));
      }
      cv::fillPoly(image, std::vector<std::vector<cv::Point>>{star}, grey, cv::LINE_AA);
    }
  }
}

void draw_bars(cv::Mat1b& image, cv::Rect area, Rng& rng) {
  cv::rectangle(image, area, cv::Scalar(235), cv::FILLED);
  for (int x = area.x + 4; x < area.br().x - 8;) {
    const int width = uniform(rng, 2, 7);
    cv::rectangle(image, cv::Rect(x, area.y + 4, width, area.height - 8), cv::Scalar(20), cv::FILLED);
    x += width + uniform(rng, 2, 7);
  }
}

}  // namespace

cv::Mat1b print_face(cv::Size size_px, Rng& rng) {
  cv::Mat1b face(size_px, static_cast<std::uint8_t>(uniform(rng, 150, 205)));
  const auto part = [&](double x, double y, double width, double height) {
    return cv::Rect(cvRound(x * size_px.width), cvRound(y * size_px.height), cvRound(width * size_px.width),
                    cvRound(height * size_px.height));
  };
  const cv::Rect banner = part(0.05, 0.05, 0.9, 0.2);
  cv::rectangle(face, banner, cv::Scalar(uniform(rng, 20, 80)), cv::FILLED);
  draw_word(face, part(0.08, 0.06, 0.84, 0.18), 240, rng);
  draw_mountain(face, part(0.05, 0.3, 0.5, 0.35), rng);
  for (int k = 0; k < 24; ++k) draw_shape(face, part(0.06, 0.3, 0.88, 0.62), rng);
  draw_word(face, part(0.58, 0.3, 0.38, 0.13), 30, rng);
  draw_word(face, part(0.06, 0.68, 0.5, 0.12), 25, rng);
  for (int line = 0; line < 4; ++line) draw_word(face, part(0.6, 0.52 + 0.055 * line, 0.34, 0.05), 20, rng);
  for (int line = 0; line < 2; ++line) draw_word(face, part(0.06, 0.83 + 0.06 * line, 0.5, 0.055), 40, rng);
  draw_bars(face, part(0.6, 0.8, 0.33, 0.13), rng);
  cv::rectangle(face, {0, 0, size_px.width, size_px.height}, cv::Scalar(uniform(rng, 30, 120)),
                size_px.width / 60);
  cv::GaussianBlur(face, face, {}, 0.8);
  return face;
}

BoxModel print_box(const BoxSize& size_m, Rng& rng) {
  BoxModel box{size_m, {}};
  for (const auto name : kFaceNames) {
    const bool flat = name == "top" || name == "bottom";
    const bool side = name == "left" || name == "right";
    const cv::Size size_px(cvRound((side ? size_m.y() : size_m.x()) * kTexels_per_m),
                           cvRound((flat ? size_m.y() : size_m.z()) * kTexels_per_m));
    box.faces.push_back(make_face(size_m, name, print_face(size_px, rng)));
  }
  return box;
}

cv::Mat1b paint_wall(cv::Size size_px, Rng& rng) {
  cv::Mat1f shades(size_px / 64);
  for (float& value : shades) value = static_cast<float>(uniform(rng, 60, 170));
  cv::Mat1f smooth;
  cv::resize(shades, smooth, size_px, 0, 0, cv::INTER_CUBIC);
  cv::Mat1b wall;
  smooth.convertTo(wall, CV_8U);
  const cv::Rect all({0, 0}, size_px);
  for (int k = 0; k < 60; ++k) draw_shape(wall, all, rng);
  for (int k = 0; k < 12; ++k) {
    const cv::Point corner = random_point(all, rng);
    const int grey = uniform(rng, 20, 230);
    const int height = uniform(rng, 15, 50);
    const int width = uniform(rng, 60, 300);
    draw_word(wall, {corner, cv::Size(width, height)}, grey, rng);
  }
  cv::GaussianBlur(wall, wall, {}, 1.2);
  return wall;
}

}  // namespace object_pose
