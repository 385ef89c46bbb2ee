// SPDX-License-Identifier: BSD-3-Clause
// Every structure of the format from arbitrary bytes: what a reader takes, a writer writes, and read again it
// is the same. The first byte says which.
#include <cstdlib>

#include "inter/prediction.h"
#include "src/format.h"
#include "syntax/packet.h"

namespace {

using isoreel::ByteReader;
using isoreel::Bytes;
using isoreel::ByteSpan;

template <class Struct>
void roundTrip(ByteSpan bytes) {
  Struct first;
  ByteReader in(bytes);
  if (!isoreel::readSyntax(in, first).ok()) return;
  Bytes written;
  if (!isoreel::writeSyntax(written, first).ok()) std::abort();
  Struct second;
  ByteReader again(written);
  if (!isoreel::readSyntax(again, second).ok() || again.left() != 0) std::abort();
  Bytes twice;
  if (!isoreel::writeSyntax(twice, second).ok() || twice != written) std::abort();
  isoreel::dumpSyntax(second, [](const char*, const auto&) {});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace isoreel::container;
  if (size == 0) return 0;
  constexpr std::array<void (*)(ByteSpan), 14> kStructures{roundTrip<isoreel::PacketHeader>,
                                                           roundTrip<isoreel::FrameHeader>,
                                                           roundTrip<isoreel::MotionHeader>,
                                                           roundTrip<isoreel::PredictionHeader>,
                                                           roundTrip<Signature>,
                                                           roundTrip<ChunkHeader>,
                                                           roundTrip<FrameStart>,
                                                           roundTrip<PacketLength>,
                                                           roundTrip<TrackRecord>,
                                                           roundTrip<ChapterCount>,
                                                           roundTrip<AttachmentPart>,
                                                           roundTrip<ParityHead>,
                                                           roundTrip<FileRecord>,
                                                           roundTrip<Footer>};
  kStructures[data[0] % kStructures.size()](ByteSpan(data + 1, size - 1));
  return 0;
}
