// SPDX-License-Identifier: MIT
#include "stereo_slam/core/types.hpp"

#include <cstring>
#include <set>
#include <string>

#include "support/catch.hpp"

using namespace stereo_slam;

TEST_CASE("Every reason has a name and a text of its own", "[stereo_slam][types]") {
  std::set<std::string> names, texts;
  for (const auto& reason : kWeakReasons) {
    CAPTURE(reason.name);
    WeakReasons weak;
    weak.*reason.flag = true;
    CHECK(to_string(weak) == reason.name);
    CHECK(std::string(reason.name).find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == std::string::npos);
    names.insert(reason.name);
    texts.insert(reason.text);
  }
  CHECK(names.size() == kWeakReasons.size());
  CHECK(texts.size() == kWeakReasons.size());
}

TEST_CASE("No reason is missing in the table of names", "[stereo_slam][types]") {
  WeakReasons weak;
  for (const auto& reason : kWeakReasons) weak.*reason.flag = true;
  unsigned char flags[sizeof(weak)];
  std::memcpy(flags, &weak, sizeof(weak));
  for (const auto flag : flags) CHECK(flag == 1);
}

TEST_CASE("The reasons that hold are joined in the order of the table", "[stereo_slam][types]") {
  CHECK(to_string(WeakReasons{}).empty());
  WeakReasons weak;
  weak.segment_not_localised = true;
  weak.few_landmarks = true;
  CHECK(to_string(weak) == "few_landmarks;segment_not_localised");
}
