// SPDX-License-Identifier: MIT
#include "simulator/world/route.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kCell_m = 12.0;
/// Parts of the path closer than this are on the same street.
constexpr double kSameStreet_m = 6.0;

[[nodiscard]] int cell_index(double x) { return static_cast<int>(std::floor(x / kCell_m)); }

[[nodiscard]] long long cell_key(int i, int j) {
  return (static_cast<long long>(i) << 32) ^ static_cast<unsigned>(j);
}

[[nodiscard]] GroundPoint on_ground(const Vector3d& p) { return {p.x(), p.z()}; }

/// Horizontal viewing direction of a camera; straight ahead for one that looks up or down.
[[nodiscard]] GroundPoint viewing_direction(const Eigen::Isometry3d& T_world_camera) {
  const GroundPoint forward = on_ground(T_world_camera.linear().col(2));
  return forward.norm() > 1e-3 ? GroundPoint(forward.normalized()) : GroundPoint::UnitY();
}

/// Positions a metre apart along the path; a path that hardly moves gives its first position only.
[[nodiscard]] std::vector<Vector3d> resample(const CameraPath& path) {
  std::vector<Vector3d> points{path.front().translation()};
  for (const Eigen::Isometry3d& pose : path) {
    const Vector3d target = pose.translation();
    for (;;) {
      const double gap = (on_ground(target) - on_ground(points.back())).norm();
      if (gap < Route::kSpacing_m) break;
      points.push_back(points.back() + Route::kSpacing_m / gap * (target - points.back()));
    }
  }
  return points;
}

/// The street below a path and straight on beyond its ends: station i is i metres from the first position.
class Course {
 public:
  Course(const CameraPath& path, double camera_height_m)
      : points_(resample(path)),
        first_view_(viewing_direction(path.front())),
        camera_height_m_(camera_height_m) {}

  [[nodiscard]] int last() const { return static_cast<int>(points_.size()) - 1; }

  [[nodiscard]] Route::Station station(int i) const {
    const int nearest = std::clamp(i, 0, last());
    const Vector3d& point = points_[static_cast<std::size_t>(nearest)];
    Route::Station station;
    station.direction = direction(nearest);
    station.position = on_ground(point) + (i - nearest) * Route::kSpacing_m * station.direction;
    station.ground_y = point.y() + camera_height_m_;
    station.arc_m = i * Route::kSpacing_m;
    return station;
  }

  /// How many stations the street goes on beyond an end before it meets another part of itself; at most
  /// `run_out_m`. `step` is -1 at the beginning of the path and 1 at its end.
  [[nodiscard]] int run_out(int end, int step, double run_out_m) const {
    const GroundPoint begin = station(end).position;
    int count = 0;
    for (; (count + 1) * Route::kSpacing_m <= run_out_m; ++count) {
      const GroundPoint next = station(end + (count + 1) * step).position;
      const bool meets = std::any_of(points_.begin(), points_.end(), [&](const Vector3d& point) {
        const double gone_m = (on_ground(point) - begin).norm();
        return gone_m > kSameStreet_m && (on_ground(point) - next).norm() < kSameStreet_m;
      });
      if (meets) break;
    }
    return count;
  }

 private:
  [[nodiscard]] GroundPoint direction(int i) const {
    if (last() < 1) return first_view_;
    const auto& before = points_[static_cast<std::size_t>(std::clamp(i - 2, 0, last()))];
    const auto& after = points_[static_cast<std::size_t>(std::clamp(i + 2, 0, last()))];
    const GroundPoint step = on_ground(after - before);
    return step.norm() > 1e-6 ? GroundPoint(step.normalized()) : first_view_;
  }

  std::vector<Vector3d> points_;
  GroundPoint first_view_;
  double camera_height_m_;
};

[[nodiscard]] const CameraPath& not_empty(const CameraPath& path) {
  if (path.empty()) throw std::invalid_argument("a route needs at least one pose");
  return path;
}

/// Whether two stations are at one place, and the path went elsewhere between them.
[[nodiscard]] bool is_other_pass(const Route::Station& a, const Route::Station& b) {
  return std::abs(a.arc_m - b.arc_m) > 4.0 * kSameStreet_m &&
         (a.position - b.position).norm() < kSameStreet_m;
}

}  // namespace

double GroundBox::distance(const GroundPoint& point) const {
  const GroundPoint offset = point - centre;
  const double outside_length = std::max(std::abs(offset.dot(along)) - half_length_m, 0.0);
  const double outside_width = std::max(std::abs(offset.dot(across())) - half_width_m, 0.0);
  return std::hypot(outside_length, outside_width);
}

bool GroundBox::overlaps(const GroundBox& other) const {
  const GroundPoint offset = other.centre - centre;
  const auto reach = [](const GroundBox& box, const GroundPoint& axis) {
    return box.half_length_m * std::abs(box.along.dot(axis)) +
           box.half_width_m * std::abs(box.across().dot(axis));
  };
  const auto separated = [&](const GroundPoint& axis) {
    return std::abs(offset.dot(axis)) > reach(*this, axis) + reach(other, axis);
  };
  return !(separated(along) || separated(across()) || separated(other.along) || separated(other.across()));
}

Route::Route(const CameraPath& path, double camera_height_m, double run_out_m) : run_out_m_(run_out_m) {
  const Course course(not_empty(path), camera_height_m);
  const int first = -course.run_out(0, -1, run_out_m);
  const int last = course.last() + course.run_out(course.last(), 1, run_out_m);
  for (int i = first; i <= last; ++i) stations_.push_back(course.station(i));
  index_stations();
  lower_to_lowest_pass();
}

void Route::index_stations() {
  low_ = high_ = stations_.front().position;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station& station = stations_[i];
    low_ = low_.cwiseMin(station.position);
    high_ = high_.cwiseMax(station.position);
    for_near(station.position, kSameStreet_m, [&](const Station& other) {
      if (station.arc_m > other.arc_m && is_other_pass(station, other)) station.first_pass = false;
    });
    cells_[cell_key(cell_index(station.position.x()), cell_index(station.position.y()))].push_back(i);
  }
}

void Route::lower_to_lowest_pass() {
  // Stations ahead and behind do not count: on a slope they are lower anyway.
  std::vector<double> lowest;
  for (const Station& station : stations_) {
    double y = station.ground_y;
    for_near(station.position, kSameStreet_m, [&](const Station& other) {
      const double ahead_m = (other.position - station.position).dot(station.direction);
      if (is_other_pass(station, other) && std::abs(ahead_m) <= kSpacing_m) y = std::max(y, other.ground_y);
    });
    lowest.push_back(y);
  }
  for (std::size_t i = 0; i < stations_.size(); ++i) stations_[i].ground_y = lowest[i];
}

template <class Visit>
void Route::for_near(const GroundPoint& point, double radius_m, Visit visit) const {
  for (int i = cell_index(point.x() - radius_m); i <= cell_index(point.x() + radius_m); ++i) {
    for (int j = cell_index(point.y() - radius_m); j <= cell_index(point.y() + radius_m); ++j) {
      const auto cell = cells_.find(cell_key(i, j));
      if (cell == cells_.end()) continue;
      for (const std::size_t index : cell->second) visit(stations_[index]);
    }
  }
}

double Route::distance(const GroundPoint& point, double limit_m) const {
  double nearest = limit_m;
  for_near(point, limit_m,
           [&](const Station& station) { nearest = std::min(nearest, (station.position - point).norm()); });
  return nearest;
}

bool Route::is_clear(const GroundBox& box, double clearance_m) const {
  bool clear = true;
  for_near(box.centre, std::hypot(box.half_length_m, box.half_width_m) + clearance_m,
           [&](const Station& station) { clear = clear && box.distance(station.position) >= clearance_m; });
  return clear;
}

Route::Station Route::at_arc(double arc_m) const {
  const double position = (arc_m - stations_.front().arc_m) / kSpacing_m;
  const auto last = static_cast<double>(stations_.size() - 1);
  const double inside = std::clamp(position, 0.0, last);
  const auto index = std::min(static_cast<std::size_t>(inside), stations_.size() - 2);
  const double t = inside - static_cast<double>(index);
  const Station& a = stations_[index];
  const Station& b = stations_[index + 1];
  Station station = t < 0.5 ? a : b;
  station.direction = ((1.0 - t) * a.direction + t * b.direction).normalized();
  station.position =
      (1.0 - t) * a.position + t * b.position + (position - inside) * kSpacing_m * station.direction;
  station.ground_y = (1.0 - t) * a.ground_y + t * b.ground_y;
  station.arc_m = arc_m;
  return station;
}

}  // namespace stereo_slam::simulator
