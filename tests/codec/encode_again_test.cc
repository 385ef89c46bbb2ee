// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "extract/sign_bitmap.h"
#include "made.h"

namespace isoreel {
namespace {

TEST(EncodeAgain, ActiveCellsTellAllSigns) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const auto bitmap = SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor);
    ASSERT_TRUE(bitmap.ok());
    const auto& nodes = m.volume.grid.nodes;
    const SignBitmap again =
        SignBitmap::fromCells(nodes, bitmap->activeCells(serialFor), bitmap->at(0, 0, 0));
    std::size_t different = 0;
    for (std::uint32_t z = 0; z < nodes[2]; ++z) {
      for (std::uint32_t y = 0; y < nodes[1]; ++y) {
        for (std::uint32_t x = 0; x < nodes[0]; ++x) different += again.at(x, y, z) != bitmap->at(x, y, z);
      }
    }
    EXPECT_EQ(different, 0u);
  }
}

/// Of a vertex, in 1/16384 of a cell.
double distance(const Surface& a, const Surface& b, std::size_t i) {
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) square += std::pow(a.vertices[i][k] - b.vertices[i][k], 2);
  return std::sqrt(square);
}

double farthest(const Surface& a, const Surface& b) {
  double result = 0;
  for (std::size_t i = 0; i < a.vertices.size(); ++i) result = std::max(result, distance(a, b, i));
  return result;
}

TEST(EncodeAgain, IntraFramesHardlyChange) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const Packet packet = made::encoded(m);
    Decoder decoder;
    const auto first = decoder.decode(packet.data);
    ASSERT_TRUE(first.ok());
    auto encoder = Encoder::create(made::settings(m));
    const auto again = encoder->encodeAgain(*first, decoder.cells(), packet.header.volume > 0, {});
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(again->header.components, packet.header.components);
    EXPECT_NEAR(again->header.volume, packet.header.volume, 0.001 * packet.header.volume);
    EXPECT_EQ(again->header.error_kind, ErrorKind::kNone);
    const auto second = Decoder().decode(again->data);
    ASSERT_TRUE(second.ok()) << second.error().message;
    ASSERT_EQ(second->quads, first->quads);
    // The same but where a cell's wall cut the residual short.
    EXPECT_LE(farthest(*first, *second), kCell / 16.0 * 2);
  }
}

TEST(EncodeAgain, KeepsSheetsAndRefusesOthers) {
  for (const char* name : {"turned_face", "noise_20x33x7"}) {
    const made::Made& m = made::named(name);
    EncoderSettings settings = made::settings(m);
    settings.configuration.profile = Profile::kMain;
    Decoder decoder;
    const auto first = decoder.decode(made::encodedMain(m).data);
    ASSERT_TRUE(first.ok());
    const auto again = Encoder::create(settings)->encodeAgain(*first, decoder.cells(), false, {});
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(Decoder().decode(again->data)->quads, first->quads);
    settings.heights.sheets = false;
    const auto refused = Encoder::create(settings)->encodeAgain(*first, decoder.cells(), false, {});
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_NE(refused.error().message.find("not those of the cells"), std::string::npos);
  }
}

TEST(EncodeAgain, PredictedFramesMoveByHalfAStep) {
  const Grid grid = made::gridOf(25, 25, 25);
  const auto at = [&](double t) {
    return made::sampled(grid, made::sphere(11 + 0.4 * t, 12, 12 - 0.3 * t, 7));
  };
  EncoderSettings settings = made::settings({"sphere", at(0)});
  settings.frame_types = FrameTypes::kAuto;
  auto encoder = Encoder::create(settings), other = Encoder::create(settings);
  Decoder decoder, check;
  for (std::uint64_t i = 0; i < 4; ++i) {
    const auto packet = encoder->encode(at(static_cast<double>(i)), {i, 0, 1, 0});
    ASSERT_TRUE(packet.ok());
    const auto surface = decoder.decode(packet->data);
    ASSERT_TRUE(surface.ok());
    if (i == 0) continue;  // cut off
    const auto again = other->encodeAgain(*surface, decoder.cells(), false, {i, 0, 1, 0});
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(again->header.type == PacketType::kIntra, i == 1);
    const auto second = check.decode(again->data);
    ASSERT_TRUE(second.ok()) << second.error().message;
    ASSERT_EQ(second->quads, surface->quads);
    // Half a step along the normal and both tangents, whose steps are 4.5 times as large; further where a
    // wall of the cell had cut it short.
    const double half = kCell / 32.0 * std::sqrt(1 + 2 * 4.5 * 4.5);
    EXPECT_LE(farthest(*surface, *second), 1.5 * half);
    std::size_t far = 0;
    for (std::size_t v = 0; v < surface->vertices.size(); ++v)
      far += distance(*surface, *second, v) > half + 3;
    EXPECT_LT(far, surface->vertices.size() / 20);
  }
}

TEST(EncodeAgain, RefusesWhatDoesNotBelongTogether) {
  const made::Made& m = made::named("sphere");
  const Packet packet = made::encoded(m);
  Decoder decoder;
  auto surface = decoder.decode(packet.data);
  ASSERT_TRUE(surface.ok());
  std::vector<Cell> cells = decoder.cells();
  auto encoder = Encoder::create(made::settings(m));
  EXPECT_FALSE(encoder->encodeAgain(*surface, {}, false, {}).ok());
  cells[0].x = 60000;
  const auto outside = encoder->encodeAgain(*surface, cells, false, {});
  ASSERT_FALSE(outside.ok());
  EXPECT_NE(outside.error().message.find("vertex 0 is not in its cell"), std::string::npos);
  DecodeOptions coarse;
  coarse.level = 1;
  ASSERT_TRUE(decoder.decode(packet.data, coarse).ok());
  EXPECT_TRUE(decoder.cells().empty());
}

}  // namespace
}  // namespace isoreel
