# Included after project(): a package that is not in ALLOWED_PACKAGES stops the configuration.
macro(find_package name)
  if(NOT "${name}" IN_LIST ALLOWED_PACKAGES)
    message(FATAL_ERROR "find_package(${name}), but only ${ALLOWED_PACKAGES} are there")
  endif()
  _find_package(${name} ${ARGN})
endmacro()
