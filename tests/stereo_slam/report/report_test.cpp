// SPDX-License-Identifier: MIT
#include "stereo_slam/report/report.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "stereo_slam/report/markup_check.hpp"
#include "stereo_slam/report/top_view.hpp"
#include "stereo_slam/report/trajectory_geometry.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

Pose at(const Vector3<double>& position) { return Pose::from_matrix(Matrix3<double>::Identity(), position); }

/// A drive along z, a metre a frame, whose position gets less certain.
RunRecord drive(std::size_t frames) {
  RunRecord record;
  for (std::size_t k = 0; k < frames; ++k) {
    const auto z = static_cast<double>(k);
    FrameResult result;
    result.index = k;
    result.status = k == 0 ? TrackingStatus::kInitializing : TrackingStatus::kOk;
    result.T_odometry_camera = at({0.01 * z, 0.0, z});
    result.features = 1000;
    result.nis = k == 0 ? 0.0 : 90.0 + 20.0 * std::sin(z);
    result.nis_dof = k == 0 ? 0 : 100;
    result.is_keyframe = k % 10 == 0;
    result.times = {{"features", 10.0 + std::sin(z)}, {"odometry", 5.0}};
    record.results.push_back(result);
    record.total_ms.push_back(16.0);
    record.resident_mb.push_back(200.0 + z);
    record.trajectory.push_back({at({0.0, 0.0, z}), 1e-6 * (z + 1.0) * Matrix6<double>::Identity()});
    record.map_points.push_back({{5.0 * std::sin(7.0 * z), -1.0, z}, 100});
  }
  return record;
}

std::string page(const RunRecord& record, const report::RunInfo& info = {}) {
  std::ostringstream text;
  report::write_report(text, record, info);
  return text.str();
}

std::string top_view(const RunRecord& record) {
  std::ostringstream text;
  report::write_top_view(text, record);
  return text.str();
}

}  // namespace

TEST_CASE("A report of any length is one well-formed page without external resources", "[report]") {
  for (const std::size_t frames : {0U, 1U, 2U, 300U}) {
    CAPTURE(frames);
    const auto text = page(drive(frames));
    CHECK(markup_fault(text).empty());
    CHECK_THAT(text, Catch::StartsWith("<!DOCTYPE html>") && Catch::EndsWith("</html>\n"));
    for (const auto* part : {"http", "src=", "url(", "<script", "nan", "inf\""}) {
      CAPTURE(part);
      CHECK(text.find(part) == std::string::npos);
    }
  }
}

TEST_CASE("Five thousand frames with a million landmarks fit into two megabytes", "[report]") {
  auto record = drive(5000);
  for (std::size_t i = 0; i < 1'000'000; ++i) {
    const auto a = static_cast<double>(i);
    record.map_points.push_back({{300.0 * std::sin(a), 0.0, 2500.0 + 2500.0 * std::sin(1.7 * a)}, 9});
  }
  for (std::size_t k = 100; k < 1100; ++k) record.loops.push_back({k, k - 100, false, 40, 2.0, true});
  CHECK(page(record).size() < 2'000'000);
}

TEST_CASE("Text of paths and errors is escaped", "[report]") {
  report::RunInfo info{
      .header = {.state = "failed", .error = "no <img> \"left\""}, .dataset = "", .preset = "a&b"};
  info.dataset = "/data/<script>alert('x')</script>";
  const auto text = page(drive(3), info);
  CHECK(text.find("<script") == std::string::npos);
  CHECK_THAT(text, Catch::Contains("no &lt;img&gt; &quot;left&quot;") && Catch::Contains("a&amp;b") &&
                       Catch::Contains("&lt;script&gt;alert(&#39;x&#39;)"));
  CHECK(markup_fault(text).empty());
}

TEST_CASE("The report contains the final state and the scores of the run", "[report]") {
  auto record = drive(101);
  record.results[50].status = TrackingStatus::kLost;
  record.loops = {{90, 10, false, 55, 3.25, true}, {95, 12, false, 31, 99.0, false}};
  const auto text =
      page(record, {{.state = "interrupted", .error = "", .seconds = 2.5}, "/data/street", "paper"});
  for (const auto* part : {"interrupted", "<h1>street</h1>", "1 lost", "100.0 m", "16.0 ms", "paper",
                           "1 refused", "<td>90</td><td>10</td><td>55</td><td>3.2</td><td>accepted</td>"}) {
    CAPTURE(part);
    CHECK_THAT(text, Catch::Contains(part));
  }
}

TEST_CASE("The top view has a loop for every loop, and both paths if one was accepted", "[report]") {
  auto record = drive(101);
  CHECK(count_of(top_view(record), "uncorrected") == 0);
  record.loops = {{95, 12, false, 31, 99.0, false}};
  CHECK(count_of(top_view(record), "class=\"track uncorrected\"") == 0);
  record.loops.push_back({90, 10, false, 55, 3.25, true});
  record.loops.push_back({500, 10, false, 55, 3.25, true});  // of a frame that is not there
  const auto text = top_view(record);
  CHECK(count_of(text, "class=\"track uncorrected\"") == 1);
  CHECK(count_of(text, "<g class=\"loop\">") == 1);
  CHECK(count_of(text, "<g class=\"loop refused\">") == 1);
}

TEST_CASE("Frames of every status are drawn in their colour, single ones too", "[report]") {
  auto record = drive(101);
  CHECK(count_of(top_view(record), "track lost") == 0);
  record.results[50].status = TrackingStatus::kLost;
  record.results[60].status = TrackingStatus::kWeak;
  const auto text = top_view(record);
  CHECK(count_of(text, "<path class=\"track lost\" d=\"M") == 1);
  CHECK(count_of(text, "<path class=\"track weak\" d=\"M") == 1);
}

TEST_CASE("Landmarks outside the view and a standing camera give a valid report", "[report]") {
  auto record = drive(200);
  for (auto& estimate : record.trajectory) estimate.pose = Pose::identity();
  record.map_points.push_back({{1e7, 0.0, -1e7}, 9});
  const auto text = top_view(record);
  CHECK(markup_fault(text).empty());
  CHECK(count_of(text, "<ellipse") <= 24);
}

TEST_CASE("The ellipse of one standard deviation turns with the camera", "[report]") {
  PoseGaussian estimate;
  estimate.covariance.diagonal() << 0, 0, 0, 0.04, 0.01, 0.25;  // 0.2 m aside, 0.5 m ahead
  const auto ahead = report::sigma_ellipse(estimate);
  CHECK(ahead.half_axes_m.isApprox(Vector2<double>(0.5, 0.2)));
  CHECK(std::abs(std::cos(ahead.angle_rad)) < 1e-12);
  const double turn_rad = 0.3;  // about y: from z towards x
  estimate.pose = Pose::exp((Vector6<double>() << 0.0, turn_rad, 0.0, 0.0, 0.0, 0.0).finished());
  const auto turned = report::sigma_ellipse(estimate);
  CHECK(turned.half_axes_m.isApprox(Vector2<double>(0.5, 0.2)));
  CHECK(std::abs(std::tan(turned.angle_rad)) == Approx(1.0 / std::tan(turn_rad)));
  CHECK(std::cos(turned.angle_rad) * std::sin(turned.angle_rad) > 0.0);
}
