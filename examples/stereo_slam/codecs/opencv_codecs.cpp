// SPDX-License-Identifier: MIT
// The shared library that opencv_codecs() loads.
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "stereo_slam/codecs/codecs.hpp"

namespace stereo_slam {
namespace {

class OpenCvVideo : public Video {
 public:
  explicit OpenCvVideo(const cv::VideoCapture& capture) : capture_(capture) {}

  bool grab() override {
    try {
      return capture_.grab();
    } catch (const cv::Exception&) {
      return false;
    }
  }

  cv::Mat retrieve() override {
    cv::Mat image;
    try {
      if (capture_.retrieve(image)) return image;
    } catch (const cv::Exception&) {  // as if it returned false
    }
    return {};
  }

  [[nodiscard]] double get(int property) const override {
    try {
      return capture_.get(property);
    } catch (const cv::Exception&) {
      return 0.0;
    }
  }

  void set(int property, double value) override {
    try {
      capture_.set(property, value);
    } catch (const cv::Exception&) {  // ignored, like a property that the driver does not have
    }
  }

 private:
  cv::VideoCapture capture_;
};

class OpenCvCodecs : public Codecs {
 public:
  [[nodiscard]] cv::Mat decode(std::span<const std::uint8_t> file, int flags) const override {
    try {
      // cv::Mat needs a pointer to non-const data; the bytes are only read.
      auto* bytes = const_cast<std::uint8_t*>(file.data());
      return cv::imdecode(cv::Mat(1, static_cast<int>(file.size()), CV_8UC1, bytes), flags);
    } catch (const cv::Exception&) {
      return {};
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> encode(const cv::Mat& image, const std::string& extension,
                                                 const std::vector<int>& parameters) const override {
    std::vector<std::uint8_t> bytes;
    try {
      if (cv::imencode(extension, image, bytes, parameters)) return bytes;
    } catch (const cv::Exception&) {  // as if it returned false
    }
    return {};
  }

  [[nodiscard]] std::unique_ptr<Video> open_video(const std::string& name, std::span<const int> backends,
                                                  int timeout_ms) const override {
    for (const int backend : backends) {
      std::vector<int> parameters;
      if (backend == cv::CAP_FFMPEG && timeout_ms > 0)  // the other backends refuse what they do not know
        parameters = {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, timeout_ms};
      try {
        cv::VideoCapture capture;
        if (capture.open(name, backend, parameters) && capture.isOpened())
          return std::make_unique<OpenCvVideo>(capture);
      } catch (const cv::Exception&) {  // this backend cannot; the next one may
      }
    }
    return nullptr;
  }
};

}  // namespace

extern "C" const Codecs* stereo_slam_codecs() {
  static const OpenCvCodecs codecs;
  return &codecs;
}

}  // namespace stereo_slam
