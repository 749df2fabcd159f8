// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>

#include <nlohmann/json_fwd.hpp>

namespace stereo_slam::report {

/// Writes a self-contained HTML page that shows `data`: page/page.html with the scripts and styles of page/
/// and vendor/ in it. No text of the data can become markup.
void write_page(std::ostream& stream, const nlohmann::json& data);

}  // namespace stereo_slam::report
