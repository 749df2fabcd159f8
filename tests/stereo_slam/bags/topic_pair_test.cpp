// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/topic_pair.hpp"

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Topics are chosen by name, and only pairs of images", "[bags]") {
  const auto topics = [](const std::vector<std::string>& names) {
    std::vector<BagTopic> result{{"/imu0", "sensor_msgs/Imu", 9}};
    for (const auto& name : names) result.push_back({name, "sensor_msgs/Image", 3});
    return result;
  };
  const auto chosen = [&](const std::vector<std::string>& names) {
    return choose_topics(topics(names)).right;
  };
  CHECK(chosen({"/cam0/image_raw", "/cam1/image_raw", "/cam2/image_raw"}) == "/cam1/image_raw");
  CHECK(chosen({"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw"}) ==
        "/camera/infra2/image_rect_raw");
  CHECK(chosen({"/left_rig/left/image", "/left_rig/right/image"}) == "/left_rig/right/image");
  CHECK(chosen({"/left/image_left", "/right/image_right"}) == "/right/image_right");
  CHECK(chosen({"/cam_a/image", "/cam_b/image", "/depth/image"}) == "/cam_b/image");
  CHECK(chosen({"/Left/image", "/Right/image"}) == "/Right/image");
  CHECK(chosen({"/image_02", "/image_03"}) == "/image_03");
  CHECK(chosen({"/rig/l/image", "/rig/r/image"}) == "/rig/r/image");
  CHECK(choose_topics(topics({"/cam1/a", "/cam2/a"})).is_guess);
  CHECK_FALSE(choose_topics(topics({"/left", "/right"})).is_guess);
  CHECK_FALSE(choose_topics(topics({"/cam1/a", "/cam2/a"})).is_unnamed);
  CHECK(choose_topics(topics({"/main/a", "/other/a"})).is_unnamed);
  const auto refused = [&](const std::vector<std::string>& names, const BagOptions& options) {
    return message_of([&] { (void)choose_topics(topics(names), options.left_topic, options.right_topic); });
  };
  CHECK_THAT(refused({"/left/a", "/right/a", "/left/b", "/right/b"}, {}), Catch::Contains("several pairs"));
  CHECK_THAT(refused({}, {}), Catch::Contains("has no images"));
  CHECK_THAT(refused({"/cam1/a", "/cam2/a", "/cam3/a"}, {}), Catch::Contains("several pairs"));
  CHECK_THAT(refused({"/rgb/image", "/depth/image", "/x/image"}, {}), Catch::Contains("no pairs"));
  CHECK_THAT(refused({"/a1/b1", "/a2/b3"}, {}), Catch::Contains("no pairs"));
  const BagOptions imu{.left_topic = "/imu0", .right_topic = "/a", .calibration = {}};
  CHECK_THAT(refused({"/a"}, imu), Catch::Contains("'/imu0' is no topic of images; there are /a"));
  CHECK(choose_topics(topics({"/a"}), "/a", "/a").side_by_side());
  const BagOptions half{.left_topic = "/a", .right_topic = "", .calibration = {}};
  CHECK_THAT(refused({"/a"}, half), Catch::Contains("'' is no topic of images"));
}
