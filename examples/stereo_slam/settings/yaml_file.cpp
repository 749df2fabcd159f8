// SPDX-License-Identifier: MIT
#include "stereo_slam/settings/yaml_file.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include "stereo_slam/io/input_file.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const YAML::Mark& mark, const std::string& what) {
  fail_at(file, std::max(mark.line + 1, 1), what);
}

constexpr auto kTab = "the line begins with a tab; indent with spaces";
constexpr auto kIndentation =
    "the indentation differs from that of the lines before it; align what belongs together";
constexpr auto kOpenQuote = "a quote is opened and not closed; add the second one, or remove the first";

/// An error message that says what is wrong and what to do, in place of yaml-cpp's message.
[[nodiscard]] std::string in_words(const std::string& message) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 15> kWords = {{
      {"EOF in scalar", kOpenQuote},
      {"end of sequence flow", "a list is opened with [ and not closed; add the ]"},
      {"end of map flow", "a map is opened with { and not closed; add the }"},
      {"end of map not", kIndentation},
      {"end of sequence not", kIndentation},
      {"illegal tab", kTab},
      {"illegal map value",
       "the line is indented unlike the one before, or has two colons; write one `key: value` a line"},
      {"illegal map key", "a ? begins a line, which marks a key; write `key: value`"},
      {"illegal flow end", "a ] or } closes nothing, or what the other one opened; remove or replace it"},
      {"illegal block entry",
       "a list begins with - where none can be; write it in lines of its own, or in [ ]"},
      {"unknown token",
       "a value begins with a character that YAML reserves, such as @ or %; put it in quotes"},
      {"anchor not found", "an & stands without a name; put text that begins with it in quotes"},
      {"alias not found", "a * stands without a name; put text that begins with it in quotes"},
      {"unknown escape character", "a \\ in double quotes begins no known character; write two, or use '"},
      {"the referenced anchor", "refers to another part of the file (*); write the value out"},
  }};
  for (const auto& [part, words] : kWords) {
    if (message.find(part) != std::string::npos) return std::string(words);
  }
  return message;
}

/// Whether the first visible character of a line of the text comes after a tab; lines count from 0.
[[nodiscard]] bool begins_with_tab(std::string_view text, int line) {
  for (; line > 0; --line) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find_first_not_of(" \t")).find('\t') != text.npos;
}

/// Refuses aliases, deep nesting and unclosed quotes, before a document tree is built.
class Guard : public YAML::EventHandler {
 public:
  Guard(const fs::path& file, std::string_view text) : file_(file), text_(text) {}

  /// The parser stops before a character that begins no value, and finds an empty document there again and
  /// again.
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (mark.pos == document_pos_) fail(file_, mark, "not valid YAML: no value begins with this character");
    document_pos_ = mark.pos;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    fail(file_, mark, "refers to another part of the file (*); write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override {
    if (mark.is_null() || mark.pos < 0 || static_cast<std::size_t>(mark.pos) >= text_.size()) return;
    const auto rest = text_.substr(static_cast<std::size_t>(mark.pos));
    if ((rest[0] == '"' || rest[0] == '\'') && rest.find(rest[0], 1) == rest.npos)
      fail(file_, mark, kOpenQuote);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void enter(const YAML::Mark& mark) {
    constexpr int kDeepest = 16;
    if (++depth_ > kDeepest) fail(file_, mark, fmt::format("is nested deeper than {} levels", kDeepest));
  }

  const fs::path& file_;
  std::string_view text_;
  int depth_ = 0;
  int document_pos_ = -1;
};

/// Refuses a key without a name, or `images.` without the name of the setting.
void check_name(const fs::path& file, const YAML::Node& key) {
  const std::string& name = key.Scalar();  // empty for a null
  if (name.empty()) fail(file, key.Mark(), "a key has no name; write `key: value`");
  if (name.back() == '.')
    fail(file, key.Mark(),
         fmt::format("{} ends with a point; add the name after it, or remove the point", name));
}

void check_keys(const fs::path& file, const YAML::Node& node) {
  if (node.IsSequence()) {
    for (const auto& part : node) check_keys(file, part);
  }
  if (!node.IsMap()) return;
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (entry.first.IsScalar() || entry.first.IsNull()) check_name(file, entry.first);
    if (entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
      fail(file, entry.first.Mark(),
           fmt::format("{0} is given twice{1}", entry.first.Scalar(), decimals_advice(entry.first.Scalar())));
    check_keys(file, entry.second);
  }
}

/// The file's text, without byte order mark. The line %YAML:1.0 before the first value of OpenCV's files is
/// not valid YAML and becomes empty.
[[nodiscard]] std::string text_of(const fs::path& file) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  std::string text = read_file(file, kMostYamlBytes);
  require_no_zero_byte(file, text);
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  std::size_t line = 0;
  while (line < text.size() && (text[line] == '#' || text[line] == '\r' || text[line] == '\n'))
    line = std::min(text.find('\n', line), text.size() - 1) + 1;
  if (text.compare(line, 6, "%YAML:") == 0) text.erase(line, text.find('\n', line) - line);
  return text;
}

/// The number of the file's documents. Throws for what load_yaml_documents() refuses before it builds a tree.
[[nodiscard]] std::size_t count_documents(const fs::path& file, const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Guard guard(file, text);
  std::size_t count = 0;
  while (parser.HandleNextDocument(guard)) ++count;
  return count;
}

}  // namespace

std::vector<YAML::Node> load_yaml_documents(const fs::path& file) {
  const std::string text = text_of(file);
  try {
    if (count_documents(file, text) == 0) return {YAML::Node()};
    std::vector<YAML::Node> documents = YAML::LoadAll(text);
    for (const auto& document : documents) check_keys(file, document);
    return documents;
  } catch (const YAML::Exception& error) {
    const bool tab = begins_with_tab(text, error.mark.line);
    fail(file, error.mark, fmt::format("not valid YAML: {}", tab ? kTab : in_words(error.msg)));
  }
}

std::string_view decimals_advice(std::string_view key) {
  const bool digits = key.find_first_not_of("0123456789") == std::string_view::npos;
  return digits && !key.empty() ? "; decimals have a point: 0.5, not 0,5" : "";
}

YAML::Node load_yaml_file(const fs::path& file) {
  const auto documents = load_yaml_documents(file);
  if (documents.size() > 1) {
    fail(file, "holds several documents; remove the line `---` between them");
  }
  return documents.front();
}

}  // namespace stereo_slam
