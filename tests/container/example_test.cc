// SPDX-License-Identifier: BSD-3-Clause
// The worked example of the specification is what the writer writes, byte for byte.
#include <zstd.h>

#include <cstdio>
#include <sstream>

#include "src/compress.h"
#include "support.h"

namespace isoreel {
namespace {

Packet examplePacket() {
  Packet packet;
  FrameHeader& h = packet.header;
  h.time = -2;
  h.isovalue = 0.5;
  h.vertices = 8;
  h.faces = 6;
  h.box_min = {16384, 16384, 16384};
  h.box_max = {32768, 32768, 32768};
  h.area = 6;
  h.volume = 1;
  h.components = 1;
  h.euler = 2;
  h.error_kind = ErrorKind::kExtracted;
  h.error_rms = 0.25f;
  h.error_max = 0.5f;
  h.surface_hash = 0x0123456789ABCDEF;
  packet.data = {0xAA, 0xBB, 0xCC};
  return packet;
}

WriterSettings exampleSettings() {
  WriterSettings settings;
  settings.time_base = {1, 24};
  settings.track_name = "a";
  settings.configuration = {0x01, 0x02};
  settings.tags = R"({"title":"x"})";
  return settings;
}

// The bytes of a block of the text: on each line an offset, a colon, the bytes, and after ';' words.
Bytes blockInSpecification(const std::string& start) {
  std::ifstream in(ISOREEL_SPEC);
  EXPECT_TRUE(in.good()) << ISOREEL_SPEC;
  Bytes bytes;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line == start) inside = true;
    if (line == "```") inside = false;
    const std::size_t colon = line.find(':');
    if (!inside || colon == std::string::npos) continue;
    EXPECT_EQ(std::stoul(line.substr(0, colon), nullptr, 16), bytes.size()) << line;
    std::istringstream words(line.substr(colon + 1, line.find(';') - colon - 1));
    for (std::string word; words >> word;)
      bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
  }
  return bytes;
}

std::string hex(const Bytes& bytes) {
  std::string out;
  char text[8];
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::snprintf(text, sizeof text, "%02X%c", bytes[i], i % 16 == 15 ? '\n' : ' ');
    out += text;
  }
  return out;
}

TEST(Example, TheSpecificationShowsWhatTheWriterWrites) {
  const Bytes shown = blockInSpecification("```hex");
  const Bytes written = makeFile({examplePacket()}, exampleSettings());
  // Other versions of libzstd may compress otherwise, which the format allows.
  if (ZSTD_versionNumber() == 10504) {
    EXPECT_EQ(hex(shown), hex(written));
  }

  const ChunkPlace index = findChunk(shown, "INDX");
  const ByteSpan payload = ByteSpan(shown).subspan(index.offset + 20, index.bytes - 24);
  const auto content = container::decompress(payload, 1000);
  ASSERT_TRUE(content.ok());
  EXPECT_EQ(hex(*content), hex(blockInSpecification("```index")));

  auto reader = openBytes(shown);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_TRUE((*reader)->info().indexed);
  EXPECT_EQ((*reader)->info().tags, exampleSettings().tags);
  EXPECT_EQ((*reader)->info().configuration, exampleSettings().configuration);
  ASSERT_EQ((*reader)->frameCount(), 1u);
  expectSame({(*reader)->header(0), *(*reader)->packet(0)}, examplePacket());
  auto stream = streamBytes(shown);
  ASSERT_TRUE(stream.ok());
  std::vector<Packet> played;
  EXPECT_TRUE(playAll(**stream, played).ok());
}

}  // namespace
}  // namespace isoreel
