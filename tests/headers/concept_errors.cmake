# Fails unless the first error of each mistake in concept_errors.cpp names what is missing.
# Arguments: COMPILER (GCC), SOURCE_DIR (of antipode), EIGEN_DIR, WORK_DIR.
set(expected_0 "")
set(expected_1 "quadratic_update: the log-likelihood must be callable as Scalar\\(state\\)")
set(expected_2 "quadratic_update: the log-likelihood must be callable .* the model as h\\(state, i\\)")
set(expected_3 "quadratic_update: the prior must be a PoseGaussian or a StateGaussian")
set(expected_4 "quadratic_update: the rule must be a GaussianRule of the dimension of the state")
set(expected_5 "linearized_update: the model must be callable as h\\(state, i\\)")
set(expected_6 "gauss_newton_update: the model must be callable as h\\(state, i, J\\)")
set(expected_7 "progressive_update: the log-likelihood must be callable as Scalar\\(pose\\)")
set(expected_8 "PoseFilter::update: the filter takes .* if it linearises, GaussianMeasurements only")
set(expected_9 "PoseFilter::update: the filter takes a log-likelihood, callable as Scalar\\(state\\)")
set(expected_10 "linearized_update: the measurements must have size\\(\\) and, by index, the members z and R")
set(expected_11 "progressive_update: the prior must be a BinghamGaussian")
set(expected_12 "quadratic_update: for states of more than 18 dimensions pass a GaussianRule")
# The library is parsed once.
file(MAKE_DIRECTORY ${WORK_DIR})
set(compile ${COMPILER} -std=c++20 -I ${SOURCE_DIR}/include -isystem ${EIGEN_DIR})
execute_process(COMMAND ${compile} -x c++-header ${SOURCE_DIR}/include/antipode/antipode.hpp -o ${WORK_DIR}/antipode.hpp.gch
                COMMAND_ERROR_IS_FATAL ANY)
foreach(mistake RANGE 12)
  execute_process(
    COMMAND ${compile} -fsyntax-only -fmax-errors=1 -D MISTAKE=${mistake} -include ${WORK_DIR}/antipode.hpp
            ${SOURCE_DIR}/tests/headers/concept_errors.cpp
    RESULT_VARIABLE status ERROR_VARIABLE output OUTPUT_QUIET)
  string(REGEX MATCH "error: [^\n]*" first_error "${output}")
  if("${expected_${mistake}}" STREQUAL "")
    if(NOT status EQUAL 0)
      message(SEND_ERROR "what is right does not compile: ${first_error}")
    endif()
  elseif(NOT first_error MATCHES "${expected_${mistake}}")
    message(SEND_ERROR "mistake ${mistake}: the first error is\n  ${first_error}\nand not\n  ${expected_${mistake}}")
  endif()
endforeach()
