// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/container/repair.h>

#include "command.h"
#include "metadata.h"
#include "output.h"

namespace isoreel::cli {
namespace {

struct RepairCommandOptions {
  std::string input;
  std::string output;
  unsigned parity = 0;
  bool compact = false;
  bool force = false;
  bool json = false;
};

Json runsJson(const std::vector<FrameRun>& runs) {
  Json list = Json::array();
  for (const FrameRun& run : runs)
    list.push_back({{"track", run.track}, {"first", run.first}, {"last", run.last}});
  return list;
}

std::string framesText(const FrameRun& run) {
  const std::string frames = run.first == run.last ? fmt::format("frame {}", run.first)
                                                   : fmt::format("frames {} to {}", run.first, run.last);
  return run.track == 0 ? frames : fmt::format("{} of track {}", frames, run.track);
}

void print(const RepairCommandOptions& options, const RepairReport& report) {
  if (options.json) {
    Json renumbered = runsJson(report.renumbered);
    for (std::size_t i = 0; i < renumbered.size(); ++i) renumbered[i]["number"] = report.numbers[i];
    fmt::print("{}\n", dumped(Json{{"exact", report.exact},
                                   {"lossy", report.lossy()},
                                   {"frames", report.frames},
                                   {"damage", report.damage},
                                   {"parity", report.parity},
                                   {"restored_blocks", report.restored_blocks},
                                   {"lost", runsJson(report.lost)},
                                   {"dependent", runsJson(report.dependent)},
                                   {"renumbered", renumbered},
                                   {"lost_attachments", report.attachments},
                                   {"open_ended_tracks", report.open_ended}}));
    return;
  }
  for (const std::string& line : report.damage) fmt::print("damage: {}\n", line);
  for (const std::string& line : report.parity) fmt::print("parity: {}\n", line);
  for (const FrameRun& run : report.lost) fmt::print("lost: {}\n", framesText(run));
  for (const FrameRun& run : report.dependent)
    fmt::print("lost: {}, which cannot be decoded without\n", framesText(run));
  for (const std::string& name : report.attachments) fmt::print("lost: attachment {}\n", printable(name));
  for (std::size_t i = 0; i < report.renumbered.size(); ++i)
    fmt::print("renumbered: {}, from {} on; times are kept\n", framesText(report.renumbered[i]),
               report.numbers[i]);
  if (!report.open_ended.empty())
    fmt::print("not known: whether there were more frames at the end, since the index is lost\n");
  fmt::print("{}: {}, {}\n", options.output, counted(report.frames, "frame"),
             report.exact && report.damage.empty() ? "the same bytes: nothing was wrong"
             : report.exact                        ? "restored bit for bit"
                                                   : "written anew");
}

Status repair(const RepairCommandOptions& options) {
  std::error_code ignored;
  if (std::filesystem::equivalent(options.input, options.output, ignored))
    throw CLI::ValidationError("--output", "is the input: repair writes another file");
  ISOREEL_TRY(mayWrite(options.output, options.force));
  RepairOptions how;
  how.overwrite = options.force;
  how.compact = options.compact;
  if (options.parity > 0) how.writer.parity = reedSolomonParity(options.parity);
  ISOREEL_ASSIGN(const RepairReport report, repairFile(options.input, options.output, how));
  print(options, report);
  if (!report.lossy()) return {};
  return {ErrorCode::kBadData,
          fmt::format("{}: not all could be had back; {} has the rest", options.input, options.output)};
}

}  // namespace

void addRepairCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb =
      app.add_subcommand("repair",
                         "Make a whole file of one that is damaged, cut or unfinished, and say what is lost. "
                         "Exit code 0: nothing that is "
                         "known to have been there is missing; 1: something is, or nothing could be written");
  const auto options = std::make_shared<RepairCommandOptions>();
  verb->add_option("input", options->input, "The damaged file")->required();
  verb->add_option("-o,--output", options->output, "The .isr file to write")->required();
  verb->add_flag(
      "--compact", options->compact,
      "Write the file anew even when nothing is wrong, without tags, attachments and indexes that are not "
      "in use any more");
  verb->add_option("--parity", options->parity, "Parity in percent for a file that is written anew; 0: none")
      ->check(CLI::Range(0, 100));
  verb->add_flag("--force", options->force, "Replace the output when it is there already");
  verb->add_flag("--json", options->json, "One JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return repair(*options); }; });
}

}  // namespace isoreel::cli
