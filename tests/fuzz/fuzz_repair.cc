// SPDX-License-Identifier: BSD-3-Clause
// repairFile on arbitrary bytes: what it writes must open, give every packet, and need no repair. Then the
// second half of its first track, from the key on, is copied behind the whole of it, as trim and concat do.
#include <isoreel/container/reader.h>
#include <isoreel/container/repair.h>
#include <isoreel/container/writer.h>

#include "repair.h"
#include "scratch_file.h"

namespace {

using isoreel::Reader;
namespace fs = std::filesystem;

void need(bool good) {
  if (!good) std::abort();
}

/// Entries from `begin` on, with numbers and times behind what is there.
struct Copier {
  isoreel::Writer& writer;
  std::uint64_t frames = 0;
  std::int64_t time = 0;

  bool copy(Reader& from, std::uint64_t begin) {
    for (std::uint64_t i = begin; i < from.entryCount(); ++i) {
      auto data = from.entryPacket(i);
      if (!data.ok()) return false;
      isoreel::Packet packet{from.entryHeader(i), *std::move(data)};
      packet.header.number = frames;
      packet.header.time = time++;
      packet.header.duration = 1;
      if (!packet.header.hidden()) ++frames;
      if (!writer.write(packet).ok()) return false;
    }
    return true;
  }
};

void join(const fs::path& from, const fs::path& to) {
  auto reader = Reader::open(from);
  need(reader.ok());
  isoreel::WriterSettings settings;
  settings.time_base = (*reader)->info().time_base;
  settings.configuration = (*reader)->info().configuration;
  settings.overwrite = true;
  auto writer = isoreel::Writer::create(to, settings);
  if (!writer.ok()) return;
  Copier copier{**writer};
  const std::uint64_t frames = (*reader)->frameCount();
  auto key = frames > 0 ? isoreel::keyEntry(**reader, frames / 2) : isoreel::Result<std::uint64_t>(0);
  if (!key.ok() || !copier.copy(**reader, 0) || !copier.copy(**reader, *key) || !(*writer)->finish().ok()) {
    (*writer)->discard();
    return;
  }
  const auto joined = Reader::open(to);
  need(joined.ok() && (*joined)->frameCount() == copier.frames);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const isoreel::fuzz::ScratchFolder folder;
  const isoreel::Bytes file = isoreel::fuzz::repairFile(isoreel::ByteSpan(data, size));
  const std::string from = folder.write("input", file);
  const fs::path to = folder.path("output"), again = folder.path("again");
  isoreel::RepairOptions options;
  options.overwrite = true;
  const auto report = isoreel::repairFile(from, to, options);
  if (!report.ok()) return 0;
  const auto second = isoreel::repairFile(to, again, options);
  need(second.ok() && second->damage.empty() && second->lost.empty());
  join(to, again);
  return 0;
}
