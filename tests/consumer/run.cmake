# Configures, builds and runs the consumer in a fresh folder, with antipode available in every way that a block may ask for.
# Arguments: BLOCK (a file), SOURCE_DIR and BUILD_DIR (of antipode), WORK_DIR, GENERATOR, COMPILER.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR}/project)
file(COPY ${SOURCE_DIR}/tests/consumer/CMakeLists.txt ${SOURCE_DIR}/tests/consumer/main.cpp DESTINATION ${WORK_DIR}/project)
file(CREATE_LINK ${SOURCE_DIR} ${WORK_DIR}/project/antipode SYMBOLIC)

file(STRINGS ${BLOCK} installed REGEX "find_package")
if(installed)
  set(components library)
  if(installed MATCHES "stereo_slam")
    list(APPEND components stereo_slam)
  endif()
  foreach(component ${components})
    execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --component ${component} --prefix ${WORK_DIR}/prefix
                    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endif()
execute_process(
  COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${WORK_DIR}/project -B ${WORK_DIR}/build -D BLOCK=${BLOCK}
          -D CMAKE_BUILD_TYPE=None -D CMAKE_CXX_COMPILER=${COMPILER}
          -D antipode_ROOT=${WORK_DIR}/prefix -D FETCHCONTENT_SOURCE_DIR_ANTIPODE=${SOURCE_DIR} ${OPTIONS}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK_DIR}/build COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK_DIR}/build/app COMMAND_ERROR_IS_FATAL ANY)
