# Installs the SLAM to a prefix of its own, builds examples/camera_poses with what is there, and runs it on a rendered sequence.
# Arguments: WAY (installed or packaged), SOURCE_DIR and BUILD_DIR (of antipode), WORK_DIR, GENERATOR, COMPILER, PROGRAM.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})

if(WAY STREQUAL "packaged")
  find_program(dpkg_deb dpkg-deb)
  if(NOT dpkg_deb)
    message("skipped: no dpkg-deb")
    return()
  endif()
  execute_process(COMMAND ${CMAKE_CPACK_COMMAND} -G DEB --config ${BUILD_DIR}/CPackConfig.cmake -B ${WORK_DIR}/packages
                  WORKING_DIRECTORY ${BUILD_DIR} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  # Every package is complete, and holds nothing of another one.
  set(prefix ${WORK_DIR}/unpacked/usr)
  foreach(package libantipode-dev libstereo-slam-dev stereo-slam)
    file(GLOB deb ${WORK_DIR}/packages/${package}_*.deb)
    list(LENGTH deb count)
    if(NOT count EQUAL 1)
      message(FATAL_ERROR "${package}: ${count} packages instead of one")
    endif()
    execute_process(COMMAND ${dpkg_deb} --fsys-tarfile ${deb} COMMAND tar -t OUTPUT_VARIABLE files COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND ${dpkg_deb} -f ${deb} Depends OUTPUT_VARIABLE depends COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND ${dpkg_deb} -x ${deb} ${WORK_DIR}/unpacked COMMAND_ERROR_IS_FATAL ANY)
    set(files_of_${package} ${files})
    set(depends_of_${package} ${depends})
  endforeach()
  function(require list pattern)
    if(NOT "${${list}}" MATCHES "${pattern}")
      message(FATAL_ERROR "${list} is without ${pattern}:\n${${list}}")
    endif()
  endfunction()
  function(refuse list pattern)
    if("${${list}}" MATCHES "${pattern}")
      message(FATAL_ERROR "${list} is with ${pattern}:\n${${list}}")
    endif()
  endfunction()
  require(files_of_libantipode-dev "usr/include/antipode/antipode.hpp")
  refuse(files_of_libantipode-dev "stereo_slam")
  require(files_of_libstereo-slam-dev "usr/include/stereo_slam/stereo_slam.hpp")
  require(files_of_libstereo-slam-dev "libstereo_slam.a")
  refuse(files_of_libstereo-slam-dev "usr/include/antipode|slam/slam.hpp|bin/")
  require(files_of_stereo-slam "usr/bin/stereo_slam")
  require(files_of_stereo-slam "usr/lib/.*antipode/stereo_slam_codecs")
  refuse(files_of_stereo-slam "usr/include|[.]a\n")
  require(depends_of_libantipode-dev "libeigen3-dev")
  require(depends_of_libstereo-slam-dev "libantipode-dev.*libceres-dev.*libopencv-dev")
  require(depends_of_stereo-slam "libopencv-core.*libyaml-cpp")
  execute_process(COMMAND ${prefix}/bin/stereo_slam --version COMMAND_ERROR_IS_FATAL ANY)
else()
  set(prefix ${WORK_DIR}/prefix)
  foreach(component library stereo_slam)
    execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --component ${component} --prefix ${prefix}
                    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endif()

execute_process(
  COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/examples/camera_poses -B ${WORK_DIR}/build
          -D CMAKE_BUILD_TYPE=Release -D CMAKE_CXX_COMPILER=${COMPILER} -D antipode_ROOT=${prefix}
          -D CMAKE_FIND_PACKAGE_PREFER_CONFIG=ON
  COMMAND_ERROR_IS_FATAL ANY)
file(STRINGS ${WORK_DIR}/build/CMakeCache.txt found REGEX "^antipode_DIR")
if(NOT found MATCHES "=${prefix}")
  message(FATAL_ERROR "another antipode was found than the one in ${prefix}: ${found}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK_DIR}/build COMMAND_ERROR_IS_FATAL ANY)

# A pose and its sigma for each of the frames, from their first lines on.
set(frames 8)
execute_process(COMMAND ${PROGRAM} simulate --quiet --output ${WORK_DIR}/town --frames ${frames} --scale 0.35
                COMMAND_ERROR_IS_FATAL ANY)
file(STRINGS ${WORK_DIR}/town/calib.txt projection REGEX "^P1:")
string(REPLACE " " ";" P "${projection}")
list(GET P 1 fx)
list(GET P 3 cx)
list(GET P 6 fy)
list(GET P 7 cy)
execute_process(COMMAND ${PROGRAM} info --dataset ${WORK_DIR}/town OUTPUT_VARIABLE info COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "baseline +([0-9.]+) m" ignored "${info}")
file(WRITE ${WORK_DIR}/calibration.yaml
  "rectified: {fx: ${fx}, fy: ${fy}, cx: ${cx}, cy: ${cy}, baseline_m: ${CMAKE_MATCH_1}}\n")
execute_process(
  COMMAND ${WORK_DIR}/build/camera_poses ${WORK_DIR}/calibration.yaml ${WORK_DIR}/town/image_0/%06d.png ${WORK_DIR}/town/image_1/%06d.png
  OUTPUT_VARIABLE poses COMMAND_ERROR_IS_FATAL ANY)
message("${poses}")
string(REGEX MATCHALL "OK +[-0-9. ]+ m [+]- 0[.][0-9]+ m, 0[.][0-9]+ deg" ok "${poses}")
list(LENGTH ok tracked)
math(EXPR expected "${frames} - 1")  # the first one starts the map
if(NOT tracked EQUAL expected)
  message(FATAL_ERROR "${tracked} poses with a sigma instead of ${expected}")
endif()
