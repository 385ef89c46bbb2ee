// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/container/reader.h>

#include <filesystem>

#include "command.h"
#include "input.h"
#include "metadata.h"
#include "output.h"

namespace isoreel::cli {
namespace {

struct AttachOptions {
  std::string file;
  std::vector<std::string> paths;
  std::string name;
  std::string type;
  std::vector<std::string> remove;
  bool force = false;
  bool json = false;
};

Status list(const AttachOptions& options) {
  ISOREEL_ASSIGN(const Input input, openFacts(options.file));
  if (options.json) {
    fmt::print("{}\n", dumped(Json{{"attachments", attachmentsJson(input.info)}}, 2));
  } else {
    for (const Attachment& a : input.info.attachments) fmt::print("{}\n", attachmentLine(a));
  }
  return {};
}

Status changeAttachments(const AttachOptions& options, Writer& writer) {
  for (const std::string& name : options.remove) ISOREEL_TRY(writer.removeAttachment(name));
  for (const std::string& path : options.paths) {
    ISOREEL_ASSIGN(const auto content, openFile(path));
    const std::string name =
        options.name.empty() ? std::filesystem::path(path).filename().string() : options.name;
    if (!Attachment::nameFits(name))
      return {ErrorCode::kInvalidArgument,
              fmt::format("'{}' cannot be the name of an attachment (spec container 6.3)", name)};
    for (const Attachment& a : writer.info().attachments) {
      if (a.name == name && !options.force)
        return {ErrorCode::kIo,
                fmt::format("{}: has an attachment '{}' already (--force replaces it)", options.file, name)};
    }
    ISOREEL_TRY(writer.attach(name, options.type, *content));
  }
  return {};
}

Status attach(const AttachOptions& options) {
  if (!options.name.empty() && options.paths.size() != 1)
    throw CLI::ValidationError("--name", "is for a single file");
  if (options.paths.empty() && options.remove.empty()) return list(options);
  return editFile(options.file, [&](Writer& writer) { return changeAttachments(options, writer); });
}

struct ExtractOptions {
  std::string file;
  std::string name;
  std::string output;
  bool force = false;
};

Status extract(const ExtractOptions& options) {
  ISOREEL_ASSIGN(const Input input, openFacts(options.file));
  ISOREEL_ASSIGN(const auto content, input.openAttachment(options.name));
  // Names are plain file names: this stays in the folder.
  std::filesystem::path output = options.output.empty() ? options.name : options.output;
  if (std::filesystem::is_directory(output)) output /= options.name;
  std::unique_ptr<ByteSink> sink;
  if (options.output == "-") {
    sink = openStandardOutput();
  } else {
    ISOREEL_TRY(mayWrite(output, options.force));
    ISOREEL_ASSIGN(sink, createFile(output, options.force));
  }
  return copyAll(*content, *sink);
}

}  // namespace

void addAttachCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb =
      app.add_subcommand("attach", "List, add or remove the files that travel inside an .isr file");
  const auto options = std::make_shared<AttachOptions>();
  verb->add_option("file", options->file, "The .isr file")->required();
  verb->add_option("paths", options->paths,
                   "Files to attach, under their own names; - for standard input, with --name")
      ->default_str("");
  verb->add_option("--name", options->name, "Another name for the file");
  verb->add_option("--type", options->type, "Media type, as image/png");
  verb->add_option("--remove", options->remove, "Name of one to take away; may be repeated")
      ->take_all()
      ->default_str("");
  verb->add_flag("--force", options->force, "Replace attachments of the same name");
  verb->add_flag("--json", options->json, "List them as one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return attach(*options); }; });
}

void addExtractCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("extract", "Copy an attachment out of a file");
  const auto options = std::make_shared<ExtractOptions>();
  verb->add_option("file", options->file, "The .isr file; or a .mkv that carries one, or a URL")->required();
  verb->add_option("name", options->name, "Name of the attachment; 'isoreel attach FILE' lists them")
      ->required();
  verb->add_option("-o,--output", options->output,
                   "File or folder to write to, - for standard output (default: its name, here)")
      ->default_str("");
  verb->add_flag("--force", options->force, "Replace the output when it is there already");
  verb->callback([options, &chosen] { chosen = [options] { return extract(*options); }; });
}

}  // namespace isoreel::cli
