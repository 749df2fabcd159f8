// SPDX-License-Identifier: MIT
#include "stereo_slam/report/page.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <nlohmann/json.hpp>

#include "stereo_slam/report/page_files.hpp"

namespace stereo_slam::report {
namespace {

constexpr std::string_view kOpen = "{{";
constexpr std::string_view kClose = "}}";

/// Scripts that page.html includes by name; the other scripts are modules.
constexpr std::array<std::string_view, 2> kClassicScripts = {"loader.js", "uPlot.iife.min.js"};

[[nodiscard]] std::string_view content_of(std::string_view name) {
  const auto files = page_files();
  const auto file = std::ranges::find_if(files, [&](auto& one) { return one.name == name; });
  if (file == files.end()) throw std::logic_error(fmt::format("the page has no file {}", name));
  return file->content;
}

/// JSON in which '<' is escaped: "</script>" in a text does not end the element that holds the data. Bytes
/// that are no UTF-8 are replaced.
void write_data(std::ostream& stream, const nlohmann::json& data) {
  const std::string text = data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::size_t written = 0;
  for (auto at = text.find('<'); at != std::string::npos; at = text.find('<', written)) {
    stream << std::string_view(text).substr(written, at - written) << "\\u003c";
    written = at + 1;
  }
  stream << std::string_view(text).substr(written);
}

void write_modules(std::ostream& stream) {
  for (const auto& file : page_files()) {
    const bool is_module = file.name.ends_with(".js") && std::ranges::count(kClassicScripts, file.name) == 0;
    if (is_module)
      fmt::print(stream, "<script type=\"text/plain\" data-module=\"{}\">\n{}</script>\n", file.name,
                 file.content);
  }
}

void write_part(std::ostream& stream, std::string_view name, std::string_view generator,
                const nlohmann::json& data) {
  if (name == "generator") {
    stream << generator;
  } else if (name == "data") {
    write_data(stream, data);
  } else if (name == "modules") {
    write_modules(stream);
  } else {
    stream << content_of(name);
  }
}

}  // namespace

void write_page(std::ostream& stream, std::string_view generator, const nlohmann::json& data) {
  std::string_view rest = content_of("page.html");
  for (auto open = rest.find(kOpen); open != std::string_view::npos; open = rest.find(kOpen)) {
    const auto close = rest.find(kClose, open);
    stream << rest.substr(0, open);
    write_part(stream, rest.substr(open + kOpen.size(), close - open - kOpen.size()), generator, data);
    rest.remove_prefix(close + kClose.size());
  }
  stream << rest;
}

bool is_page_of(std::string_view generator, std::string_view beginning) {
  constexpr std::string_view kMember = "{{generator}}";
  const std::string_view page = content_of("page.html");
  const std::string_view before = page.substr(0, page.find(kMember));
  return beginning.starts_with(before) && beginning.substr(before.size()).starts_with(generator);
}

}  // namespace stereo_slam::report
