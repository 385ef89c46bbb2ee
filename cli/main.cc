// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "command.h"
#include "interrupt.h"

namespace isoreel::cli {

int run(std::vector<std::string> arguments) {
  CLI::App app("Isoreel: a codec, container and player for time-varying isosurfaces", "isoreel");
  app.set_version_flag("--version", "isoreel " ISOREEL_VERSION);
  app.option_defaults()->always_capture_default();
  app.require_subcommand(1);
  app.footer("Every verb has its own --help. Exit code: 0 fine, 1 failed, 2 wrong usage.");
  Action chosen;
  addEncodeCommand(app, chosen);
  addDecodeCommand(app, chosen);
  addInfoCommand(app, chosen);
  addVerifyCommand(app, chosen);
  addCompareCommand(app, chosen);
  addRenderCommand(app, chosen);
  addDemoCommand(app, chosen);
  try {
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them last first
    app.parse(arguments);
    const Status status = chosen();
    if (status.ok()) return 0;
    fmt::print(stderr, "isoreel {}: {}\n", app.get_subcommands().front()->get_name(), status.message());
    return 1;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
}

}  // namespace isoreel::cli

int main(int argc, char** argv) {
  isoreel::cli::stopOnSignals();
  try {
    return isoreel::cli::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {  // out of memory, above all
    fmt::print(stderr, "isoreel: {}\n", error.what());
    return 1;
  }
}
