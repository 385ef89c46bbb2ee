// SPDX-License-Identifier: BSD-3-Clause
// Makes the `.isr` files of spec/vectors, chunk by chunk since many are what no writer writes, and their part
// of the manifest. Tests read them and never make them anew.
//
//   usage: cli_make_files FOLDER
#include "make_files.h"

#include <isoreel/container/parity.h>

#include <iostream>

#include "made.h"

namespace isoreel {

using namespace container;

std::vector<Packet> spheres(int count) {
  made::Made first{"sphere", made::sampled(made::gridOf(13, 11, 10), made::sphere(4.6, 4.5, 4.4, 3.4))};
  EncoderSettings settings = made::settings(first, kCell / 8);
  settings.frame_types = FrameTypes::kAuto;
  settings.configuration.time_base = {1, 24};
  auto encoder = Encoder::create(settings);
  std::vector<Packet> packets;
  for (int t = 0; t < count; ++t) {
    const Volume volume = made::sampled(first.volume.grid, made::sphere(4.6 + 0.2 * t, 4.5, 4.4, 3.4));
    packets.push_back(*encoder->encode(volume, {static_cast<std::uint64_t>(t), 2 * t, 2, 0}));
    packets.back().header.position = packets.back().header.number;
    if ((packets.back().header.type == PacketType::kIntra) != (t == 0))
      std::cerr << "frame " << t << " is of another type\n";
  }
  return packets;
}

Packet still(std::uint64_t number) {
  static const Packet packet = [] {
    made::Made small{"sphere", made::sampled(made::gridOf(9, 8, 8), made::sphere(3.6, 3.5, 3.4, 2))};
    return made::encoded(small, kCell / 4);
  }();
  Packet copy = packet;
  copy.header.number = copy.header.position = number;
  copy.header.time = static_cast<std::int64_t>(number);
  return copy;
}

Bytes plain(int frames) {
  FileMaker maker;
  maker.track(0, "a");
  for (int i = 0; i < frames; ++i) maker.frame(still(static_cast<std::uint64_t>(i)));
  return maker.finish();
}

Bytes predicted(bool finished) {
  FileMaker maker;
  maker.track(0, "a");
  for (const Packet& packet : spheres(4)) maker.frame(packet);
  return finished ? maker.finish() : maker.bytes();
}

namespace {

// ---- What must be read

/// The last two of four frames, with those in front of them hidden.
Bytes preRoll() {
  FileMaker maker;
  maker.track(0, "a");
  for (Packet packet : spheres(4)) {
    FrameHeader& h = packet.header;
    if (h.number < 2) h.flags |= FrameHeader::kHidden;
    h.number = h.number < 2 ? 0 : h.number - 2;
    h.time -= 4;
    maker.frame(packet);
  }
  return maker.finish();
}

Bytes twoTracks() {
  FileMaker maker;
  maker.track(0, "bone");
  maker.track(7, "skin");
  for (const std::uint64_t i : {0u, 1u}) {
    maker.frame(still(i));
    maker.frame(still(i), 7);
  }
  return maker.finish();
}

Bytes described() {
  FileMaker maker;
  maker.tags(R"({"title":"replaced"})");
  maker.track(0, "a");
  maker.frame(still(0));
  maker.tags(R"({"title":"Tröpfchen"})");
  maker.chapters({{Chapter::Kind::kChapter, 0, 1, "first"}, {Chapter::Kind::kMarker, 1, 0, "a moment"}});
  maker.frame(still(1));
  return maker.finish();
}

Bytes attached() {
  FileMaker maker;
  maker.track(0, "a");
  maker.part({"old.txt", 0, AttachmentPart::kLast, "text/plain"}, "replaced");
  maker.part({"gone.txt", 0, AttachmentPart::kLast, ""}, "removed");
  maker.frame(still(0));
  maker.part({"old.txt", 0, 0, "text/plain"}, "new ");
  maker.frame(still(1));  // parts need not stand next to each other
  maker.part({"old.txt", 1, AttachmentPart::kLast, ""}, "content");
  maker.part({"gone.txt", 0, AttachmentPart::kRemoved, ""}, "");
  maker.part({"half.txt", 0, 0, ""}, "the rest never came");
  return maker.finish();
}

Bytes protectedByParity() {
  FileMaker maker;
  maker.track(0, "a");
  maker.frame(still(0));
  maker.add(*reedSolomonParity(30)(ByteSpan(maker.bytes())));
  return maker.finish();
}

Bytes appendedTo() {
  FileMaker maker;
  maker.track(0, "a");
  maker.frame(still(0));
  maker.finish();
  maker.frame(still(1));
  return maker.finish();
}

/// Unknown chunks, and bytes behind the fields of every structure that may grow.
Bytes extendedFile() {
  FileMaker maker;
  maker.minor = 9;
  maker.extension = {1, 2, 3};
  maker.chunk("LATR", {1, 2, 3});
  maker.tags("{}");
  maker.track(0, "a");
  maker.chunk("zzzz", Bytes(ChunkHeader::kSync.begin(), ChunkHeader::kSync.end()));
  Packet packet = still(0);
  packet.header.flags = 0x80;  // reserved
  maker.frame(packet);
  maker.chapters({{Chapter::Kind::kChapter, 0, 0, "one"}});
  maker.part({"a.txt", 0, AttachmentPart::kLast | 0x40, ""}, "text");
  maker.chunk("NONE", {});
  return maker.finish();
}

/// Errors of every kind, and of none.
Bytes measured() {
  FileMaker maker;
  maker.track(0, "a");
  const std::pair<float, float> errors[] = {{0, 0}, {0.0625f, 0.25f}, {0.1f, 3}};
  for (std::uint8_t kind = 0; kind < 3; ++kind) {
    Packet packet = still(kind);
    packet.header.error_kind = static_cast<ErrorKind>(kind);
    std::tie(packet.header.error_rms, packet.header.error_max) = errors[kind];
    maker.frame(packet);
  }
  return maker.finish();
}

/// A chunk inside the payload of another one is none.
Bytes chunkInPayload() {
  FileMaker inner, maker;
  inner.start = false;
  inner.frame(still(5));
  maker.track(0, "a");
  maker.chunk("wrap", inner.bytes());
  maker.frame(still(0));
  return maker.finish();
}

Bytes repeatedRecord() {
  FileMaker maker;
  maker.track(0, "a");
  maker.frame(still(0));
  maker.track(0, "a", false);
  maker.frame(still(1));
  return maker.finish();
}

void acceptAll(Files& files) {
  FileMaker empty;
  empty.track(0, "");
  files.accept("file_without_frames", "container 2.1", "a track and nothing else", empty.finish());
  files.accept("file_plain", "container 2", "two I frames", plain());
  files.accept("file_p_frames", "container 4.1", "an I frame and three P frames", predicted());
  files.accept("file_hidden", "container 4.1", "frames that are decoded and not shown, with times below 0",
               preRoll());
  files.accept("file_errors", "container 4.1", "error_kind 0, 1 and 2, with error_rms and error_max",
               measured());
  files.accept("file_tracks", "container 5", "two tracks, frames side by side", twoTracks());
  files.accept("file_tags_chapters", "container 6.1", "tags that replace others; a chapter and a marker",
               described());
  files.accept("file_attachments", "container 6.3",
               "one of two parts that replaces another, one removed, one without its end", attached());
  files.accept("file_parity", "container 6.4", "PRTY chunks", protectedByParity());
  FileMaker unusable;
  unusable.track(0, "a");
  unusable.frame(still(0));
  unusable.chunk("PRTY", {5, 0, 1, 1, 0, 0});
  files.accept("file_parity_unusable", "container 6.4", "a PRTY chunk with no rows: it is passed over",
               unusable.finish());
  files.accept("file_appended", "container 11", "a file that grew behind its footer", appendedTo());
  files.accept("file_extended", "notation 3.2",
               "minor 9, unknown chunks and flags, bytes behind all known fields", extendedFile());
  files.accept("file_chunk_in_payload", "container 3.1", "a frame's chunk inside another chunk's payload",
               chunkInPayload());
  files.accept("file_record_again", "container 5", "a track record that is repeated", repeatedRecord());
}

}  // namespace
}  // namespace isoreel

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: cli_make_files FOLDER\n";
    return 2;
  }
  isoreel::Files files(argv[1]);
  isoreel::acceptAll(files);
  isoreel::makeBrokenFiles(files);
  return files.finish() ? 0 : 1;
}
