// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace stereo_slam::report {

/// What a page says of its origin.
constexpr std::string_view kReportGenerator = "stereo_slam run";
constexpr std::string_view kComparisonGenerator = "stereo_slam compare";

/// Writes a self-contained HTML page that shows `data`: page/page.html with the scripts and styles of page/
/// and vendor/ in it. No text of the data can become markup.
void write_page(std::ostream& stream, std::string_view generator, const nlohmann::json& data);

/// Whether a file with this beginning is a page of the generator.
[[nodiscard]] bool is_page_of(std::string_view generator, std::string_view beginning);

}  // namespace stereo_slam::report
