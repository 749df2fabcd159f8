// SPDX-License-Identifier: MIT
#pragma once

// Debian 12 ships Catch2 2.13, newer systems 3.x; the tests are written for both.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
using Catch::Detail::Approx;
#endif
