// SPDX-License-Identifier: MIT
// In place of bag_reader.cpp where librosbag-storage-dev is missing: bags are refused.

#include "stereo_slam/bags/bag_reader.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {

struct BagReader::Bag {};

BagReader::BagReader(const std::filesystem::path& file) {
  fail(file, "this program was built without bags; install librosbag-storage-dev and build it again");
}

BagReader::~BagReader() = default;
std::vector<BagTopic> BagReader::topics() const { return {}; }
std::vector<MessageTime> BagReader::index_images(const std::string&) { return {}; }
cv::Mat BagReader::image(const std::string&, std::size_t, const GreyScale&) { return {}; }
bool BagReader::add_values(const std::string&, std::size_t, ValueCounts&) { return false; }
CameraInfo BagReader::camera_info(const std::string&) { return {}; }

}  // namespace stereo_slam
