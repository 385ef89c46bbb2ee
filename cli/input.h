// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/configuration.h>
#include <isoreel/container/reader.h>
#include <isoreel/lavf/carrier.h>

#include <CLI/CLI.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace isoreel::cli {

/// For --help, wherever a file is read.
inline constexpr const char* kInputHelp =
    "The .isr (or .isr.part) file, or a .nut, .mov, .mp4, .mkv or .avi that carries one, told by content; a "
    "URL "
    "(https:, file: and what else libavformat knows); - for standard input";

/// The bytes of a file, of standard input ("-"), or behind a URL. Errors name it.
Result<std::unique_ptr<ByteSource>> openBytes(const std::string& path);
/// The same, and whether another container is around them.
Result<lavf::Sniffed> openSniffed(const std::string& path);

/// A file's frames and facts, with random access. From a pipe ("-") the packets are kept in memory.
struct Input {
  std::unique_ptr<PacketSource> packets;
  FileInfo info;
  Configuration configuration;
  std::optional<lavf::Carrier> carrier;  // what it is when it is no .isr file
  /// As Reader's. None from a pipe.
  std::function<Result<std::unique_ptr<ByteSource>>(const std::string&)> openAttachment;
  /// Of an .isr file: where an entry's chunk starts.
  std::function<std::uint64_t(std::uint64_t)> offsetOf;
};
/// `track`: name or number, "" for the first. Errors name the file.
Result<Input> openInput(const std::string& path, const std::string& track = "");
/// Of bytes that were sniffed. Errors do not name it.
Result<Input> openInput(lavf::Sniffed bytes, const std::string& track);

/// The same, but what cannot go back is played forward: of the two, `stream` is set then.
struct ForwardInput {
  Input input;
  std::unique_ptr<StreamReader> stream;
};
Result<ForwardInput> openForward(lavf::Sniffed bytes, const std::string& track);

/// A file's facts and attachments; it may have no frame. kInvalidArgument for a pipe. Errors name the file.
Result<Input> openFacts(const std::string& path);

/// Adds --track to a verb that reads.
void addTrackOption(CLI::App& verb, std::string& track);

/// A line on stderr for everything that had to be left out of a damaged file.
void warnOfDamage(const FileInfo& info, const std::string& path);

/// `status` with the name of the file in front, unless it is there, as in errors of readers.
Status named(const Status& status, const std::string& path);

std::string uuidText(const std::array<std::uint8_t, 16>& uuid);

}  // namespace isoreel::cli
