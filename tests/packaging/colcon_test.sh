#!/usr/bin/env bash
# A checkout in a workspace of ROS 2 is built and installed by colcon, and found by another package there. Exit status 77: colcon, or
# its extensions for ROS and CMake, are not installed. ROS itself is not needed.
#
#   colcon_test.sh SOURCE_DIR [slam]        slam: with the SLAM (some CPU minutes), which the other package uses
set -euo pipefail
source_dir=$(realpath "$1")
with=${2:-headers}
if ! command -v colcon >/dev/null || ! /usr/bin/python3 -c 'import colcon_ros, colcon_cmake' 2>/dev/null; then
  echo "skipped: apt-get install colcon python3-colcon-cmake python3-colcon-ros"
  exit 77
fi
workspace=$(mktemp -d)
trap 'rm -rf "$workspace"' EXIT
mkdir -p "$workspace/src/consumer"
ln -s "$source_dir" "$workspace/src/antipode"
cd "$workspace/src/consumer"
cat >package.xml <<'END'
<?xml version="1.0"?>
<package format="3">
  <name>consumer</name>
  <version>0.0.1</version>
  <description>A package that uses antipode</description>
  <maintainer email="me@example.org">me</maintainer>
  <license>MIT</license>
  <depend>antipode</depend>
  <export><build_type>cmake</build_type></export>
</package>
END
options=(-DANTIPODE_BUILD_TESTS=OFF)
if [ "$with" = slam ]; then
  cp "$source_dir"/examples/camera_poses/{CMakeLists.txt,main.cpp} .
  echo 'install(TARGETS camera_poses)' >>CMakeLists.txt
  options+=("-DCMAKE_CXX_COMPILER=${CXX:-clang++}" -DCMAKE_BUILD_TYPE=Release)
else
  cp "$source_dir/tests/consumer/main.cpp" .
  # As the documentation has it.
  {
    echo 'cmake_minimum_required(VERSION 3.22)'
    echo 'project(consumer LANGUAGES CXX)'
    echo 'add_executable(app main.cpp)'
    sed -n '/^find_package(antipode/,/^```/{/^```/!p}' "$source_dir/docs/building.md"
    echo 'install(TARGETS app)'
  } >CMakeLists.txt
  options+=(-DANTIPODE_BUILD_EXAMPLES=OFF)
fi

cd "$workspace"
colcon --log-base log build --cmake-args "${options[@]}"
[ -f install/antipode/share/antipode/package.xml ] # for `ros2 pkg` and rosdep
if [ "$with" = slam ]; then
  install/antipode/bin/stereo_slam simulate --quiet --output DIR --frames 5 --scale 0.35
  install/antipode/bin/stereo_slam run --quiet --dataset DIR --output OUT
  fx=$(awk '{ print $2; exit }' DIR/calib.txt) cx=$(awk '{ print $4; exit }' DIR/calib.txt) cy=$(awk '{ print $8; exit }' DIR/calib.txt)
  echo "rectified: {fx: $fx, fy: $fx, cx: $cx, cy: $cy, baseline_m: 0.5}" >calibration.yaml
  install/consumer/bin/camera_poses calibration.yaml DIR/image_0/%06d.png DIR/image_1/%06d.png | grep 'landmarks'
else
  install/consumer/bin/app
fi
# What the scripts of the workspace set up is found, without a path by colcon.
(
  set +u
  # shellcheck disable=SC1091
  . install/setup.sh
  cmake -S src/consumer -B again
)
