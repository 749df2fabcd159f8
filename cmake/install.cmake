include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_DATADIR}/cmake/antipode)
install(DIRECTORY include/antipode DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
install(TARGETS antipode EXPORT antipode-targets)
install(EXPORT antipode-targets NAMESPACE antipode:: DESTINATION ${package_dir} COMPONENT library)
configure_package_config_file(cmake/antipode-config.cmake.in ${PROJECT_BINARY_DIR}/antipode-config.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/antipode-config-version.cmake
  COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/antipode-config.cmake ${PROJECT_BINARY_DIR}/antipode-config-version.cmake
  DESTINATION ${package_dir} COMPONENT library)
