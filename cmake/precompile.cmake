# Headers that many sources parse are parsed once, with ANTIPODE_PRECOMPILE_HEADERS. docs/results/build.md says what it saves.

# antipode_precompile_headers(NAME HEADERS header... LINK target... [OPTIONS option...]): the headers, compiled as the target NAME.
function(antipode_precompile_headers name)
  if(NOT ANTIPODE_PRECOMPILE_HEADERS)
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
  if(ANTIPODE_PRECOMPILE_HEADERS AND name)
    foreach(target ${ARGN})
      target_precompile_headers(${target} REUSE_FROM ${name})
    endforeach()
  endif()
endfunction()
