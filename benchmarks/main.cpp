// SPDX-License-Identifier: MIT
// Catch2 2.x measures only if its main is compiled with CATCH_CONFIG_ENABLE_BENCHMARKING, which that of the
// package is not; Catch2 3.x brings its own and does not need this file.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
