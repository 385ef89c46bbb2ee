// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/configuration.h>
#include <isoreel/container/reader.h>
#include <CLI/CLI.hpp>

#include <memory>
#include <string>

namespace isoreel::cli {

/// A file's frames and facts, with random access. From a pipe ("-") the packets are kept in memory.
struct Input {
  std::unique_ptr<PacketSource> packets;
  FileInfo info;
  Configuration configuration;
};
/// `track`: name or number, "" for the first. Errors name the file.
Result<Input> openInput(const std::string& path, const std::string& track = "");

/// Adds --track to a verb that reads.
void addTrackOption(CLI::App& verb, std::string& track);

/// A line on stderr for everything that had to be left out of a damaged file.
void warnOfDamage(const FileInfo& info, const std::string& path);

/// `status` with the name of the file in front, unless it is there, as in errors of readers.
Status named(const Status& status, const std::string& path);

std::string uuidText(const std::array<std::uint8_t, 16>& uuid);

}  // namespace isoreel::cli
