// SPDX-License-Identifier: BSD-3-Clause
// A folder of golden packets and their manifest, while they are made.
#pragma once

#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "made.h"
#include "packets.h"

namespace isoreel {

/// Checks with our decoder that each does what is said of it; complains on stderr where it does not.
class Vectors {
  using Json = nlohmann::ordered_json;

 public:
  explicit Vectors(std::string folder) : folder_(std::move(folder)) {}

  /// A packet that decodes; levels and prefixes are listed too.
  void accept(const std::string& name, const std::string& shows, const Bytes& packet) {
    Decoder decoder;
    const auto full = decoder.decode(packet);
    if (!full) return fail(name, full.error().message);
    Json entry = {{"name", name}, {"file", write(name, packet)}, {"shows", shows}};
    entry.update(summary(*full));
    entry["levels"] = Json::array();
    std::size_t payload = 0;
    const PacketHeader header = *readPacketHeader(packet, &payload);
    const std::uint32_t depth = made::depthOf(full->grid);
    for (std::uint32_t level = 0; level <= depth; ++level) {
      DecodeOptions options;
      options.level = level;
      entry["levels"].push_back(summary(*decoder.decode(packet, options)));
    }
    // Cut in the middle of each level's last section but the first one's: the level above is what is left.
    entry["prefixes"] = Json::array();
    std::size_t end = payload;
    for (const Section& s : header.sections) {
      if (s.kind == static_cast<std::uint32_t>(SectionKind::kSigns) && s.level > 0) {
        entry["prefixes"].push_back({{"bytes", end + s.bytes / 2}, {"level", s.level - 1}});
      }
      end += s.bytes;
    }
    manifest_["accept"].push_back(entry);
  }
  /// A packet that must be refused, and a part of our decoder's message.
  void reject(const std::string& name, const std::string& error, const Bytes& packet) {
    const auto result = Decoder().decode(packet);
    if (result.ok() || result.error().message.find(error) == std::string::npos) {
      return fail(name, result.ok() ? "is not refused" : result.error().message);
    }
    manifest_["reject"].push_back({{"name", name}, {"file", write(name, packet)}, {"error", error}});
  }
  /// Packets that decode one after the other; of the last one, levels, a prefix without its vertices and
  /// shorter ones too.
  void sequence(const std::string& name, const std::string& shows, const std::vector<Bytes>& packets) {
    Decoder decoder;
    Json entry = {{"name", name}, {"shows", shows}, {"packets", Json::array()}, {"levels", Json::array()}};
    for (std::size_t i = 0; i < packets.size(); ++i) {
      const auto surface = decoder.decode(packets[i]);
      if (!surface) return fail(name, "packet " + std::to_string(i) + ": " + surface.error().message);
      Json packet = {{"file", write(name + "." + std::to_string(i), packets[i])}};
      packet.update(summary(*surface));
      entry["packets"].push_back(packet);
    }
    const auto last = [&](ByteSpan packet, const DecodeOptions& options) {
      Decoder anew;
      for (std::size_t i = 0; i + 1 < packets.size(); ++i) static_cast<void>(anew.decode(packets[i]));
      return anew.decode(packet, options);
    };
    DecodeOptions options;
    const Grid grid = last(packets.back(), {})->grid;
    for (std::uint32_t level = 0; level <= made::depthOf(grid); ++level) {
      options.level = level;
      entry["levels"].push_back(summary(*last(packets.back(), options)));
    }
    options = {};
    options.allow_prefix = true;
    const made::Parts parts = made::taken(packets.back());
    const std::size_t bytes = packets.back().size() - parts.sections.back().size();
    entry["prefix"] = {{"bytes", bytes}};
    entry["prefix"].update(summary(*last(ByteSpan(packets.back()).first(bytes), options)));
    // Cut in the middle of the motion, and of each level's signs behind it.
    entry["prefixes"] = Json::array();
    std::size_t at = packets.back().size();
    for (const Bytes& section : parts.sections) at -= section.size();
    std::uint32_t level = 0;  // the last one before
    bool motion = false;
    for (const Section& s : parts.header.sections) {
      if (s.kind == static_cast<std::uint32_t>(SectionKind::kMotion)) {
        motion = true;
        if (level < made::depthOf(grid))
          entry["prefixes"].push_back({{"bytes", at + s.bytes / 2}, {"level", level}});
      } else if (s.kind == static_cast<std::uint32_t>(SectionKind::kSigns)) {
        level = s.level;
        if (motion) entry["prefixes"].push_back({{"bytes", at + s.bytes / 2}, {"level", level - 1}});
      }
      at += s.bytes;
    }
    manifest_["sequences"].push_back(entry);
  }
  /// Packets of which the last one must be refused, after those of files that are there already.
  void rejectAfter(const std::string& name, const std::string& error, const std::vector<std::string>& files,
                   const std::vector<Bytes>& before, const Bytes& packet) {
    Decoder decoder;
    for (const Bytes& good : before) {
      if (const auto surface = decoder.decode(good); !surface) return fail(name, surface.error().message);
    }
    const auto result = decoder.decode(packet);
    if (result.ok() || result.error().message.find(error) == std::string::npos) {
      return fail(name, result.ok() ? "is not refused" : result.error().message);
    }
    Json entry = {{"name", name}, {"after", Json(files)}, {"file", write(name, packet)}, {"error", error}};
    manifest_["reject_after"].push_back(entry);
  }
  /// Leaves the manifest's lists of files as they are.
  bool finish() {
    std::ifstream in(folder_ + "/manifest.json");
    Json manifest = in ? Json::parse(in) : Json::object();
    manifest.update(manifest_);
    std::ofstream(folder_ + "/manifest.json") << manifest.dump(1) << "\n";
    return !failed_;
  }

 private:
  static Json summary(const Surface& surface) {
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(surfaceHash(surface)));
    return {{"vertices", surface.vertices.size()}, {"faces", surface.quads.size()}, {"hash", hash}};
  }
  std::string write(const std::string& name, const Bytes& packet) {
    const std::string file = name + ".packet";
    std::ofstream out(folder_ + "/" + file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(packet.data()), static_cast<std::streamsize>(packet.size()));
    return file;
  }
  void fail(const std::string& name, const std::string& why) {
    std::cerr << name << ": " << why << "\n";
    failed_ = true;
  }

  std::string folder_;
  Json manifest_ = {{"accept", Json::array()},
                    {"reject", Json::array()},
                    {"sequences", Json::array()},
                    {"reject_after", Json::array()}};
  bool failed_ = false;
};

/// Several packets in a row, such as P packets and what they are predicted from: those that decode, and those
/// that must be refused.
void acceptSequences(Vectors& vectors);
void rejectSequences(Vectors& vectors);

}  // namespace isoreel
