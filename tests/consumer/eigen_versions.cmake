# Configures the library and a project that uses it with Eigen's headers under other version numbers: 3.4 and 5 are accepted, 3.3 is
# refused with the version and its folder. Arguments: SOURCE_DIR (of antipode), EIGEN_DIR, WORK_DIR, GENERATOR, COMPILER.
include(CMakePackageConfigHelpers)
file(REMOVE_RECURSE ${WORK_DIR})
file(COPY ${SOURCE_DIR}/CMakeLists.txt ${SOURCE_DIR}/cmake ${SOURCE_DIR}/include ${SOURCE_DIR}/package.xml DESTINATION ${WORK_DIR}/source)
file(WRITE ${WORK_DIR}/project/CMakeLists.txt "cmake_minimum_required(VERSION 3.22)\nproject(app LANGUAGES CXX)\nfind_package(antipode REQUIRED)\n")
# Some projects have such a file, without the target that Eigen's own defines.
file(WRITE ${WORK_DIR}/modules/FindEigen3.cmake "set(Eigen3_FOUND TRUE)\n")

set(CMAKE_SIZEOF_VOID_P 8)
foreach(version 3.3.9 3.4.0 3.4.90 5.0.1)
  set(dir ${WORK_DIR}/eigen-${version}/share/eigen3/cmake)
  write_basic_package_version_file(${dir}/Eigen3ConfigVersion.cmake VERSION ${version} COMPATIBILITY SameMajorVersion ARCH_INDEPENDENT)
  file(WRITE ${dir}/Eigen3Config.cmake "message(STATUS \"the Eigen ${version} of this test\")\n"
    "if(NOT TARGET Eigen3::Eigen)\n  add_library(Eigen3::Eigen INTERFACE IMPORTED)\n"
    "  target_include_directories(Eigen3::Eigen INTERFACE ${EIGEN_DIR})\nendif()\n")
endforeach()

# Whether CMake configures `source` with the Eigen of the given version; its messages in `output`.
function(configure source build version)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${source} -B ${build} -D CMAKE_CXX_COMPILER=${COMPILER} ${ARGN}
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REGEX REPLACE "[ \n]+" " " output "${output}")
  set(refusal "antipode needs Eigen 3.4 or later; [^ ]*/eigen-${version}/share/eigen3/cmake has ${version}")
  if(version VERSION_LESS 3.4)
    if(status EQUAL 0 OR NOT output MATCHES "${refusal}")
      message(SEND_ERROR "Eigen ${version} is not refused by ${source}: ${output}")
    endif()
  elseif(NOT status EQUAL 0 OR NOT output MATCHES "the Eigen ${version} of this test")
    message(SEND_ERROR "Eigen ${version} is not accepted by ${source}: ${output}")
  endif()
endfunction()

set(library_options -D ANTIPODE_BUILD_EXAMPLES=OFF -D ANTIPODE_BUILD_TESTS=OFF)
foreach(version 3.3.9 3.4.0 3.4.90 5.0.1)
  set(prefix ${WORK_DIR}/eigen-${version})
  configure(${WORK_DIR}/source ${WORK_DIR}/library-${version} ${version} ${library_options} -D Eigen3_DIR=${prefix}/share/eigen3/cmake)
endforeach()
execute_process(COMMAND ${CMAKE_COMMAND} --install ${WORK_DIR}/library-5.0.1 --prefix ${WORK_DIR}/prefix OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
foreach(version 3.3.9 3.4.0 3.4.90 5.0.1)
  set(prefix ${WORK_DIR}/eigen-${version})
  configure(${WORK_DIR}/project ${WORK_DIR}/app-${version} ${version} -D Eigen3_ROOT=${prefix}
            -D antipode_ROOT=${WORK_DIR}/prefix -D CMAKE_MODULE_PATH=${WORK_DIR}/modules)
endforeach()
