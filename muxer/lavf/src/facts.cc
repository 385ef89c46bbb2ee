// SPDX-License-Identifier: BSD-3-Clause
#include "facts.h"

extern "C" {
#include <libavutil/base64.h>
}

namespace isoreel::lavf {
namespace {

constexpr std::uint8_t kVersion = 1;

struct FactRecord {
  static constexpr const char* kName = "facts of a frame";
  static constexpr const char* kSpec = "mappings 5.2";
  std::uint64_t number = 0;
  FrameHeader header;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("number", number);
    v.fixed("surface_hash", header.surface_hash);
    for (auto& c : header.box_min) v.varint("box_min", c);
    for (auto& c : header.box_max) v.varint("box_max", c);
    v.f64("area", header.area);
    v.f64("volume", header.volume);
    v.varint("components", header.components);
    v.signedVarint("euler", header.euler);
    v.fixed("error_kind", header.error_kind, 0, 2);
    v.f32("error_rms", header.error_rms);
    v.f32("error_max", header.error_max);
  }
};

}  // namespace

void FactList::add(std::uint64_t number, const FrameHeader& header) {
  facts_.insert({{number, header.surface_hash}, header});
}

std::string FactList::text() const {
  Bytes bytes{kVersion};
  for (const auto& [key, header] : facts_) {
    // A header that a file held passes its own rules; one that does not is left out.
    [[maybe_unused]] const Status written = writeSized(bytes, FactRecord{key.first, header});
  }
  std::string text(AV_BASE64_SIZE(bytes.size()), '\0');
  if (av_base64_encode(text.data(), static_cast<int>(text.size()), bytes.data(),
                       static_cast<int>(bytes.size())) == nullptr) {
    return "";
  }
  text.pop_back();  // the end of a C string
  return text;
}

FactList FactList::parse(const std::string& text) {
  FactList list;
  Bytes bytes(AV_BASE64_DECODE_SIZE(text.size()));
  const int size = av_base64_decode(bytes.data(), text.c_str(), static_cast<int>(bytes.size()));
  if (size < 1 || bytes[0] != kVersion) return list;
  ByteReader in(ByteSpan(bytes).subspan(1, static_cast<std::size_t>(size) - 1));
  while (in.left() > 0) {
    FactRecord record;
    if (!readSized(in, record).ok()) break;
    list.facts_.insert({{record.number, record.header.surface_hash}, record.header});
  }
  return list;
}

bool FactList::fill(std::uint64_t number, FrameHeader& header) const {
  const auto found = facts_.find({number, header.surface_hash});
  if (found == facts_.end()) return false;
  const FrameHeader& known = found->second;
  header.box_min = known.box_min;
  header.box_max = known.box_max;
  header.area = known.area;
  header.volume = known.volume;
  header.components = known.components;
  header.euler = known.euler;
  header.error_kind = known.error_kind;
  header.error_rms = known.error_rms;
  header.error_max = known.error_max;
  return true;
}

}  // namespace isoreel::lavf
