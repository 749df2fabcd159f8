# Warnings for antipode's own targets only: link antipode_warnings PRIVATE; nothing of it reaches a user.
add_library(antipode_warnings INTERFACE)
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  target_compile_options(antipode_warnings INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wcast-align -Wunused -Woverloaded-virtual
    -Wdouble-promotion -Wold-style-cast
    # In a unity build the names of one source are in sight of the next.
    $<$<BOOL:${ANTIPODE_QUICK_BUILD}>:-Wno-shadow>
    $<$<BOOL:${ANTIPODE_WARNINGS_AS_ERRORS}>:-Werror>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12 reports false positives inside Eigen's fixed-size kernels at -O3.
    target_compile_options(antipode_warnings INTERFACE -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overread)
    # The compiler collects its garbage from 1 GB on, not from 128 MB: 5 % of its time on templates.
    target_compile_options(antipode_warnings INTERFACE "SHELL:--param ggc-min-heapsize=1000000")
  endif()
endif()
