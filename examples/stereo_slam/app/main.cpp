// SPDX-License-Identifier: MIT
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/help_formatter.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/settings_io.hpp"

namespace {

using namespace stereo_slam;

/// Runs the command; an exception becomes one line on standard error.
int execute(const Command& command) {
  silence_libraries();
  try {
    require_stack();
    const int status = command();
    std::cout.flush();
    if (!std::cout || std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written");
    return status;
  } catch (const std::exception& error) {
    print_message(text_of(error));
  } catch (...) {
    print_message("an unknown error");
  }
  return kFailed;
}

/// Prints what is wrong with the command line, or the help that it asks for. Returns the exit status.
int answer(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return execute([&] { return app.exit(error); });
  print_message(fmt::format("{}; --help describes the options", error.what()));
  return kWrongUsage;
}

}  // namespace

int main(int argc, char** argv) {
  prepare_streams();
  CLI::App app("Stereo visual SLAM with dual quaternions and Bingham densities.", "stereo_slam");
  app.set_version_flag("--version", STEREO_SLAM_VERSION);
  app.formatter(std::make_shared<HelpFormatter>());  // before the commands, which inherit it
  app.require_subcommand(0, 1);
  std::string printed_preset;
  auto* print_settings =
      app.add_option("--print-settings", printed_preset,
                     "print a preset as a settings file, with the meaning, unit and range of every setting")
          ->expected(0, 1)
          ->check(CLI::IsMember(preset_names()).description(""))
          ->type_name("PRESET");
  app.footer(
      "`stereo_slam COMMAND --help` describes the options of a command, with examples.\n"
      "Exit status: 0 done, 1 the input or the run failed, 2 the command line is wrong, 130 stopped by "
      "Ctrl-C.");
  const std::map<std::string, Command> commands = {{"run", add_run(app)},
                                                   {"evaluate", add_evaluate(app)},
                                                   {"compare", add_compare(app)},
                                                   {"simulate", add_simulate(app)},
                                                   {"info", add_info(app)}};
  try {
    app.parse(argc, argv);
    const bool has_command = !app.get_subcommands().empty();
    if (!has_command && print_settings->count() == 0)
      throw CLI::RequiredError("one of the commands run, evaluate, compare, simulate, info");
    if (has_command && print_settings->count() > 0)
      throw CLI::ExcludesError("--print-settings", app.get_subcommands().front()->get_name());
  } catch (const CLI::ParseError& error) {
    return answer(app, error);
  }

  if (!app.get_subcommands().empty()) return execute(commands.at(app.get_subcommands().front()->get_name()));
  return execute([&] {
    write_settings(std::cout, preset_settings(printed_preset.empty() ? "default" : printed_preset));
    return kDone;
  });
}
