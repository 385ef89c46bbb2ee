// SPDX-License-Identifier: BSD-3-Clause
// Reader, StreamReader and parity on arbitrary bytes: opened, every fact asked for, every packet fetched.
#include <isoreel/container/parity.h>
#include <isoreel/container/reader.h>

#include <algorithm>

#include "repair.h"

namespace {

/// Bytes that can only be read forward, as from standard input.
class Pipe final : public isoreel::ByteSource {
 public:
  explicit Pipe(const isoreel::Bytes& bytes) : bytes_(bytes) {}
  isoreel::Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (offset >= bytes_.size()) return std::size_t{0};
    const std::size_t count = std::min(out.size(), bytes_.size() - static_cast<std::size_t>(offset));
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), count, out.begin());
    return count;
  }
  std::optional<std::uint64_t> size() const override { return std::nullopt; }
  std::string name() const override { return "pipe"; }

 private:
  const isoreel::Bytes& bytes_;
};

void readAtRandom(const isoreel::Bytes& file) {
  auto reader = isoreel::Reader::open(isoreel::openMemory(file));
  if (!reader.ok()) return;
  const std::uint64_t frames = (*reader)->frameCount();
  for (std::uint64_t i = 0; i < frames; ++i) {
    static_cast<void>((*reader)->header(i));
    static_cast<void>((*reader)->chunkOffset((*reader)->entryOf(i)));
    static_cast<void>(isoreel::keyEntry(**reader, i));
    // An index may list a chunk many times: not every listing needs fetching.
    if (i < 32 || i + 1 == frames) static_cast<void>((*reader)->packet(i));
  }
}

void extractAll(const isoreel::Bytes& file) {
  auto reader = isoreel::Reader::open(isoreel::openMemory(file), "other");
  if (!reader.ok()) return;
  isoreel::Bytes buffer(65536);
  for (std::size_t i = 0; i < (*reader)->info().attachments.size() && i < 16; ++i) {
    auto content = (*reader)->openAttachment((*reader)->info().attachments[i].name);
    if (content.ok()) static_cast<void>((*content)->read(0, buffer));
  }
}

void readForward(const isoreel::Bytes& file) {
  auto stream = isoreel::StreamReader::open(std::make_unique<Pipe>(file));
  if (!stream.ok()) return;
  while (true) {
    const auto packet = (*stream)->next();
    if (!packet.ok() || !packet->has_value()) return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const isoreel::Bytes file = isoreel::fuzz::repairFile(isoreel::ByteSpan(data, size));
  readAtRandom(file);
  readForward(file);
  extractAll(file);
  const auto source = isoreel::openMemory(file);
  static_cast<void>(isoreel::checkParity(*source));
  return 0;
}
