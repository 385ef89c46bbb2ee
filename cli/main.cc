// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "command.h"
#include "interrupt.h"
#include "output.h"

namespace isoreel::cli {
namespace {

/// What is wrong with the command line. A word that is not known says more than what is missing because of
/// it.
std::string usageProblem(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty() || dynamic_cast<const CLI::RequiredError*>(&error) == nullptr) return error.what();
  if (!app.get_subcommands().empty() || unknown.front().starts_with('-'))
    return fmt::format("'{}' is not known", unknown.front());
  return fmt::format("'{}' is no verb", unknown.front());
}

int usageError(const CLI::App& app, const CLI::ParseError& error) {
  const auto verbs = app.get_subcommands();
  const std::string command = verbs.empty() ? "isoreel" : "isoreel " + verbs.front()->get_name();
  complain("{}: {}\n'{} --help' lists what there is.\n", command, usageProblem(app, error), command);
  return 2;
}

/// Without this, a file that is opened may become standard output or error, and messages end in it. Opened
/// the other way round, so that using them fails as it should.
void occupyClosedStreams() {
  for (int file = 0; file <= 2; ++file) {
    if (fcntl(file, F_GETFD) < 0) [[maybe_unused]]
      const int opened = open("/dev/null", file == 0 ? O_WRONLY : O_RDONLY);
  }
}

/// `code`, or 1 when what was printed did not arrive (a full disk).
int finishOutput(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  complain("isoreel: standard output cannot be written: {}\n", std::strerror(errno));
  return code == 0 ? 1 : code;
}

}  // namespace

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
  addRemuxCommand(app, chosen);
  addRenderCommand(app, chosen);
  addTrimCommand(app, chosen);
  addConcatCommand(app, chosen);
  addRepairCommand(app, chosen);
  addTagCommand(app, chosen);
  addChapterCommand(app, chosen);
  addAttachCommand(app, chosen);
  addExtractCommand(app, chosen);
  addConformanceCommand(app, chosen);
  addDemoCommand(app, chosen);
  addDocsCommand(app, chosen);
  try {
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them last first
    app.parse(arguments);
    const Status status = chosen();
    if (status.ok()) return 0;
    complain("isoreel {}: {}\n", app.get_subcommands().front()->get_name(), status.message());
    return 1;
  } catch (const CLI::ParseError& error) {
    return error.get_exit_code() == 0 ? app.exit(error) : usageError(app, error);
  }
}

}  // namespace isoreel::cli

int main(int argc, char** argv) {
  isoreel::cli::occupyClosedStreams();
  isoreel::cli::stopOnSignals();
  try {
    return isoreel::cli::finishOutput(isoreel::cli::run({argv + 1, argv + argc}));
  } catch (const std::exception& error) {  // out of memory, above all
    isoreel::cli::complain("isoreel: {}\n", error.what());
    return 1;
  }
}
