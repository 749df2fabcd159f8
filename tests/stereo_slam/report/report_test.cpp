// SPDX-License-Identifier: MIT
#include "stereo_slam/report/report.hpp"

#include <limits>
#include <sstream>

#include <nlohmann/json.hpp>

#include "stereo_slam/report/drive.hpp"
#include "stereo_slam/report/page_data.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;
using nlohmann::json;

namespace {

std::string page(const RunRecord& record, const report::RunInfo& info = {}) {
  std::ostringstream text;
  report::write_report(text, record, info);
  return text.str();
}

}  // namespace

TEST_CASE("A report of any length is one page without external resources", "[report]") {
  for (const std::size_t frames : {0U, 1U, 2U, 300U}) {
    CAPTURE(frames);
    const auto text = page(drive(frames));
    CHECK_THAT(text, Catch::StartsWith("<!DOCTYPE html>") && Catch::EndsWith("</html>\n"));
    for (const auto* part : {"src=\"", "url(", "@import", "<link rel=\"stylesheet", "{{"}) {
      CAPTURE(part);
      CHECK(text.find(part) == std::string::npos);
    }
    CHECK(page_data(text)["frames"]["time_s"].size() == frames);
  }
}

TEST_CASE("Text of paths and errors cannot become markup", "[report]") {
  report::RunInfo info{.header = {.state = "failed", .error = "no </script><img src=x> \"left\""},
                       .dataset = "",
                       .preset = "a&b"};
  info.dataset = "/data/</script><script>alert('x')</script>\xff";
  const auto text = page(drive(3), info);
  CHECK(text.find("alert('x')</script>") == std::string::npos);
  CHECK(text.find("<img") == std::string::npos);
  const json data = page_data(text);
  CHECK(data["error"] == info.header.error);
  CHECK(data["subtitle"] == "/data/</script><script>alert('x')</script>\uFFFD");
}

TEST_CASE("Five thousand frames with a million landmarks, images and ground truth fit into three megabytes",
          "[report]") {
  auto record = drive(5000);
  for (std::size_t k = 0; k < record.results.size(); ++k) {  // numbers with all their digits
    const auto a = static_cast<double>(k);
    record.trajectory[k].pose = Pose::exp((Vector6<double>() << 0.1 * std::sin(a), 0.01 * a,
                                           0.1 * std::cos(a), 300.0 * std::sin(0.01 * a), std::sin(a), a)
                                              .finished());
    record.trajectory[k].covariance.diagonal() =
        Vector6<double>::Constant(1e-5 * (a + 1.0) * (2.0 + std::sin(a)));
    record.total_ms[k] = 30.0 + std::sin(a);
    record.results[k].times.clear();
    for (const auto* stage :
         {"images", "odometry", "predict", "associate", "update", "map", "stereo", "loops"})
      record.results[k].times.push_back({stage, 3.0 + std::sin(a)});
  }
  for (std::size_t i = 0; i < 1'000'000; ++i) {
    const auto a = static_cast<double>(i);
    record.map_points.push_back({{300.0 * std::sin(a), 0.0, 2500.0 + 2500.0 * std::sin(1.7 * a)}, 9});
  }
  for (std::size_t k = 100; k < 1100; ++k) record.loops.push_back({k, k - 100, false, 40, 2.0, true});
  report::RunInfo info;
  info.ground_truth = true_drive(5000);
  for (std::size_t i = 0; i < report::Thumbnails::kMost; ++i)
    info.thumbnails.push_back({80 * i, std::vector<std::uint8_t>(5000, 0x5a)});
  const auto size = page(record, info).size();
  CAPTURE(size);
  CHECK(size < 3'000'000);
}

TEST_CASE("Values that are not finite become null", "[report]") {
  auto record = drive(20);
  record.trajectory[7].covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  record.trajectory[8].covariance *= -1.0;
  record.total_ms[9] = std::numeric_limits<double>::infinity();
  report::RunInfo info;
  info.ground_truth = true_drive(20);
  const json frames = page_data(page(record, info))["frames"];
  CHECK(frames["sigma_height_m"][7].is_null());
  CHECK(frames["sigma_position_m"][3 * 8].is_null());
  CHECK(frames["total_ms"][9].is_null());
}
