// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "simulator/rendering/projection.hpp"
#include "simulator/rendering/scene.hpp"

namespace stereo_slam::simulator {

/// Draws a scene as a pinhole camera sees it.
///
/// Visibility is decided at `samples` points of every pixel by depth; colour is filtered analytically over
/// the pixel and weighted by the number of samples at which a face is visible. The image is computed tile by
/// tile on the calling thread: use one renderer per thread.
class Renderer {
 public:
  /// The scene must outlive the renderer. `samples` is 4, 8 or 16; throws std::invalid_argument otherwise, or
  /// for a camera without area or focal length.
  Renderer(const Scene& scene, const PinholeCamera& camera, int samples);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Grey values (0 is black, 255 white, larger values are possible) of the scene together with `moving`
  /// faces.
  [[nodiscard]] cv::Mat1f render(const Eigen::Isometry3d& T_world_camera,
                                 const std::vector<Face>& moving = {});

 private:
  struct Buffers;

  void project(const Eigen::Isometry3d& T_camera_world, const std::vector<Face>& moving);
  void bin();

  const Scene* scene_;
  PinholeCamera camera_;
  int samples_;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace stereo_slam::simulator
