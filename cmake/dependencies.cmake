# The library needs Eigen only; everything else belongs to the examples, tests and benchmarks.
# Eigen's version file accepts only requests of its own major version, so that the version is checked here: 3.4 and 5 do.
find_package(Eigen3 REQUIRED NO_MODULE)
if(DEFINED Eigen3_VERSION AND Eigen3_VERSION VERSION_LESS 3.4)
  message(FATAL_ERROR "antipode needs Eigen 3.4 or later; ${Eigen3_DIR} has ${Eigen3_VERSION}. Set Eigen3_DIR to the folder of another Eigen3Config.cmake")
endif()

set(opencv_components core imgproc features2d video calib3d)
if(ANTIPODE_BUILD_EXAMPLES OR ANTIPODE_BUILD_BENCHMARKS)
  find_package(Ceres 2.1 REQUIRED)
  find_package(OpenCV 4.5 REQUIRED COMPONENTS ${opencv_components} imgcodecs videoio)
elseif(ANTIPODE_BUILD_TESTS)
  # The tests of the adapters; without the adapted library they are left out.
  find_package(Ceres 2.1 QUIET)
  find_package(OpenCV 4.5 QUIET COMPONENTS ${opencv_components} imgcodecs videoio)
endif()
if(ANTIPODE_BUILD_EXAMPLES)
  find_package(CLI11 REQUIRED)
  find_package(yaml-cpp REQUIRED)
  find_package(fmt REQUIRED)
  find_package(nlohmann_json REQUIRED)
  find_package(JPEG REQUIRED)
  find_package(Threads REQUIRED)
  find_package(ZLIB REQUIRED)
  # Linked by its name, so that the exported target of the SLAM has no path in it.
  find_library(ANTIPODE_LIBDEFLATE deflate REQUIRED)
  # Bags of ROS 2.
  find_library(ANTIPODE_LIBLZ4 lz4 REQUIRED)
  find_library(ANTIPODE_LIBZSTD zstd REQUIRED)
endif()
if(ANTIPODE_BUILD_TESTS OR ANTIPODE_BUILD_BENCHMARKS)
  find_package(Catch2 REQUIRED)
  find_package(nlohmann_json REQUIRED)
endif()
