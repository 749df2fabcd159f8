# antipode_add_consumer_test(NAME BLOCK): another project gets antipode by the CMake code in the file BLOCK. The blocks are those of
# the documentation (tests/docs).
function(antipode_add_consumer_test name block)
  add_test(NAME ${name}
           COMMAND ${CMAKE_COMMAND} -D BLOCK=${block} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D BUILD_DIR=${PROJECT_BINARY_DIR}
                   -D WORK_DIR=${PROJECT_BINARY_DIR}/tests/consumer/${name} -D GENERATOR=${CMAKE_GENERATOR}
                   -D COMPILER=${CMAKE_CXX_COMPILER} -P ${PROJECT_SOURCE_DIR}/tests/consumer/run.cmake)
endfunction()

# With nothing but Eigen to be found, the library is configured, installed and used from where it was installed.
add_test(NAME library_needs_only_eigen
         COMMAND ${CMAKE_COMMAND} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D WORK_DIR=${PROJECT_BINARY_DIR}/tests/consumer/only_eigen
                 -D GENERATOR=${CMAKE_GENERATOR} -D COMPILER=${CMAKE_CXX_COMPILER}
                 -P ${CMAKE_CURRENT_LIST_DIR}/only_eigen.cmake)
get_target_property(antipode_eigen_dirs Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
list(GET antipode_eigen_dirs 0 antipode_eigen_dir)
add_test(NAME library_accepts_later_versions_of_eigen
         COMMAND ${CMAKE_COMMAND} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D EIGEN_DIR=${antipode_eigen_dir} -D GENERATOR=${CMAKE_GENERATOR}
                 -D COMPILER=${CMAKE_CXX_COMPILER} -D WORK_DIR=${PROJECT_BINARY_DIR}/tests/consumer/eigen_versions
                 -P ${CMAKE_CURRENT_LIST_DIR}/eigen_versions.cmake)

# examples/camera_poses, a project of its own, is built with the installed SLAM and run on a rendered sequence. NAME says how the
# SLAM was installed: by `installed` (cmake --install) or `packaged` (the Debian packages of cpack, unpacked).
if(ANTIPODE_BUILD_EXAMPLES AND ANTIPODE_INSTALL AND ANTIPODE_BUILD_SLOW_TESTS)
  foreach(way installed packaged)
    add_test(NAME stereo_slam_${way}_for_others
             COMMAND ${CMAKE_COMMAND} -D WAY=${way} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D BUILD_DIR=${PROJECT_BINARY_DIR}
                     -D WORK_DIR=${PROJECT_BINARY_DIR}/tests/consumer/stereo_slam_${way} -D GENERATOR=${CMAKE_GENERATOR}
                     -D COMPILER=${CMAKE_CXX_COMPILER} -D PROGRAM=$<TARGET_FILE:stereo_slam>
                     -P ${CMAKE_CURRENT_LIST_DIR}/stereo_slam.cmake)
    set_tests_properties(stereo_slam_${way}_for_others PROPERTIES LABELS slow)
  endforeach()
endif()
