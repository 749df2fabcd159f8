# Configures antipode where only the packages in ALLOWED_PACKAGES can be found: the library with Eigen, its tests with Catch2 and
# nlohmann-json besides. Installs the library to a prefix of its own and builds the consumer with what is there.
# Arguments: SOURCE_DIR (of antipode), WORK_DIR, GENERATOR, COMPILER.
file(REMOVE_RECURSE ${WORK_DIR})
set(guard -D CMAKE_PROJECT_INCLUDE=${SOURCE_DIR}/tests/consumer/allowed_packages.cmake)
set(toolchain -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER})

# Only what is part of the library is there to be configured.
file(COPY ${SOURCE_DIR}/CMakeLists.txt ${SOURCE_DIR}/cmake ${SOURCE_DIR}/include ${SOURCE_DIR}/package.xml DESTINATION ${WORK_DIR}/source)
execute_process(
  COMMAND ${CMAKE_COMMAND} ${toolchain} ${guard} -D ALLOWED_PACKAGES=Eigen3 -S ${WORK_DIR}/source -B ${WORK_DIR}/library
          -D ANTIPODE_BUILD_EXAMPLES=OFF -D ANTIPODE_BUILD_TESTS=OFF
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK_DIR}/library COMMAND_ERROR_IS_FATAL ANY)

file(WRITE ${WORK_DIR}/block.cmake "find_package(antipode REQUIRED)\ntarget_link_libraries(app PRIVATE antipode::antipode)\n")
set(BLOCK ${WORK_DIR}/block.cmake)
set(BUILD_DIR ${WORK_DIR}/library)
set(OPTIONS ${guard} "-DALLOWED_PACKAGES=antipode\;Eigen3")
set(outer_work_dir ${WORK_DIR})
set(WORK_DIR ${outer_work_dir}/consumer)
include(${SOURCE_DIR}/tests/consumer/run.cmake)

execute_process(
  COMMAND ${CMAKE_COMMAND} ${toolchain} ${guard} "-DALLOWED_PACKAGES=Eigen3;Catch2;nlohmann_json;Ceres;OpenCV"
          -D CMAKE_DISABLE_FIND_PACKAGE_Ceres=ON -D CMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON -S ${SOURCE_DIR}
          -B ${outer_work_dir}/tests -D ANTIPODE_BUILD_EXAMPLES=OFF
  COMMAND_ERROR_IS_FATAL ANY)
