# With ANTIPODE_QUICK_BUILD, a full build takes a third of the time: sources of a folder are compiled together, so that what they
# share is instantiated once (a unity build); headers that many sources parse are parsed once; and a quicker linker is used, if
# there is one. docs/results/build.md has the times.
if(ANTIPODE_QUICK_BUILD)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
  if(PROJECT_IS_TOP_LEVEL AND CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    find_program(ANTIPODE_LINKER NAMES ld.lld ld.gold)
    mark_as_advanced(ANTIPODE_LINKER)
    if(ANTIPODE_LINKER)
      get_filename_component(linker ${ANTIPODE_LINKER} LAST_EXT)
      string(SUBSTRING ${linker} 1 -1 linker)
      add_link_options(-fuse-ld=${linker})
    endif()
  endif()
endif()

# antipode_precompile_headers(NAME HEADERS header... LINK target... [OPTIONS option...]): the headers, compiled as the target NAME.
function(antipode_precompile_headers name)
  if(NOT ANTIPODE_QUICK_BUILD)
    return()
  endif()
  cmake_parse_arguments(arg "" "" "HEADERS;LINK;OPTIONS" ${ARGN})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// A target needs a source.\n")
  add_library(${name} OBJECT ${source})
  target_link_libraries(${name} PRIVATE antipode_warnings ${arg_LINK})
  target_compile_options(${name} PRIVATE ${arg_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
endfunction()

# antipode_reuse_headers(NAME target...): the targets begin with the headers of NAME. They must be compiled with the same options;
# more definitions and include folders do no harm. Compilers refuse what does not fit. An empty NAME means none.
function(antipode_reuse_headers name)
  if(ANTIPODE_QUICK_BUILD AND name)
    foreach(target ${ARGN})
      target_precompile_headers(${target} REUSE_FROM ${name})
    endforeach()
  endif()
endfunction()
