// SPDX-License-Identifier: MIT
#include "simulator/recording/euroc_writer.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ostream.h>

namespace stereo_slam::simulator {

std::int64_t euroc_stamp_ns(std::size_t frame, double fps) {
  constexpr std::int64_t kBegin_ns = 1'000'000'000'000'000'000;
  return kBegin_ns + std::llround(1e9 * static_cast<double>(frame) / fps);
}

void write_euroc_rows(std::ostream& stream, std::size_t frames, double fps) {
  fmt::print(stream, "#timestamp [ns],filename\n");
  for (std::size_t i = 0; i < frames; ++i) fmt::print(stream, "{0},{0}.png\n", euroc_stamp_ns(i, fps));
}

void write_euroc_sensor(std::ostream& stream, const Lens& lens, const Eigen::Isometry3d& T_body_camera,
                        double fps) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = T_body_camera.matrix();
  fmt::print(
      stream,
      "sensor_type: camera\ncomment: rendered\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\nrate_hz: {}\n"
      "resolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}]\n"
      "distortion_model: {}\ndistortion_coefficients: [{}]\n",
      fmt::join(T.data(), T.data() + T.size(), ", "), fps, lens.width_px, lens.height_px, lens.fx, lens.fy,
      lens.cx, lens.cy, lens.distortion == Distortion::kEquidistant ? "equidistant" : "radial-tangential",
      fmt::join(lens.coefficients, ", "));
}

void write_euroc_truth(std::ostream& stream, const CameraPath& body_path, const std::vector<ImuTruth>& imu,
                       double fps) {
  fmt::print(stream,
             "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
             "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
             "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
             "b_a_RS_S_z [m s^-2]\n");
  for (std::size_t i = 0; i < body_path.size(); ++i) {
    const Eigen::Vector3d p = body_path[i].translation();
    const Eigen::Quaterniond q(body_path[i].linear());
    const auto& [v, bw, ba] = imu.empty() ? ImuTruth{} : imu[i];
    fmt::print(stream, "{},{},{},{},{},{},{},{},", euroc_stamp_ns(i, fps), p.x(), p.y(), p.z(), q.w(), q.x(),
               q.y(), q.z());
    fmt::print(stream, "{},{},{},{},{},{},{},{},{}\n", v.x(), v.y(), v.z(), bw.x(), bw.y(), bw.z(), ba.x(),
               ba.y(), ba.z());
  }
}

}  // namespace stereo_slam::simulator
