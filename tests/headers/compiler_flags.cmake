# Fails unless the first error with flags that the library cannot work with says so, and it compiles with flags that people use.
# Tries COMPILER and, if installed, g++ and clang++. Arguments: COMPILER, SOURCE_DIR (of antipode), EIGEN_DIR, WORK_DIR.
set(no_nan "antipode needs NaN and infinity: compile without -ffast-math")
set(refused
  "-std=c++17|antipode needs C\\+\\+20: compile with -std=c\\+\\+20"
  "-std=c++20 -ffast-math|${no_nan}"
  "-std=c++20 -Ofast|${no_nan}"
  "-std=c++20 -O2 -ffinite-math-only|${no_nan}"
  "-std=c++20 -fno-exceptions|antipode reports invalid arguments by exceptions: compile without -fno-exceptions"
  "-std=c++20 -I ${WORK_DIR}/old|antipode needs Eigen 3.4 or later")
set(accepted
  "-std=c++2b -Werror"
  "-std=c++20 -O2 -ffast-math -fno-finite-math-only -fno-rtti -DNDEBUG -DEIGEN_DEFAULT_DENSE_INDEX_TYPE=int -DEIGEN_MAX_ALIGN_BYTES=0 -include complex.h")

# An Eigen of another version that comes first among the include folders.
file(WRITE ${WORK_DIR}/old/Eigen/Core "#define EIGEN_VERSION_AT_LEAST(x, y, z) (x <= 3 && y <= 3)\n")
file(WRITE ${WORK_DIR}/source.cpp "#include <antipode/antipode.hpp>\n")
set(compilers ${COMPILER})
foreach(name g++ clang++)
  find_program(found_${name} ${name})
  if(found_${name})
    list(APPEND compilers ${found_${name}})
  endif()
endforeach()
list(REMOVE_DUPLICATES compilers)

# The first error with the given flags in `first_error`; nothing if there is none.
macro(compile compiler flags)
  separate_arguments(arguments UNIX_COMMAND "${flags}")
  execute_process(
    COMMAND ${compiler} ${arguments} -Wfatal-errors -fsyntax-only -I ${SOURCE_DIR}/include -isystem ${EIGEN_DIR} ${WORK_DIR}/source.cpp
    RESULT_VARIABLE status ERROR_VARIABLE output OUTPUT_QUIET)
  string(REGEX MATCH "error: [^\n]*" first_error "${output}")
  if(NOT status EQUAL 0 AND NOT first_error)
    set(first_error "${output}")
  endif()
endmacro()

foreach(compiler ${compilers})
  foreach(case ${refused})
    string(REGEX REPLACE "[|].*" "" flags "${case}")
    string(REGEX REPLACE "^[^|]*[|]" "" expected "${case}")
    compile(${compiler} "${flags}")
    if(NOT first_error MATCHES "${expected}")
      message(SEND_ERROR "${compiler} ${flags}: the first error is\n  ${first_error}\nand not\n  ${expected}")
    endif()
  endforeach()
  foreach(flags ${accepted})
    compile(${compiler} "${flags}")
    if(first_error)
      message(SEND_ERROR "${compiler} ${flags}: ${first_error}")
    endif()
  endforeach()
endforeach()
