// SPDX-License-Identifier: BSD-3-Clause
// Slices (spec codec 11.10): how lists are cut, their tables, and packets that have them.
#include <isoreel/codec/decoder.h>

#include <gtest/gtest.h>

#include "cells.h"
#include "extract/sign_bitmap.h"
#include "lattice/slices.h"
#include "lattice/surroundings.h"
#include "made.h"
#include "packets.h"
#include "syntax/slices.h"

namespace isoreel {
namespace {

TEST(Slices, HaveWhatTheyNeedAtLeast) {
  const Slices four{4, 300};
  EXPECT_EQ(sliceCount(0, four), 1u);
  EXPECT_EQ(sliceCount(599, four), 1u);
  EXPECT_EQ(sliceCount(600, four), 2u);
  EXPECT_EQ(sliceCount(100000, four), 4u);
  EXPECT_EQ(sliceCount(100000, Slices{}), 1u);
}

// As the text has it: a group of cells with the same coordinates >> 2 belongs to slice count · first / n.
TEST(Slices, AreCutBetweenGroups) {
  made::Random random(3);
  for (const std::size_t count : {1u, 2u, 3u, 16u}) {
    const std::vector<Cell> cells = made::randomCells(random, 0, 40, 3);
    ASSERT_GT(cells.size(), Slices::kLeastCells * count);
    CellIndex index;
    index.build(cells);
    const std::vector<std::uint32_t> starts = sliceStarts(index.bricks(), count);
    ASSERT_EQ(starts.size(), count + 1);
    std::size_t slice = 0, first = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Cell &cell = cells[i], &before = cells[i == 0 ? 0 : i - 1];
      if (cell.x >> 2 != before.x >> 2 || cell.y >> 2 != before.y >> 2 || cell.z >> 2 != before.z >> 2)
        first = i;
      if (slice + 1 < count && i == index.bricks()[starts[slice + 1]].first) ++slice;
      ASSERT_EQ(slice, count * first / cells.size()) << i;
    }
    EXPECT_EQ(slice + 1, count);
  }
}

TEST(Slices, TheirStreamsComeBack) {
  const std::vector<Bytes> streams{Bytes(3, 1), {}, Bytes(200, 2), Bytes(7, 3)};
  for (std::size_t count = 1; count <= streams.size(); ++count) {
    Bytes section;
    ASSERT_TRUE(writeSlices(std::span(streams).first(count), section).ok());
    EXPECT_EQ(section.size(), count == 1 ? 3u : count == 2 ? 4u : count == 3 ? 205u : 214u);
    const auto back = readSlices(section, count);
    ASSERT_TRUE(back.ok());
    ASSERT_EQ(back->size(), count);
    for (std::size_t n = 0; n < count; ++n) EXPECT_TRUE(std::ranges::equal((*back)[n], streams[n]));
    // Cut short, the last stream is shorter until another one no longer fits.
    const std::size_t last = streams[count - 1].size();
    for (std::size_t size = 0; size < section.size(); ++size)
      EXPECT_EQ(readSlices(ByteSpan(section).first(size), count).ok(), size + last >= section.size()) << size;
  }
}

TEST(Slices, NoLinksLeadAcross) {
  const made::Made m = made::large();
  const SignBitmap bitmap = *SignBitmap::make(m.volume, 0, m.inside, NonFinite::kRefuse, serialFor);
  const std::vector<Cell> cells = bitmap.activeCells(serialFor);
  CellIndex index;
  index.build(cells);
  const auto links = [&](const Slices& slices) {
    Surroundings around;
    around.build(cells, index, slices, made::threadedFor);
    around.link(cells, index, made::threadedFor);
    std::vector<std::array<std::uint32_t, 2>> all;
    for (std::size_t n = 0; n < around.sliceCount(); ++n) {
      const auto runs = around.slice(n);
      EXPECT_EQ(runs.front().first, n == 0 ? 0 : around.slice(n - 1).back().end);
      for (const Surroundings::Run& run : runs) {
        for (std::uint32_t k = 0; k < 2; ++k) {
          const Surroundings::Colour& colour = run.colours[k];
          Surroundings::Links links_of(run, k);
          for (std::size_t i = 0; i < colour.cells.size(); ++i) {
            const std::uint32_t* link = links_of.next(colour.counts[i]);
            for (std::uint32_t left = Surroundings::linkCount(colour.counts[i]); left > 0; --left, ++link) {
              all.push_back({colour.cells[i], *link});
              EXPECT_GE(*link, runs.front().first);
              EXPECT_LT(*link, runs.back().end);
            }
          }
        }
      }
    }
    EXPECT_EQ(around.slice(around.sliceCount() - 1).back().end, cells.size());
    return std::pair(around.sliceCount(), all);
  };
  const auto [one, all] = links({});
  const auto [three, within] = links({3, 256});
  EXPECT_EQ(one, 1u);
  EXPECT_EQ(three, 3u);
  EXPECT_LT(within.size(), all.size());
  EXPECT_GT(within.size(), all.size() * 9 / 10);  // the others lead from slice to slice
}

std::vector<Bytes> packets(const Slices& slices, bool mixed_signs = true,
                           const ParallelFor& parallel = serialFor) {
  EncoderSettings settings = made::settings(made::large(), kCell / 8);
  settings.configuration.profile = Profile::kMain;
  settings.configuration.slices = slices;
  settings.frame_types = FrameTypes::kAuto;
  settings.heights.mixed_signs = mixed_signs;
  settings.heights.fit_triangles = false;
  settings.parallel = parallel;
  auto encoder = Encoder::create(settings);
  std::vector<Bytes> packets;
  for (int t = 0; t < 3; ++t)
    packets.push_back(encoder->encode(made::large(0.2 * t).volume, {packets.size(), 0, 1, 0})->data);
  return packets;
}

// What a decoder gives is what the encoder hashed: each decode() checks that.
TEST(Slices, ComeBackOnAnyThreads) {
  for (const bool mixed_signs : {true, false}) {
    std::vector<Bytes> before;
    for (const Slices& slices : {Slices{}, Slices{2, 512}, Slices{5, 256}, Slices{16, 256}}) {
      const std::vector<Bytes> coded = packets(slices, mixed_signs);
      EXPECT_EQ(packets(slices, mixed_signs, made::threadedFor), coded);
      EXPECT_NE(coded, before);
      Decoder serial, threaded(made::threadedFor);
      for (const Bytes& packet : coded) {
        const auto surface = serial.decode(packet), same = threaded.decode(packet);
        ASSERT_TRUE(surface.ok()) << surface.error().message;
        ASSERT_TRUE(same.ok()) << same.error().message;
        EXPECT_EQ(same->vertices, surface->vertices);
        EXPECT_EQ(same->quads, surface->quads);
      }
      before = coded;
    }
  }
}

// Coarser levels and prefixes need nothing of slices that they lack.
TEST(Slices, CoarserSurfacesAreThoseOfOneSlice) {
  const std::vector<Bytes> one = packets({}), many = packets({4, 256});
  const std::uint32_t depth = made::depthOf(made::large().volume.grid);
  Decoder a, b;
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (std::uint32_t level = 0; level < depth; ++level) {
      DecodeOptions options;
      options.level = level;
      const auto x = Decoder(a).decode(one[i], options), y = Decoder(b).decode(many[i], options);
      ASSERT_TRUE(x.ok() && y.ok());
      EXPECT_EQ(x->vertices, y->vertices);
      EXPECT_EQ(x->quads, y->quads);
    }
    ASSERT_TRUE(a.decode(one[i]).ok() && b.decode(many[i]).ok());
  }
}

TEST(Slices, DamageIsFound) {
  const std::vector<Bytes> coded = packets({4, 256});
  Decoder before;
  ASSERT_TRUE(before.decode(coded[0]).ok());
  for (const bool predicted : {false, true}) {
    const made::Parts parts = made::taken(coded[predicted]);
    for (std::size_t s = 0; s < parts.sections.size(); ++s) {
      for (const std::size_t at : {std::size_t{0}, std::size_t{2}, parts.sections[s].size() / 2}) {
        if (at >= parts.sections[s].size()) continue;
        made::Parts damaged = parts;
        damaged.sections[s][at] ^= 0x15;
        const auto result = Decoder(before).decode(made::joined(damaged));
        if (result.ok()) made::expectUsable(*result);
        made::Parts cut = parts;
        cut.sections[s].resize(at);
        EXPECT_FALSE(Decoder(before).decode(made::joined(cut)).ok()) << s << " " << at;
      }
    }
  }
  made::Parts parts = made::taken(coded[0]);
  parts.sections.back()[0] = parts.sections.back()[1] = parts.sections.back()[2] = 0xFF;
  parts.sections.back()[3] = 0x7F;
  const auto result = Decoder().decode(made::joined(parts));
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("longer together than the"), std::string::npos)
      << result.error().message;
}

TEST(Slices, OfTheRecordAreChecked) {
  Configuration configuration = made::settings(made::named("sphere")).configuration;
  configuration.profile = Profile::kMain;
  configuration.tools = kToolSlices;
  for (const auto& [slices, holds] : {std::pair{Slices{2, 256}, true},
                                      {Slices{16, 1u << 30}, true},
                                      {Slices{1, 256}, false},
                                      {Slices{17, 256}, false},
                                      {Slices{2, 255}, false},
                                      {Slices{2, (1u << 30) + 1}, false}}) {
    configuration.slices = slices;
    const auto record = writeConfiguration(configuration);
    ASSERT_EQ(record.ok(), holds) << slices.most << " " << slices.least_cells;
    if (!holds) continue;
    EXPECT_EQ(*readConfiguration(*record), configuration);
  }
}

}  // namespace
}  // namespace isoreel
