# `cpack` in the build folder writes three Debian packages: the library's headers, the SLAM as a library, and the program.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the authors of antipode <https://example.org/antipode>")  # put your own here
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL library stereo_slam programs)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libantipode-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "Estimation on SE(3), header-only C++20 library\n Unit dual quaternions, Bingham and pose densities, filters.")

set(CPACK_DEBIAN_STEREO_SLAM_PACKAGE_NAME libstereo-slam-dev)
set(CPACK_DEBIAN_STEREO_SLAM_PACKAGE_DEPENDS
  "libantipode-dev (= ${PROJECT_VERSION}), libceres-dev, libopencv-dev, libyaml-cpp-dev, libfmt-dev, libdeflate-dev, zlib1g-dev")
set(CPACK_COMPONENT_STEREO_SLAM_DESCRIPTION "Stereo visual SLAM with covariances, for use in other programs\n Static library and headers.")

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME stereo-slam)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "Stereo visual SLAM with covariances\n The program stereo_slam: poses, covariances, maps and reports of stereo recordings and cameras.")

foreach(component library:libantipode-dev stereo_slam:libstereo-slam-dev programs:stereo-slam)
  string(REPLACE ":" ";" component ${component})
  list(GET component 1 package)
  list(GET component 0 component)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} RENAME copyright COMPONENT ${component})
endforeach()
foreach(vendored three uplot)
  install(FILES examples/stereo_slam/report/vendor/${vendored}/LICENSE
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stereo-slam RENAME copyright.${vendored} COMPONENT programs)
endforeach()
include(CPack)
