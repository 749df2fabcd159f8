# Configures, builds and runs the consumer in a fresh folder.
# Arguments: CONSUME_BY, SOURCE_DIR and BUILD_DIR (of antipode), WORK_DIR, GENERATOR, COMPILER.
file(REMOVE_RECURSE ${WORK_DIR})
set(options -D CONSUME_BY=${CONSUME_BY} -D CMAKE_BUILD_TYPE=Release -D CMAKE_CXX_COMPILER=${COMPILER})
if(CONSUME_BY STREQUAL "find_package")
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix
                  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  list(APPEND options -D antipode_ROOT=${WORK_DIR}/prefix)
else()
  list(APPEND options -D ANTIPODE_SOURCE_DIR=${SOURCE_DIR})
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/tests/consumer -B ${WORK_DIR}/build ${options}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK_DIR}/build COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK_DIR}/build/consumer COMMAND_ERROR_IS_FATAL ANY)
