include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_DATADIR}/cmake/antipode)
install(DIRECTORY include/antipode DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
install(TARGETS antipode EXPORT antipode-targets)
install(EXPORT antipode-targets NAMESPACE antipode:: DESTINATION ${package_dir} COMPONENT library)
set(stereo_slam_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/antipode)  # an archive depends on the architecture, headers do not
configure_package_config_file(cmake/antipode-config.cmake.in ${PROJECT_BINARY_DIR}/antipode-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS stereo_slam_package_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/antipode-config-version.cmake
  COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/antipode-config.cmake ${PROJECT_BINARY_DIR}/antipode-config-version.cmake
  DESTINATION ${package_dir} COMPONENT library)

install(FILES package.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/antipode COMPONENT library)  # for the tools of ROS 2

# The SLAM for other programs: the component stereo_slam of the package.
function(antipode_install_stereo_slam)
  set(slam_dir ${PROJECT_SOURCE_DIR}/examples/stereo_slam)
  install(TARGETS stereo_slam_library EXPORT antipode-stereo_slam-targets ARCHIVE COMPONENT stereo_slam)
  install(EXPORT antipode-stereo_slam-targets NAMESPACE antipode:: DESTINATION ${stereo_slam_package_dir} COMPONENT stereo_slam)
  foreach(header stereo_slam.hpp core/stereo_camera.hpp core/types.hpp core/imu_readings.hpp core/inertial_estimate.hpp calibration/stereo_rig.hpp)
    cmake_path(GET header PARENT_PATH folder)
    install(FILES ${slam_dir}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/stereo_slam/${folder} COMPONENT stereo_slam)
  endforeach()
endfunction()
