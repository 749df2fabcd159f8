// SPDX-License-Identifier: MIT
// Catch2 2.x needs its main compiled once; with 3.x Catch2::Catch2WithMain brings it and this file is not built.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
