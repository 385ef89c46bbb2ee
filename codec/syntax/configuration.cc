// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/configuration.h>

namespace isoreel {
namespace {

constexpr std::array<std::uint8_t, 4> kFourCc{'I', 'S', 'R', 'L'};
constexpr std::size_t kHeadBytes = 8;  // FourCC, version, minor, length
constexpr std::size_t kCrcBytes = 4;

enum class SpacingKind : std::uint8_t { kUnit = 0, kEqual = 1, kPerAxis = 2 };

/// The fields of the record behind its head (spec codec 2.2).
struct RecordFields {
  static constexpr const char* kName = "configuration record";
  static constexpr const char* kSpec = "codec 2.2";
  Configuration c;

  template <class V>
  void fields(V& v) {
    v.fixed("profile", c.profile, 0, 1);
    v.fixed("inside", c.inside, 0, 1);
    v.varint("tools", c.tools, 0, c.profile == Profile::kMain ? kToolsOfMain : kToolPrediction);
    if ((c.tools & kToolSlices) != 0) {
      v.varint("slices", c.slices.most, 2, Slices::kMost);
      v.varint("slice cells", c.slices.least_cells, Slices::kLeastCells, 1u << 30);
    }
    for (auto& n : c.grid.nodes) v.varint("nodes", n, kMinNodes, kMaxNodes);
    v.varint("step", c.step, 1, kCell);
    v.varint("time base numerator", c.time_base.numerator, 1);
    v.varint("time base denominator", c.time_base.denominator, 1);

    const Grid plain;
    std::uint8_t has_origin = c.grid.origin != plain.origin;
    v.fixed("has origin", has_origin, 0, 1);
    if (has_origin) {
      for (auto& x : c.grid.origin) v.f64("origin", x);
    }
    auto& spacing = c.grid.spacing;
    SpacingKind kind = spacing == plain.spacing                               ? SpacingKind::kUnit
                       : spacing[0] == spacing[1] && spacing[1] == spacing[2] ? SpacingKind::kEqual
                                                                              : SpacingKind::kPerAxis;
    v.fixed("spacing kind", kind, 0, 2);
    if (kind != SpacingKind::kUnit) {
      for (std::size_t axis = 0; axis < (kind == SpacingKind::kEqual ? 1u : 3u); ++axis)
        v.f64("spacing", spacing[axis]);
      if (kind == SpacingKind::kEqual) spacing[1] = spacing[2] = spacing[0];
      for (const double s : spacing) v.require(s > 0, "spacing is not above 0");
    }
    std::uint8_t has_direction = c.grid.direction != plain.direction;
    v.fixed("has direction", has_direction, 0, 1);
    if (has_direction) {
      for (auto& x : c.grid.direction) v.f64("direction", x);
    }
  }
};

Status refuse(ErrorCode code, const std::string& rule) {
  return {code, "configuration record: " + rule + " (spec codec 2.1)"};
}

}  // namespace

Result<Bytes> writeConfiguration(const Configuration& configuration) {
  Bytes body;
  ISOREEL_TRY(writeSyntax(body, RecordFields{configuration}));
  if (body.size() % 2 != 0) body.push_back(0);  // several carriers want an even length
  Bytes record;
  ByteWriter out(record);
  out.bytes(kFourCc);
  out.fixed(kFormatVersion);
  out.fixed(kFormatMinor);
  out.fixed(static_cast<std::uint16_t>(kHeadBytes + body.size() + kCrcBytes));
  out.bytes(body);
  out.fixed(crc32c(record));
  return record;
}

Result<Configuration> readConfiguration(ByteSpan bytes) {
  ByteReader in(bytes);
  const ByteSpan four_cc = in.bytes(kFourCc.size());
  const std::uint8_t version = in.fixed<std::uint8_t>();
  in.fixed<std::uint8_t>();  // minor: whatever it adds stands behind the fields known here
  const std::uint16_t length = in.fixed<std::uint16_t>();
  if (in.truncated()) return refuse(ErrorCode::kTruncated, "shorter than its head");
  if (!std::equal(four_cc.begin(), four_cc.end(), kFourCc.begin()))
    return refuse(ErrorCode::kBadData, "does not start with ISRL");
  if (version != kFormatVersion) {
    return refuse(ErrorCode::kUnsupported, "version " + std::to_string(version) +
                                               ", where this build reads version " +
                                               std::to_string(kFormatVersion));
  }
  if (length != bytes.size() || length < kHeadBytes + kCrcBytes || length % 2 != 0) {
    return refuse(ErrorCode::kBadData, "length " + std::to_string(length) + " is not that of its " +
                                           std::to_string(bytes.size()) + " bytes, or not even");
  }
  ByteReader crc(bytes.subspan(length - kCrcBytes));
  if (crc.fixed<std::uint32_t>() != crc32c(bytes.first(length - kCrcBytes)))
    return refuse(ErrorCode::kBadData, "its CRC does not match");
  ByteReader body(bytes.subspan(kHeadBytes, length - kHeadBytes - kCrcBytes));
  RecordFields record;
  ISOREEL_TRY(readSyntax(body, record));
  return record.c;
}

}  // namespace isoreel
