// SPDX-License-Identifier: BSD-3-Clause
// One file per verb; each adds its subcommand and leaves in `chosen` what to run once the options are read.
#pragma once

#include <isoreel/base/status.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace isoreel::cli {

/// Runs the verb. An error is printed by the caller and ends the program with exit code 1; options that
/// contradict each other or the input are thrown as CLI::ValidationError, which ends it with exit code 2 like
/// any other usage error.
using Action = std::function<Status()>;

void addEncodeCommand(CLI::App& app, Action& chosen);
void addDecodeCommand(CLI::App& app, Action& chosen);
void addInfoCommand(CLI::App& app, Action& chosen);
void addVerifyCommand(CLI::App& app, Action& chosen);
void addCompareCommand(CLI::App& app, Action& chosen);
void addRemuxCommand(CLI::App& app, Action& chosen);
void addRenderCommand(CLI::App& app, Action& chosen);
void addTrimCommand(CLI::App& app, Action& chosen);
void addConcatCommand(CLI::App& app, Action& chosen);
void addRepairCommand(CLI::App& app, Action& chosen);
void addTagCommand(CLI::App& app, Action& chosen);
void addChapterCommand(CLI::App& app, Action& chosen);
void addAttachCommand(CLI::App& app, Action& chosen);
void addExtractCommand(CLI::App& app, Action& chosen);
void addConformanceCommand(CLI::App& app, Action& chosen);
void addDemoCommand(CLI::App& app, Action& chosen);
void addDocsCommand(CLI::App& app, Action& chosen);

/// Runs a command line as `main` would ("encode", "-o", …), for the demo. Returns its exit code.
int run(std::vector<std::string> arguments);

}  // namespace isoreel::cli
