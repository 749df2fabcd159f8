// SPDX-License-Identifier: MIT
// The module antipode: poses, and Gaussian densities of poses, with numpy arrays as matrices.
#include <algorithm>
#include <array>
#include <optional>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/operators.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

#include <antipode/distributions/covariance_conventions.hpp>
#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_fusion.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

namespace py = pybind11;
using namespace antipode;

namespace {

using Pose = DualQuaternion<double>;
using Density = PoseGaussian<double>;
using Fusion = PoseFusion<Density>;
using PoseMatrix = Matrix<double, 4>;
using P6 = Matrix6<double>;
/// Numbers of a message of ROS, row by row.
using Rows6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

[[nodiscard]] Pose pose_of(const PoseMatrix& T) {
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw std::invalid_argument("the last row of a pose is not 0 0 0 1");
  return Pose::from_matrix(Matrix3<double>(T.topLeftCorner<3, 3>()),
                           Vector3<double>(T.topRightCorner<3, 1>()));
}

}  // namespace

/// A 4x4 array is taken where a pose is asked for. Unlike with py::implicitly_convertible, one that is no
/// pose raises the error that says why.
template <>
class pybind11::detail::type_caster<Pose> : public pybind11::detail::type_caster_base<Pose> {
 public:
  bool load(py::handle source, bool convert) {
    if (type_caster_base<Pose>::load(source, convert)) return true;
    if (!convert || !py::isinstance<py::array>(source)) return false;
    make_caster<PoseMatrix> matrix;
    if (!matrix.load(source, true)) return false;
    of_matrix_ = pose_of(cast_op<const PoseMatrix&>(matrix));
    value = &of_matrix_;
    return true;
  }

 private:
  Pose of_matrix_;
};

namespace {

[[nodiscard]] PoseMatrix matrix_of(const Pose& pose) { return pose.isometry().matrix(); }

[[nodiscard]] P6 or_zero(const std::optional<P6>& cross) { return cross.value_or(P6::Zero()); }

/// Points as rows, n x 3, or one point.
[[nodiscard]] py::array_t<double> mapped(const Pose& pose, py::array_t<double> points) {
  if (points.ndim() < 1 || points.ndim() > 2 || points.shape(points.ndim() - 1) != 3)
    throw std::invalid_argument("points are not an array n x 3, nor one of 3 numbers");
  points = py::array_t<double>(points.attr("copy")());
  const py::ssize_t count = points.size() / 3;
  double* numbers = points.mutable_data();
  for (py::ssize_t i = 0; i < count; ++i) {
    Eigen::Map<Vector3<double>> point(numbers + 3 * i);
    point = pose * Vector3<double>(point);
  }
  return points;
}

[[nodiscard]] Rows6 ros_covariance(const Density& x) {
  return Eigen::Map<const Rows6>(to_ros_covariance(x).data());
}

[[nodiscard]] Density from_ros(const Pose& pose, const py::array_t<double>& covariance) {
  const auto flat = py::array_t<double>(covariance.attr("ravel")());
  std::array<double, 36> rows{};
  if (static_cast<std::size_t>(flat.size()) != rows.size())
    throw std::invalid_argument("a covariance of ROS has " + std::to_string(flat.size()) +
                                " numbers, not 36");
  std::copy_n(flat.data(), rows.size(), rows.begin());
  return from_ros_covariance(pose, rows);
}

[[nodiscard]] py::array_t<double> samples(const Density& x, std::size_t count, std::uint64_t seed) {
  py::array_t<double> matrices({static_cast<py::ssize_t>(count), py::ssize_t{4}, py::ssize_t{4}});
  std::mt19937_64 random(seed);
  double* to = matrices.mutable_data();
  for (std::size_t i = 0; i < count; ++i, to += 16)
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{to} = matrix_of(sample(x, random));
  return matrices;
}

template <class Value>
[[nodiscard]] std::string printed(const char* name, const Value& value) {
  std::ostringstream stream;
  stream << name << '(' << value << ')';
  return stream.str();
}

void add_pose(py::module_& module) {
  py::class_<Pose>(module, "Pose",
                   "A pose, or a rigid motion. A 4x4 matrix is taken wherever one is asked for.")
      .def(py::init<>(), "The identity.")
      .def(py::init(&pose_of), py::arg("matrix"), "From a 4x4 matrix.")
      .def(py::init([](const Vector4<double>& rotation, const Vector3<double>& translation) {
             return Pose::from_rotation_translation(rotation, translation);
           }),
           py::arg("rotation"), py::arg("translation"),
           "From a unit quaternion (w, x, y, z) and a translation.")
      .def_static(
          "exp", [](const Vector6<double>& twist) { return Pose::exp(twist); }, py::arg("twist"),
          "The screw motion of a twist: rotation (rad), then translation (m).")
      .def("log", &Pose::log, "The twist of which this pose is exp.")
      .def("inverse", [](const Pose& pose) { return Pose(pose.inverse()); })
      .def("adjoint", &Pose::adjoint, "6x6: Ad(T), with T exp(xi) T^-1 = exp(Ad(T) xi)")
      .def(py::self * py::self)
      .def("map", &mapped, py::arg("points"), "Maps a point, or points as rows n x 3.")
      .def_property_readonly("matrix", &matrix_of, "4x4")
      .def_property_readonly("rotation", &Pose::rotation, "the unit quaternion (w, x, y, z)")
      .def_property_readonly("translation", &Pose::translation)
      .def("__repr__", [](const Pose& pose) { return printed("Pose", pose); });
}

void add_density(py::module_& module) {
  py::class_<Density>(module, "PoseGaussian",
                      "The density of pose exp(xi), xi ~ N(0, covariance): rotation (rad) first, then "
                      "translation (m), in the axes of the body.")
      .def(py::init([](const Pose& pose, const P6& covariance) {
             return Density{pose, covariance};
           }),
           py::arg("pose") = Pose(), py::arg("covariance") = P6(P6::Zero()))
      .def_readonly("pose", &Density::pose)
      .def_property_readonly("covariance", [](const Density& x) { return x.covariance; })
      .def("__repr__", [](const Density& x) { return printed("PoseGaussian", x.pose); });
  py::class_<Fusion>(module, "PoseFusion", "What two estimates of one pose say together.")
      .def_readonly("density", &Fusion::density)
      .def_readonly("converged", &Fusion::converged, "if not, do not use the density")
      .def_readonly("iterations", &Fusion::iterations)
      .def_readonly("mahalanobis_squared", &Fusion::mahalanobis_squared,
                    "of the difference of both: chi-square with 6 degrees of freedom if they are consistent")
      .def_readonly("log_evidence", &Fusion::log_evidence);
}

void add_algebra(py::module_& module) {
  module.def(
      "compose",
      [](const Density& x, const Density& y, const std::optional<P6>& cross) {
        return compose(x, y, or_zero(cross));
      },
      py::arg("x"), py::arg("y"), py::arg("cross") = py::none(),
      "The density of x y. `cross` is E[a b^T] of their errors; None if they are independent.");
  module.def(
      "inverse", [](const Density& x) { return inverse(x); }, py::arg("x"),
      "The density of the inverse of x.");
  module.def(
      "relative_pose",
      [](const Density& x, const Density& y, const std::optional<P6>& cross) {
        return relative_pose(x, y, or_zero(cross));
      },
      py::arg("x"), py::arg("y"), py::arg("cross") = py::none(),
      "The density of x^-1 y. Without `cross` it is too wide if both come from the same map.");
  module.def(
      "fuse", [](const Density& a, const Density& b) { return fuse(a, b); }, py::arg("a"), py::arg("b"),
      "The density of a pose, given two independent estimates of it.");
  module.def(
      "mahalanobis_squared", [](const Density& x, const Pose& pose) { return mahalanobis_squared(x, pose); },
      py::arg("x"), py::arg("pose"),
      "Chi-square with 6 degrees of freedom for draws of x; the NEES of an estimate.");
  module.def("sample", &samples, py::arg("x"), py::arg("count"), py::arg("seed") = 0,
             "Draws as matrices, count x 4 x 4.");
}

/// The covariances of other libraries.
void add_conventions(py::module_& module) {
  const auto x = py::arg("x");
  const auto pose = py::arg("pose");
  const auto covariance = py::arg("covariance");
  module.def("to_gtsam_covariance", &to_gtsam_covariance<double>, x, "Of gtsam.Pose3, 6x6.");
  module.def("from_gtsam_covariance", &from_gtsam_covariance<double>, pose, covariance);
  module.def("to_sophus_covariance", &to_sophus_covariance<double>, x,
             "Of Sophus and manif, 6x6: translation first.");
  module.def("from_sophus_covariance", &from_sophus_covariance<double>, pose, covariance);
  module.def("to_left_covariance", &to_left_covariance<double>, x, "Of exp(xi) T, 6x6: rotation first.");
  module.def("from_left_covariance", &from_left_covariance<double>, pose, covariance);
  module.def("to_ros_covariance", &ros_covariance, x,
             "Of geometry_msgs/PoseWithCovariance, 6x6: position first, along the axes of the parent; "
             ".ravel() has the 36 numbers of the message.");
  module.def("from_ros_covariance", &from_ros, pose, covariance,
             "From the 36 numbers of the message, or as 6x6.");
}

}  // namespace

PYBIND11_MODULE(antipode, module) {
  module.doc() =
      "Poses and Gaussian densities of poses. Functions raise ValueError, with the value that is wrong.";
  add_pose(module);
  add_density(module);
  add_algebra(module);
  add_conventions(module);
}
