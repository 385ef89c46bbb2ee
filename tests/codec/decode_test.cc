// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "lattice/cell_index.h"
#include "lattice/sign_tables.h"
#include "made.h"
#include "packets.h"

namespace isoreel {
namespace {

Result<Surface> decodedLevel(ByteSpan packet, std::uint32_t level) {
  DecodeOptions options;
  options.level = level;
  return Decoder().decode(packet, options);
}

TEST(Level, IsTheMeshOfTheCoarserLatticeAndClosed) {
  for (const made::Made& m : made::all()) {
    const Bytes packet = made::encoded(m).data;
    const std::uint32_t depth = made::depthOf(m.volume.grid);
    for (std::uint32_t level = 0; level < depth; ++level) {
      SCOPED_TRACE(m.name + " level " + std::to_string(level));
      const auto surface = decodedLevel(packet, level);
      ASSERT_TRUE(surface.ok()) << surface.error().message;
      const made::Reference reference = made::reference(m, level);
      ASSERT_EQ(surface->vertices.size(), reference.cells.size());
      EXPECT_EQ(surface->quads, reference.quads);
      EXPECT_TRUE(made::isClosed(reference, surface->quads));
      for (std::size_t i = 0; i < surface->vertices.size(); ++i) {
        const made::ReferenceCell& cell = reference.cells[i];
        for (std::size_t k = 0; k < 3; ++k) {
          const std::int32_t at =
              static_cast<std::int32_t>(cell.at[k] * kCell +
                                        static_cast<std::uint32_t>(kLocalFrames[cell.corners].vertex[k]))
              << reference.shift;
          ASSERT_EQ(surface->vertices[i][k],
                    std::min(at, static_cast<std::int32_t>(m.volume.grid.nodes[k] - 1) * kCell));
        }
      }
    }
    const auto full = Decoder().decode(packet), deep = decodedLevel(packet, depth),
               deeper = decodedLevel(packet, 99);
    ASSERT_TRUE(full.ok() && deep.ok() && deeper.ok());
    EXPECT_EQ(full->vertices, deep->vertices);
    EXPECT_EQ(full->vertices, deeper->vertices);
  }
}

TEST(Level, OfASphereFacesOutwards) {
  const Bytes packet = made::encoded(made::named("sphere")).data;
  const auto surface = decodedLevel(packet, 4);
  ASSERT_TRUE(surface.ok());
  EXPECT_NEAR(made::enclosedVolume(*surface), 6044, 600);
}

TEST(Prefix, EveryTruncationIsRefusedOrGivesTheLevelThatIsWhole) {
  for (const char* name :
       {"noise_20x33x7", "sphere_cut", "specks", "noise_2x2x2", "noise_3x2x100", "empty"}) {
    SCOPED_TRACE(name);
    const Packet packet = made::encoded(made::named(name), kCell / 4);
    const std::uint32_t depth = made::depthOf(made::named(name).volume.grid);
    std::vector<Surface> levels;
    for (std::uint32_t level = 0; level < depth; ++level) levels.push_back(*decodedLevel(packet.data, level));
    std::size_t payload = 0;
    const auto header = readPacketHeader(packet.data, &payload);
    ASSERT_TRUE(header.ok());
    Decoder decoder;
    DecodeOptions prefix;
    prefix.allow_prefix = true;
    for (std::size_t size = 0; size < packet.data.size(); ++size) {
      const ByteSpan cut = ByteSpan(packet.data).first(size);
      const auto refused = decoder.decode(cut);
      ASSERT_FALSE(refused.ok()) << size;
      ASSERT_EQ(refused.error().code, ErrorCode::kTruncated) << refused.error().message;

      // The levels whose sections all end within what is left; at least one, unless it is cut before the
      // first.
      std::size_t whole = 0, end = payload;
      bool vertices_cut = false;
      std::vector<bool> level_cut(depth + 1, false);
      for (const Section& s : header->sections) {
        end += s.bytes;
        if (end <= size) continue;
        if (s.kind == static_cast<std::uint32_t>(SectionKind::kVertices)) {
          vertices_cut = true;
        } else {
          level_cut[s.level] = true;
        }
      }
      while (whole <= depth && !level_cut[whole]) ++whole;
      const auto surface = decoder.decode(cut, prefix);
      if (size < payload || whole == 0) {
        ASSERT_FALSE(surface.ok());
        ASSERT_EQ(surface.error().code, ErrorCode::kTruncated);
        continue;
      }
      ASSERT_TRUE(surface.ok()) << surface.error().message;
      if (whole <= depth) {
        ASSERT_EQ(surface->vertices, levels[whole - 1].vertices) << size;
        ASSERT_EQ(surface->quads, levels[whole - 1].quads);
      } else {
        ASSERT_TRUE(vertices_cut);
        ASSERT_EQ(surface->vertices.size(), packet.header.vertices);
        ASSERT_EQ(surface->quads.size(), packet.header.faces);
      }
    }
  }
}

TEST(Prefix, OfAVeryCompressibleSurfaceIsNotTakenForDamage) {
  // More vertices than the bytes that are left could hold; the whole packet's could.
  const Grid grid = made::gridOf(1025, 1025, 2);
  const made::Made m{"sheet", made::sampled(grid, [](double, double, double z) { return z - 0.5; })};
  const Packet packet = made::encoded(m);
  std::size_t payload = 0;
  ASSERT_TRUE(readPacketHeader(packet.data, &payload).ok());
  ASSERT_GT(packet.header.vertices / 512, payload);
  DecodeOptions prefix;
  prefix.allow_prefix = true;
  const auto surface = Decoder().decode(ByteSpan(packet.data).first(payload), prefix);
  EXPECT_TRUE(surface.ok()) << surface.error().message;
  EXPECT_TRUE(Decoder().decode(packet.data).ok());
}

TEST(Damage, EveryFlippedBitIsFound) {
  for (const char* name : {"noise_2x5x9", "sphere_cut", "empty", "noise_2x2x2"}) {
    Bytes packet = made::encoded(made::named(name), kCell / 4).data;
    Decoder decoder;
    DecodeOptions prefix;
    for (std::size_t bit = 0; bit < packet.size() * 8; ++bit) {
      packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ 1u << (bit % 8));
      ASSERT_FALSE(decoder.decode(packet, prefix).ok()) << name << ": bit " << bit;
      packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ 1u << (bit % 8));
    }
    EXPECT_TRUE(decoder.decode(packet).ok()) << "a decoder goes on after errors";
  }
}

TEST(Damage, GarbageIsRefused) {
  made::Random random(11);
  Decoder decoder;
  DecodeOptions prefix;
  prefix.allow_prefix = true;
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes bytes(random() % 300);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    EXPECT_FALSE(decoder.decode(bytes, prefix).ok());
  }
}

TEST(Damage, BehindGoodChecksumsNeverBreaksTheDecoder) {
  made::Random random(12);
  Decoder decoder;
  std::size_t accepted = 0, refused = 0;
  for (const char* name :
       {"noise_20x33x7", "sphere_cut", "torus", "specks", "sparse_noise", "noise_3x2x100"}) {
    const made::Parts good = made::taken(made::encoded(made::named(name)).data);
    for (int trial = 0; trial < 250; ++trial) {
      made::Parts parts = good;
      for (std::uint32_t flips = random() % 4 + 1; flips > 0; --flips) {
        const std::size_t which = random() % parts.sections.size();
        Bytes& section = parts.sections[which];
        switch (random() % 7) {
          case 0:
            section.resize(random() % (section.size() + 12));
            break;
          case 1:
            parts.header.vertices = random() % 2 == 0 ? random() : parts.header.vertices + random() % 9;
            break;
          case 2:
            parts.header.sections[which].level = random() % 9;
            break;
          case 3:
            parts.header.sections[which].kind = random() % 6;
            break;
          case 4:
            std::swap(section, parts.sections[random() % parts.sections.size()]);
            break;
          default:
            if (!section.empty())
              section[random() % section.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
        }
      }
      if (random() % 8 == 0) {
        // Another grid: sizes are the fields behind profile, inside and tools.
        Configuration other;
        other.grid = made::gridOf(2 + random() % 100, 2 + random() % (random() % 2 == 0 ? 3 : 60000),
                                  2 + random() % 100);
        parts.header.configuration = *writeConfiguration(other);
      }
      const Bytes packet = made::joined(parts);
      for (const bool coarse : {false, true}) {
        DecodeOptions options;
        options.allow_prefix = true;
        if (coarse) options.level = random() % 6;
        const auto surface = decoder.decode(packet, options);
        ++(surface.ok() ? accepted : refused);
        if (surface.ok()) made::expectUsable(*surface);
      }
    }
  }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(accepted, 50u) << "coarse levels should often survive";
}

TEST(Damage, CutShortWithinAnyTreeNeverBreaksTheDecoder) {
  made::Random random(13);
  Decoder decoder;
  for (int trial = 0; trial < 3000; ++trial) {
    // Trees of random bytes: a header that fits, and sections that mean nothing.
    made::Parts parts;
    Configuration configuration;
    const auto nodes = [&] { return 2 + random() % (1u << (1 + random() % 15)); };
    configuration.grid = made::gridOf(nodes(), nodes(), nodes());
    parts.header.configuration = *writeConfiguration(configuration);
    parts.header.vertices = 200000;
    for (std::uint32_t level = 0; level < 17; ++level) {
      for (const std::uint32_t kind : {1u, 2u}) {
        parts.header.sections.push_back({kind, level, 0});
        Bytes content(random() % 24);
        const std::uint32_t style = random() % 4;
        for (std::uint8_t& byte : content)
          byte = style == 0 ? 0 : style == 1 ? 0xFF : static_cast<std::uint8_t>(random());
        parts.sections.push_back(content);
      }
    }
    DecodeOptions options;
    options.level = random() % 17;
    const auto surface = decoder.decode(made::joined(parts), options);
    if (surface.ok()) made::expectUsable(*surface);
  }
}

TEST(Refuses, PacketsThatSayOneThingAndHoldAnother) {
  const Packet packet = made::encoded(made::named("sphere_cut"));
  Decoder decoder;
  const auto message = [&](const auto& change, const DecodeOptions& options = {}) {
    made::Parts parts = made::taken(packet.data);
    change(parts);
    const auto surface = decoder.decode(made::joined(parts), options);
    return surface.ok() ? std::string("decoded") : surface.error().message;
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(message([](made::Parts&) {}), "decoded");
  EXPECT_TRUE(has(message([](made::Parts& p) { ++p.header.vertices; }), "where its header says"));
  EXPECT_TRUE(has(message([](made::Parts& p) { --p.header.vertices; }), "more cells at level 5"));
  EXPECT_TRUE(has(message([](made::Parts& p) { ++p.header.faces; }), "quads, where its header says"));
  EXPECT_TRUE(has(message([](made::Parts& p) { p.header.surface_hash ^= 1; }), "does not match its hash"));
  EXPECT_TRUE(has(message([](made::Parts& p) { p.header.vertices = 0xFFFFFFFF; }), "above the limit"));
  EXPECT_TRUE(has(message([](made::Parts& p) { p.header.vertices = 1u << 27; }), "cannot come from"));
  DecodeOptions few;
  few.max_vertices = 100;
  EXPECT_TRUE(has(message([](made::Parts&) {}, few), "above the limit of 100"));
  EXPECT_TRUE(has(
      message([](made::Parts& p) { p.sections[made::largestSection(p, SectionKind::kLeaves)].resize(1000); }),
      "not used to their end"));
  EXPECT_TRUE(
      has(message([](made::Parts& p) { p.sections[made::largestSection(p, SectionKind::kSigns)].resize(1); }),
          "level 5"));
  EXPECT_TRUE(has(message([](made::Parts& p) { p.sections.back().resize(p.sections.back().size() / 2); }),
                  "vertices: end too early"));
  EXPECT_TRUE(has(message([](made::Parts& p) { p.sections.back().resize(p.sections.back().size() + 20); }),
                  "vertices: not used to their end"));
  // An empty tree whose header promises vertices.
  const Packet empty = made::encoded(made::named("empty"));
  made::Parts parts = made::taken(empty.data);
  parts.header.vertices = 5;
  EXPECT_FALSE(decoder.decode(made::joined(parts)).ok());
  // A P packet behind an I packet whose record has no prediction.
  parts = made::taken(packet.data);
  parts.header.type = PacketType::kPredicted;
  parts.header.configuration.clear();
  parts.header.number = 1;
  parts.header.references = {1};
  ASSERT_TRUE(decoder.decode(packet.data).ok());
  EXPECT_FALSE(decoder.decode(made::joined(parts)).ok());
}

// Surfaces, their cells and damage are the same however many threads are at it.
TEST(Threads, DecodeTheSame) {
  for (const Profile profile : {Profile::kClassic, Profile::kMain}) {
    EncoderSettings settings = made::settings(made::large(), kCell / 8);
    settings.configuration.profile = profile;
    settings.frame_types = FrameTypes::kAuto;
    settings.heights.fit_triangles = settings.heights.weigh_rate = false;
    auto encoder = Encoder::create(settings);
    std::vector<Packet> packets;
    for (int t = 0; t < 3; ++t)
      packets.push_back(*encoder->encode(made::large(0.2 * t).volume, {packets.size(), 0, 1, 0}));
    ASSERT_EQ(packets[2].header.type, PacketType::kPredicted);
    ASSERT_GT(packets[0].header.vertices, 8192u);
    Decoder serial, threaded(made::threadedFor);
    for (const Packet& packet : packets) {
      const Surface surface = *serial.decode(packet.data);
      Decoder copy = threaded;
      for (Decoder* decoder : {&threaded, &copy}) {
        const Surface same = *decoder->decode(packet.data);
        EXPECT_EQ(same.vertices, surface.vertices);
        EXPECT_EQ(same.quads, surface.quads);
        EXPECT_TRUE(std::ranges::equal(decoder->cells(), serial.cells(), [](const Cell& a, const Cell& b) {
          return sameCell(a, b) && a.corners == b.corners;
        }));
      }
      Bytes damaged = packet.data;
      damaged[damaged.size() - 100] ^= 1;
      EXPECT_EQ(Decoder(copy).decode(damaged).error().message,
                Decoder(serial).decode(damaged).error().message);
    }
  }
}

TEST(Extension, UnknownSectionsAndLongerHeadersAreSkipped) {
  const Packet packet = made::encoded(made::named("sphere_cut"));
  const auto expected = Decoder().decode(packet.data);
  ASSERT_TRUE(expected.ok());
  made::Parts parts = made::taken(packet.data);
  for (const std::size_t at : {std::size_t{0}, std::size_t{3}, parts.sections.size()}) {
    made::Parts more = parts;
    more.header.sections.insert(more.header.sections.begin() + static_cast<std::ptrdiff_t>(at), {77, 5, 0});
    more.sections.insert(more.sections.begin() + static_cast<std::ptrdiff_t>(at), Bytes(100, 0x5A));
    const auto surface = Decoder().decode(made::joined(more));
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_EQ(surface->vertices, expected->vertices);
  }
  const auto surface = Decoder().decode(made::withLongerHeader(packet.data, 200));
  ASSERT_TRUE(surface.ok()) << surface.error().message;
  EXPECT_EQ(surface->vertices, expected->vertices);
}

}  // namespace
}  // namespace isoreel
