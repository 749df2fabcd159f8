// SPDX-License-Identifier: MIT
#pragma once

// Ceres includes glog, which defines a CHECK of its own: Catch2's stays.
#pragma push_macro("CHECK")
#undef CHECK
#include <ceres/ceres.h>
#undef CHECK
#pragma pop_macro("CHECK")
