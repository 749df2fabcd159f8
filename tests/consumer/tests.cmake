# One test for each way of using the library from another project (included by tests/CMakeLists.txt).
set(consumer_ways add_subdirectory FetchContent)
if(ANTIPODE_INSTALL)
  list(APPEND consumer_ways find_package)
endif()
foreach(way IN LISTS consumer_ways)
  add_test(NAME consumer_by_${way}
           COMMAND ${CMAKE_COMMAND} -D CONSUME_BY=${way} -D SOURCE_DIR=${PROJECT_SOURCE_DIR}
                   -D BUILD_DIR=${PROJECT_BINARY_DIR} -D WORK_DIR=${CMAKE_CURRENT_BINARY_DIR}/consumer_by_${way}
                   -D GENERATOR=${CMAKE_GENERATOR} -D COMPILER=${CMAKE_CXX_COMPILER}
                   -P ${CMAKE_CURRENT_LIST_DIR}/run.cmake)
endforeach()
