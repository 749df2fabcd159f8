// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace stereo_slam::report {

/// Escapes text for content and attributes of HTML and SVG: & < > " ' become entities; control characters,
/// which XML forbids, become the replacement character.
[[nodiscard]] std::string escape_markup(std::string_view text);

}  // namespace stereo_slam::report
