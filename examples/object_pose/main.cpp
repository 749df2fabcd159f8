// SPDX-License-Identifier: MIT
// The command line. Exit status: 0 for success, 1 if the input is invalid or determines no pose, 2 for wrong
// usage.
#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "belief.hpp"
#include "box_model.hpp"
#include "estimate.hpp"
#include "features.hpp"
#include "flags.hpp"
#include "render.hpp"
#include "table.hpp"

namespace {

namespace fs = std::filesystem;
using namespace object_pose;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

struct Arguments {
  std::uint64_t seed = 1;
  fs::path left, right, model;
  std::optional<fs::path> written_model, output;
  EstimateSettings estimate;
};

/// The model and the images, loaded or rendered.
struct Input {
  ModelFile model;
  StereoImages images;
  std::optional<Pose> truth;  ///< T_camera_object, of a rendered scene
};

void add_options(CLI::App& app, Arguments& args) {
  app.add_option("--seed", args.seed, "random seed of the rendered box, its pose and the noise")
      ->capture_default_str()
      ->type_name("S");
  auto* left = app.add_option("--left", args.left, "rectified left image; without it, a box is rendered");
  auto* right = app.add_option("--right", args.right, "rectified right image")->needs(left);
  auto* model = app.add_option("--model", args.model,
                               "folder with model.yaml: the cameras, the box, the textures of its faces");
  left->needs(right)->needs(model)->type_name("IMAGE");
  right->type_name("IMAGE");
  model->needs(left)->type_name("DIR");
  app.add_option("--write-model", args.written_model,
                 "write the model and both images, as a template for your own")
      ->type_name("DIR");
  app.add_option("--output", args.output, "write an image of every stage: stage_01.png ...")
      ->type_name("DIR");
  app.add_option("--features", args.estimate.max_features, "number of features to fuse")
      ->check(CLI::Range(3, 40))
      ->capture_default_str();
  app.add_option("--components", args.estimate.max_components, "largest number of components after a fusion")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
}

Input load_or_render(const Arguments& args) {
  if (!args.left.empty()) {
    return {load_model(args.model), {load_image(args.left), load_image(args.right)}, std::nullopt};
  }
  Scene scene = render_scene({}, args.seed);
  return {{scene.camera, scene.box}, scene.images, scene.T_camera_object};
}

void write_input(const fs::path& folder, const Input& input) {
  write_model(folder, input.model);
  write_image(folder / "left_image.png", input.images.left);
  write_image(folder / "right_image.png", input.images.right);
}

void draw_stages(const fs::path& folder, const std::vector<Stage>& stages, const std::vector<Match>& matches,
                 const Input& input) {
  fs::create_directories(folder);
  const StageBackground background{input.images.left, input.model.camera, input.model.box.size_m, input.truth,
                                   input.truth.value_or(summarize(stages.back().after).pose)};
  for (std::size_t k = 0; k < stages.size(); ++k) {
    write_image(folder / fmt::format("stage_{:02}.png", k + 1),
                draw_stage(stages[k], matches[stages[k].match], background));
  }
}

void run(const Arguments& args) {
  const Input input = load_or_render(args);
  if (args.written_model) write_input(*args.written_model, input);
  const auto& [camera, box] = input.model;
  const FeatureModel model = learn_features(box);
  const std::vector<Match> matches = match_features(input.images, camera, model);
  const std::vector<Stage> stages = estimate_pose(matches, model, box.size_m, camera, args.estimate);
  fmt::print("{} features of the model, {} seen in both images\n", model.features.size(), matches.size());
  print_table(std::cout, {stages, model, matches, box, input.truth});
  if (args.output) draw_stages(*args.output, stages, matches, input);
  if (const std::size_t support = supporting_features(stages); support < 3) {
    throw std::runtime_error(
        fmt::format("features that agree on a pose: {}; at least three are needed", support));
  }
  print_pose(std::cout, stages.back().after, input.truth);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Estimates the pose of a textured box from SIFT features, by mixtures of projected Gaussians.",
               "object_pose");
  Arguments args;
  add_options(app, args);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  }
  try {
    run(args);
    return kDone;
  } catch (const std::exception& error) {
    fmt::print(std::cerr, "object_pose: {}\n", error.what());
    return kFailed;
  }
}
