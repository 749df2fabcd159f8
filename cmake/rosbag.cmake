# rosbag_storage of ROS 1 as the target antipode_rosbag, where librosbag-storage-dev is installed. Its own CMake files are not used: they
# look for ament and pluginlib, which reading a bag does not need.
include(CheckCXXSourceCompiles)
find_path(ROSBAG_INCLUDE_DIR rosbag/bag.h)
set(include_dirs ${ROSBAG_INCLUDE_DIR})
# Headers that rosbag/bag.h includes; their places differ between distributions.
foreach(header pluginlib/class_loader.hpp class_loader/class_loader.hpp rcutils/macros.h rcpputils/shared_library.hpp
        ament_index_cpp/get_resource.hpp)
  cmake_path(GET header PARENT_PATH folder)
  find_path(ROSBAG_${folder}_DIR ${header} PATH_SUFFIXES ${folder})
  if(ROSBAG_${folder}_DIR)
    list(APPEND include_dirs ${ROSBAG_${folder}_DIR})
  endif()
endforeach()
list(REMOVE_DUPLICATES include_dirs)
set(libraries)
foreach(name rosbag_storage roscpp_serialization rostime cpp_common console_bridge)
  find_library(ROSBAG_${name}_LIBRARY ${name})
  list(APPEND libraries ${ROSBAG_${name}_LIBRARY})
endforeach()
mark_as_advanced(ROSBAG_INCLUDE_DIR)

if(ROSBAG_INCLUDE_DIR AND NOT "${libraries}" MATCHES "NOTFOUND")
  set(CMAKE_REQUIRED_INCLUDES ${include_dirs})
  set(CMAKE_REQUIRED_LIBRARIES ${libraries})
  set(CMAKE_REQUIRED_FLAGS ${CMAKE_CXX20_STANDARD_COMPILE_OPTION})
  check_cxx_source_compiles("
    #include <rosbag/bag.h>
    #include <rosbag/view.h>
    int main() { rosbag::Bag bag; rosbag::View view(bag); return static_cast<int>(view.size()); }" ROSBAG_COMPILES)
  unset(CMAKE_REQUIRED_INCLUDES)
  unset(CMAKE_REQUIRED_LIBRARIES)
  unset(CMAKE_REQUIRED_FLAGS)
endif()
if(ROSBAG_COMPILES)
  add_library(antipode_rosbag INTERFACE)
  target_include_directories(antipode_rosbag SYSTEM INTERFACE ${include_dirs})
  target_link_libraries(antipode_rosbag INTERFACE ${libraries})
else()
  message(STATUS "stereo_slam without bags of ROS 1: librosbag-storage-dev is not installed")
endif()
