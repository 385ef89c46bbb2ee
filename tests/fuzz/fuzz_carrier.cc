// SPDX-License-Identifier: BSD-3-Clause
// Files of other containers (NUT, MOV, Matroska, AVI) from arbitrary bytes, through libavformat: opened, and
// all that a reader tells asked for.
#include <isoreel/lavf/carrier.h>
#include <isoreel/lavf/carrier_reader.h>

extern "C" {
#include <libavutil/log.h>
#include <libavutil/mem.h>
}

#include <algorithm>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  av_log_set_level(AV_LOG_QUIET);
  // As FFmpeg's own fuzzers do: it takes what a table of a MOV claims, up to 2 GiB in one piece, before it
  // reads the table.
  av_max_alloc(32 << 20);
  auto sniffed = isoreel::lavf::sniff(isoreel::openMemory(isoreel::Bytes(data, data + size)));
  if (!sniffed.ok() || !sniffed->carrier) return 0;
  auto reader = isoreel::lavf::CarrierReader::open(std::move(sniffed->source));
  if (!reader.ok()) return 0;
  const std::uint64_t frames = (*reader)->frameCount();
  for (std::uint64_t i = 0; i < frames; ++i) {
    static_cast<void>((*reader)->header(i));
    if (i < 32 || i + 1 == frames) static_cast<void>((*reader)->packet(i));
  }
  isoreel::Bytes buffer(65536);
  for (std::size_t i = 0; i < (*reader)->info().attachments.size() && i < 4; ++i) {
    auto content = (*reader)->openAttachment((*reader)->info().attachments[i].name);
    if (content.ok()) static_cast<void>((*content)->read(0, buffer));
  }
  return 0;
}
