// SPDX-License-Identifier: MIT
#include <algorithm>
#include <set>
#include <sstream>

#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/schema.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

Settings load_text(const std::string& yaml, std::optional<std::string_view> preset = std::nullopt) {
  const TemporaryFolder folder;
  write_text(folder / "s.yaml", yaml);
  return load_settings(folder / "s.yaml", preset);
}

std::string load_error(const std::string& yaml) {
  return message_of([&] { (void)load_text(yaml); });
}

std::string as_yaml(const Settings& settings) {
  std::ostringstream text;
  write_settings(text, settings);
  return text.str();
}

}  // namespace

TEST_CASE("Every preset reads back from its own listing unchanged", "[settings][law]") {
  for (const auto& name : preset_names()) {
    CAPTURE(name);
    const auto listing = as_yaml(preset_settings(name));
    CHECK(as_yaml(load_text(listing)) == listing);
  }
}

TEST_CASE("Every setting of every preset lies in its own allowed range and reads back exactly",
          "[settings][law]") {
  for (const auto& name : preset_names()) {
    const Settings settings = preset_settings(name);
    for (const auto& field : settings_fields()) {
      CAPTURE(name, field.key, field.allowed);
      Settings copy = settings;
      CHECK(field.set(copy, field.get(settings)));
      CHECK(field.get(copy) == field.get(settings));
    }
  }
}

TEST_CASE("Text that is not a value of the setting is refused and changes nothing", "[settings][law]") {
  for (const auto& field : settings_fields()) {
    for (const auto* nonsense :
         {"", "abc", "nan", "inf", "-inf", "1e400", "99999999999999999999999", "-99999999", "1 2", "0x1"}) {
      CAPTURE(field.key, nonsense);
      Settings settings;
      CHECK_FALSE(field.set(settings, nonsense));
      CHECK(as_yaml(settings) == as_yaml(Settings{}));
    }
  }
}

TEST_CASE("Every setting has a unique key, a description and a range", "[settings]") {
  std::set<std::string> keys;
  for (const auto& field : settings_fields()) {
    CAPTURE(field.key);
    CHECK(keys.insert(field.key).second);
    CHECK_FALSE(field.doc.empty());
    CHECK_FALSE(field.allowed.empty());
  }
}

TEST_CASE("A file changes the settings that it names; the others keep the preset's values", "[settings]") {
  const Settings settings =
      load_text("seed: 9\nfeatures:\n  count: 700  # fewer\nkeyframes: {min_match_ratio: 0.5}\n");
  CHECK(settings.seed == 9);
  CHECK(settings.features.count == 700);
  CHECK(settings.keyframes.min_match_ratio == 0.5);
  CHECK(settings.keyframes.max_frames == Settings{}.keyframes.max_frames);
}

TEST_CASE("An empty file means the default preset", "[settings]") {
  CHECK(as_yaml(load_text("")) == as_yaml(preset_settings("default")));
  CHECK(as_yaml(load_text("# only a comment\n")) == as_yaml(preset_settings("default")));
}

TEST_CASE("The preset comes from the command line, else from the file; the file's values override it",
          "[settings]") {
  CHECK(load_text("preset: paper\n").preset == "paper");
  CHECK(load_text("preset: paper\n", "default").preset == "default");
  CHECK(load_text("seed: 3\n", "paper").preset == "paper");
  CHECK(load_text("preset: paper\nseed: 3\n").seed == 3);
  CHECK(as_yaml(load_text("preset: paper\n")) == as_yaml(preset_settings("paper")));
}

TEST_CASE("A value out of range is refused with file, line, key, value and range", "[settings]") {
  CHECK_THAT(load_error("seed: 1\nfeatures:\n  count: 3\n"),
             Catch::EndsWith("s.yaml:3: features.count is 3, but must be a whole number from 50 to 20000"));
  CHECK_THAT(load_error("features: {count: 3.5}"),
             Catch::Contains("features.count is 3.5, but must be a whole number"));
  CHECK_THAT(load_error("features: {count: many}"), Catch::Contains("features.count is many"));
  CHECK_THAT(load_error("features: {count: [1, 2]}"), Catch::Contains("features.count is [...]"));
  CHECK_THAT(load_error("features: {count: }"), Catch::Contains("features.count is nothing"));
  CHECK_THAT(load_error("keyframes: {min_match_ratio: .nan}"), Catch::Contains("a number from 0 to 1"));
  CHECK_THAT(load_error("stereo: {max_disparity_px: 9999}"),
             Catch::Contains("a whole number from 8 to 2000 px"));
  CHECK_THAT(load_error("preset: papr"),
             Catch::Contains("s.yaml:1: preset is papr, but must be one of: default, fast, paper"));
}

TEST_CASE("An unknown setting is refused; the message suggests the nearest known one", "[settings]") {
  CHECK_THAT(load_error("features:\n  cuont: 500\n"),
             Catch::EndsWith("s.yaml:2: unknown setting features.cuont; did you mean features.count?"));
  CHECK_THAT(load_error("feature: {count: 500}"),
             Catch::EndsWith("unknown setting feature; did you mean features?"));
  CHECK_THAT(load_error("count: 500"),
             Catch::EndsWith("unknown setting count; did you mean features.count?"));
  CHECK_THAT(load_error("keyframes: {min_match_ratio: 0,6}"),
             Catch::EndsWith("unknown setting keyframes.6; decimals have a point: 0.5, not 0,5"));
  CHECK_THAT(load_error("keyframes: {min_match_ratio: 0,6, max_flow_ratio: 0,6}"),
             Catch::EndsWith("6 is given twice; decimals have a point: 0.5, not 0,5"));
  CHECK_THAT(load_error("zzzzzzzzzzz: 1"), Catch::EndsWith("unknown setting zzzzzzzzzzz"));
}

TEST_CASE("A renamed setting is refused with its present name", "[settings]") {
  CHECK_THAT(load_error("rectification:\n  refine: false\n"),
             Catch::EndsWith("s.yaml:2: rectification.refine is called online_rectification.enabled now"));
  std::set<std::string_view> keys;
  for (const auto& field : settings_fields()) keys.insert(field.key);
  for (const auto& renamed : renamed_keys()) {
    CAPTURE(renamed.old_key);
    CHECK(keys.contains(renamed.key));
    CHECK_FALSE(keys.contains(renamed.old_key));
  }
}

TEST_CASE("A setting that is gone is refused with what took its place", "[settings]") {
  CHECK_THAT(load_error("map: {layout: global}"),
             Catch::Contains("map.layout is no setting any more: the preset decides"));
  CHECK_THAT(load_error("update:\n  method: none\n"),
             Catch::Contains("s.yaml:2: update.method is no setting"));
  CHECK_THAT(load_error("association: {flow_window_px: 15}"),
             Catch::EndsWith("association.flow_window_px is no setting any more: its value is that of the "
                             "preset; leave it out"));
  CHECK_THAT(
      load_error("map: {layout: global, max_baselines: 100, cell_px: 40}\nplace_recognition: {trees: 2}"),
      Catch::EndsWith("others have keyframes; neither are map.cell_px, place_recognition.trees"));
  CHECK_THAT(load_error("place_recognition:\nseed: 2\n"),
             Catch::EndsWith("s.yaml:1: place_recognition has no settings any more; leave it out"));
  CHECK_THAT(load_error("map:\nseed: 2\n"), Catch::Contains("map is a group of settings, not a value"));
  std::set<std::string_view> keys;
  for (const auto& field : settings_fields()) keys.insert(field.key);
  for (const auto& removed : removed_keys()) {
    CAPTURE(removed.key);
    CHECK_FALSE(keys.contains(removed.key));
  }
}

TEST_CASE("The listing names the default of a setting only where the value differs from it", "[settings]") {
  Settings settings;
  settings.features.count = 700;
  const auto listing = split_lines(as_yaml(settings));
  const auto with_default = [](const std::string& line) {
    return line.find("; default ") != std::string::npos;
  };
  CHECK(std::count_if(listing.begin(), listing.end(), with_default) == 1);
  CHECK_THAT(as_yaml(settings), Catch::Contains("count: 700") &&
                                    Catch::Contains("a whole number from 50 to 20000; default 1000\n"));
}

TEST_CASE("YAML that cannot be parsed is refused in plain words", "[settings]") {
  struct Fault {
    const char* text;
    const char* words;
  };
  for (const auto& [text, words] :
       {Fault{"images:\n    clahe: true\n  clahe_tiles: 3\n",
              "3: not valid YAML: the indentation differs from"},
        Fault{"- - 1\n  - 2\n - 3\n", "3: not valid YAML: the indentation differs from that of the lines"},
        Fault{"seed: @3\n", "1: not valid YAML: a value begins with a character that YAML reserves"},
        Fault{"seed: [3}\n", "1: not valid YAML: a ] or } closes nothing"},
        Fault{"seed: 3\nimages: - 3\n", "2: not valid YAML: a list begins with - where none can be"},
        Fault{",\n", "1: not valid YAML: no value begins with this character"},
        Fault{"seed: 3\n---\n,a\n", "3: not valid YAML: no value begins with this character"},
        Fault{"seed: & 3\n", "1: not valid YAML: an & stands without a name"},
        Fault{"seed: * 3\n", "1: not valid YAML: a * stands without a name"},
        Fault{"seed: \"C:\\d\"\n", "1: not valid YAML: a \\ in double quotes begins no known character"},
        Fault{"images.: true\n", "1: images. ends with a point; add the name after it"},
        Fault{"seed: 1\n: true\n", "2: a key has no name"},
        Fault{"images: {\"\": true}\n", "1: a key has no name"}}) {
    CAPTURE(text);
    CHECK_THAT(load_error(text), Catch::Contains(std::string("s.yaml:") + words));
  }
  CHECK_THAT(load_error(std::string("seed: 1\nimages:\0\n", 17)),
             Catch::Contains("s.yaml:2: there is a zero byte"));
  const std::string utf16("\xFF\xFEs\0e\0e\0d\0:\0 \0003\0\n\0", 18);
  CHECK_THAT(load_error(utf16),
             Catch::Contains("s.yaml:1: there is a zero byte, so it is no text file in UTF-8"));
}

TEST_CASE("A file of the wrong shape is refused", "[settings]") {
  CHECK_THAT(load_error("features: 3"), Catch::Contains("features is a group of settings, not a value"));
  CHECK_THAT(load_error("seed: 1\nseed: 2\n"), Catch::Contains("s.yaml:2: seed is given twice"));
  CHECK_THAT(load_error("images.clahe: true\nimages: {clahe: false}\n"),
             Catch::EndsWith("s.yaml:2: images.clahe is given twice"));
  CHECK_THAT(load_error("images:\n  clahe: true\nimages.clahe: true\n"),
             Catch::EndsWith("s.yaml:3: images.clahe is given twice"));
  CHECK_THAT(load_error("- 1\n- 2\n"),
             Catch::Contains("s.yaml:1: not a settings file; write one `key: value` a line"));
  CHECK_THAT(load_error("seed: [1\n"), Catch::Contains("not valid YAML"));
  CHECK_THAT(load_error("seed: 1\n\tbad: 2\n"), Catch::Contains("s.yaml:2: not valid YAML"));
  CHECK_THAT(load_error("{1, 2}: 3\n"), Catch::Contains("a key must be a plain word"));
  CHECK(load_error("version: 1\nsettings: {seed: 3}\n").empty());
  CHECK_THAT(load_error("settings: {seed: 3}\nfeatures: {count: 300}\n"),
             Catch::Contains("s.yaml:2: features stands outside `settings:`"));
  const std::string of_run = "version: 1\nsettings: {preset: fast, seed: 3}\n";
  CHECK(load_text(of_run, "fast").seed == 3);
  CHECK_THAT(message_of([&] { (void)load_text(of_run, "paper"); }),
             Catch::Contains("settings of a run with the preset fast, not paper"));
  const TemporaryFolder folder;
  CHECK_THAT(message_of([&] { (void)load_settings(folder / "none.yaml"); }),
             Catch::Contains("none.yaml: cannot be read"));
}
