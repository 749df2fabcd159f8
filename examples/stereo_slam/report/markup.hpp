// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace stereo_slam::report {

/// Any text as content or attribute of HTML and SVG: & < > " ' become entities, control characters, which XML
/// does not allow, the replacement character.
[[nodiscard]] std::string escape_markup(std::string_view text);

}  // namespace stereo_slam::report
