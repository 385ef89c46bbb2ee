// SPDX-License-Identifier: BSD-3-Clause
// Makes the golden packets of spec/vectors and their manifest. They are decoded by the tests and by
// spec/reference_decoder, never made again by them: what an encoder writes may change, what these packets
// mean may not.
//
//   usage: codec_make_vectors FOLDER

#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "made.h"
#include "packets.h"
#include "wild.h"

namespace isoreel {
namespace {

using Json = nlohmann::ordered_json;

class Vectors {
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
    for (std::size_t i = 0; i < header.sections.size(); ++i) {
      const Section& s = header.sections[i];
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

Bytes packetOf(const char* name, std::uint32_t step = kCell / 16) {
  return made::encoded(made::named(name), step).data;
}

Bytes mainPacketOf(const char* name, std::uint32_t step = kCell / 16, const HeightSettings& heights = {}) {
  return made::encodedMain(made::named(name), step, heights).data;
}

/// A sphere with a placement, a time and an isovalue of its own.
Bytes placed() {
  made::Made m{"placed", made::sampled(made::gridOf(12, 15, 10), made::sphere(5, 7, 4, 2)), 1.75};
  m.volume.grid.origin = {-10, 2.5, 1e6};
  m.volume.grid.spacing = {0.5, 0.25, 2};
  m.volume.grid.direction = {0, 1, 0, 1, 0, 0, 0, 0, 1};
  EncoderSettings settings = made::settings(m);
  settings.configuration.time_base = {1001, 30000};
  auto encoder = Encoder::create(settings);
  return encoder->encode(m.volume, {123456789012, -77, 3, m.isovalue})->data;
}

/// Bytes behind the fields of header and record, a minor version, sections of unknown kinds.
Bytes extended(ByteSpan packet) {
  made::Parts parts = made::taken(packet);
  Bytes& record = parts.header.configuration;
  record.insert(record.end() - 4, 6, 0xEE);
  record[6] = static_cast<std::uint8_t>(record.size());
  made::changeRecord(record, 5, 9);
  parts.header.sections.insert(parts.header.sections.begin() + 1, {9, 200, 0});
  parts.sections.insert(parts.sections.begin() + 1, Bytes(11, 0x33));
  return made::withLongerHeader(made::joined(parts), 40);
}

void acceptAll(Vectors& vectors) {
  vectors.accept("empty", "no sign change: everything is outside", packetOf("empty"));
  vectors.accept("all_inside", "no sign change: everything is inside", packetOf("all_inside"));
  vectors.accept("smallest", "a grid of 2 nodes a side: one cell, no octree", packetOf("noise_2x2x2"));
  vectors.accept("thin", "3 x 2 x 100 nodes of noise: cells that reach out of the grid at every level",
                 packetOf("noise_3x2x100"));
  vectors.accept("noise", "20 x 33 x 7 nodes of noise: ambiguous faces, most sign contexts",
                 packetOf("noise_20x33x7"));
  vectors.accept("sphere", "a closed surface in a grid of 2^5 + 1 nodes a side", packetOf("sphere"));
  vectors.accept("sphere_cut", "a surface that is open at the grid's border", packetOf("sphere_cut"));
  vectors.accept("torus", "a grid whose sides are no powers of two", packetOf("torus"));
  vectors.accept("fine_step", "step 1: residuals with long mantissas", packetOf("touching_spheres", 1));
  vectors.accept("coarse_step", "step 16384, the largest", packetOf("gyroid", kCell));
  vectors.accept("specks", "single nodes far apart: leaf bits at every level", packetOf("specks"));
  vectors.accept("level_set", "droplets at 65 nodes a side", packetOf("level_set"));
  vectors.accept("placed", "origin, spacing, a mirroring direction, time and number", placed());
  vectors.accept("extended", "minor 9, unknown sections, bytes behind the fields of record and header",
                 extended(packetOf("sphere_cut")));

  vectors.accept("main_empty", "profile main: no sign change", mainPacketOf("empty"));
  vectors.accept("main_smallest", "profile main: one cell", mainPacketOf("noise_2x2x2"));
  vectors.accept("main_thin", "profile main: cells at the border on all sides",
                 mainPacketOf("noise_3x2x100"));
  vectors.accept("main_noise", "profile main: normals that cancel out, cells across every face",
                 mainPacketOf("noise_20x33x7"));
  vectors.accept("main_sphere_cut", "profile main, a surface that is open at the grid's border",
                 mainPacketOf("sphere_cut"));
  vectors.accept("main_fine_step", "profile main, step 1", mainPacketOf("torus", 1));
  HeightSettings plain;
  plain.neighbours = plain.mixed_signs = false;
  vectors.accept("main_without_tools", "profile main, tools 0",
                 mainPacketOf("touching_spheres", kCell / 16, plain));
  vectors.accept(
      "main_wild",
      "profile main: weights from -255 to 255, residuals up to 65537, heights that leave their cells",
      made::wildHeights(made::named("torus"), 7, 65537, 6));
}

void rejectAll(Vectors& vectors) {
  const Bytes good = packetOf("sphere_cut");
  const auto with = [&](const auto& change) {
    made::Parts parts = made::taken(good);
    change(parts);
    return made::joined(parts);
  };
  const auto record = [&](std::size_t at, std::uint8_t value) {
    return with([&](made::Parts& p) { made::changeRecord(p.header.configuration, at, value); });
  };
  const auto flipped = [&](std::size_t at) {
    Bytes packet = good;
    packet[at] ^= 1;
    return packet;
  };
  vectors.reject("bad_header_crc", "packet header: its CRC does not match", flipped(10));
  vectors.reject("bad_payload_crc", "its payload CRC does not match", flipped(good.size() - 1));
  vectors.reject("cut_short", "cut short by 1 bytes", Bytes(good.begin(), good.end() - 1));
  Bytes longer = good;
  longer.push_back(0);
  vectors.reject("trailing_byte", "1 bytes behind its last section", longer);
  vectors.reject("record_version_2", "version 2", record(4, 2));
  vectors.reject("record_profile_2", "profile 2 is above 1", record(8, 2));
  vectors.reject("record_tools", "tools 2 is above 1", record(10, 2));
  vectors.reject("record_one_node", "nodes 1 is below 2", record(11, 1));
  vectors.reject("record_bad_crc", "configuration record: its CRC does not match",
                 with([](made::Parts& p) { p.header.configuration.back() ^= 1; }));
  vectors.reject("type_p", "reference count 0 is below 1",
                 made::withHeader(good, [](Bytes& fields) { fields[0] = 1; }));
  vectors.reject("too_many_vertices", "vertices cannot come from",
                 with([](made::Parts& p) { p.header.vertices = 1u << 27; }));
  vectors.reject("too_few_vertices", "more cells at level 5 than the header's",
                 with([](made::Parts& p) { --p.header.vertices; }));
  vectors.reject("wrong_vertices", "active cells, where its header says",
                 with([](made::Parts& p) { ++p.header.vertices; }));
  vectors.reject("wrong_faces", "quads, where its header says",
                 with([](made::Parts& p) { ++p.header.faces; }));
  vectors.reject("wrong_hash", "does not match its hash",
                 with([](made::Parts& p) { p.header.surface_hash ^= 1; }));
  vectors.reject("signs_left_over", "corner signs of level 0: not used to their end",
                 with([](made::Parts& p) { p.sections[0].resize(40); }));
  vectors.reject("leaves_left_over", "leaf bits of level", with([](made::Parts& p) {
                   p.sections[made::largestSection(p, SectionKind::kLeaves)].resize(60);
                 }));
  vectors.reject("signs_too_short", "corner signs of level 5 end too early", with([](made::Parts& p) {
                   p.sections[made::largestSection(p, SectionKind::kSigns)].resize(8);
                 }));
  vectors.reject("vertices_too_short", "vertices: end too early",
                 with([](made::Parts& p) { p.sections.back().resize(60); }));
  vectors.reject("vertices_left_over", "vertices: not used to their end",
                 with([](made::Parts& p) { p.sections.back().resize(p.sections.back().size() + 9); }));
  const Bytes main = mainPacketOf("sphere_cut");
  const auto mainWith = [&](const auto& change) {
    made::Parts parts = made::taken(main);
    change(parts, parts.sections.back());
    return made::joined(parts);
  };
  vectors.reject("main_tools", "tools 8 is above 7",
                 mainWith([](made::Parts& p, Bytes&) { made::changeRecord(p.header.configuration, 10, 8); }));
  vectors.reject("main_vertices_too_short", "vertices: end too early",
                 mainWith([](made::Parts&, Bytes& v) { v.resize(40); }));
  vectors.reject("main_vertices_left_over", "vertices: not used to their end",
                 mainWith([](made::Parts&, Bytes& v) { v.resize(v.size() + 9); }));
  made::Parts none = made::taken(packetOf("empty"));
  none.header.vertices = 5;
  vectors.reject("no_tree_but_vertices", "0 active cells, where its header says 5", made::joined(none));
}

// ---- Sequences

/// Volumes of one grid, one after the other.
using Frames = std::vector<made::Made>;

Frames frames(const Grid& grid, std::size_t count, const std::function<made::Field(double)>& at) {
  Frames result;
  for (std::size_t t = 0; t < count; ++t)
    result.push_back({"frame", made::sampled(grid, at(static_cast<double>(t)))});
  return result;
}

std::vector<Bytes> encoded(const Frames& frames, std::uint32_t step = kCell / 16,
                           std::uint32_t block_log2 = 3, Profile profile = Profile::kClassic,
                           const HeightSettings& heights = {}) {
  EncoderSettings settings = made::settings(frames.front(), step);
  settings.configuration.profile = profile;
  settings.heights = heights;
  settings.frame_types = FrameTypes::kAuto;
  settings.motion.block_log2 = block_log2;
  auto encoder = Encoder::create(settings);
  std::vector<Bytes> packets;
  for (std::uint64_t t = 0; t < frames.size(); ++t) {
    auto packet = encoder->encode(frames[t].volume, {t, static_cast<std::int64_t>(t), 1, frames[t].isovalue});
    if ((packet->header.type == PacketType::kIntra) != (t == 0))
      std::cerr << "frame " << t << " is not of the type that the vector should show\n";
    packets.push_back(packet->data);
  }
  return packets;
}

Frames translatedSphere() {
  return frames(made::gridOf(17, 16, 15), 4,
                [](double t) { return made::sphere(6.2 + 0.9 * t, 7.1 + 0.4 * t, 7.3 - 0.3 * t, 4.4); });
}

made::Field both(made::Field a, made::Field b) {
  return [=](double x, double y, double z) { return std::min(a(x, y, z), b(x, y, z)); };
}

Frames appearing(std::size_t count) {
  return frames(made::gridOf(26, 12, 12), count, [](double t) {
    return both(made::sphere(6.3 + 0.4 * t, 5.5, 5.5, 4.6 - (t > 2 ? 9 : 0)),
                made::sphere(19.3, 5.9, 5.2, t < 1 ? -1 : 3.5 + 0.2 * t));
  });
}

/// A sequence of wild packets, in which so many confidences occur.
std::vector<Bytes> wild(const Frames& frames, const made::Wild& wild, std::uint32_t seed,
                        std::size_t confidences = 0, Profile profile = Profile::kClassic) {
  made::WildSequence sequence(seed, profile);
  made::Wild with = wild;
  std::vector<Bytes> packets;
  for (const made::Made& frame : frames) {
    if (packets.empty()) {
      packets.push_back(sequence.intra(frame, wild.step));
      continue;
    }
    with.header = made::wildHeader(sequence.random(), wild.header.block_log2, wild.header.vector_step);
    packets.push_back(sequence.predicted(frame, with));
  }
  const auto& found = sequence.confidences();
  if (kConfidences - static_cast<std::size_t>(std::count(found.begin(), found.end(), 0u)) < confidences)
    std::cerr << "fewer confidences occur than the vector should show\n";
  return packets;
}

std::vector<Bytes> wildVectors() {
  made::Wild large;
  large.header.block_log2 = 2;
  large.header.vector_step = kCell;
  large.step = large.tangential_step = kCell;
  large.farthest = MotionField::kMaxMotion;
  return wild(translatedSphere(), large, 3);
}

void acceptSequences(Vectors& vectors) {
  vectors.sequence("translated_sphere", "motion of less than a cell a frame", encoded(translatedSphere()));
  vectors.sequence("merge_and_split", "two spheres that meet and part",
                   encoded(frames(made::gridOf(24, 13, 12), 5, [](double t) {
                     const double apart = 4.1 + std::abs(t - 2) * 0.8;
                     return both(made::sphere(11.5 - apart, 6.1, 5.4, 4.2),
                                 made::sphere(11.5 + apart, 6.3, 5.7, 4.1));
                   })));
  vectors.sequence("appear_and_vanish",
                   "a component appears, another vanishes; blocks of both without motion",
                   encoded(appearing(4)));
  vectors.sequence(
      "large_motion", "motion of 5 cells a frame, blocks of 4 cells a side",
      encoded(frames(made::gridOf(29, 12, 12), 3,
                     [](double t) { return made::sphere(6.2 + 5 * t, 5.4 + 0.3 * t, 5.6, 4.3); }),
              kCell / 16, 2));
  vectors.sequence("fine_steps", "step 100 along normals, 300 across", encoded(translatedSphere(), 100));
  std::vector<Bytes> reversed = encoded(translatedSphere());
  made::Parts parts = made::taken(reversed[1]);
  std::reverse(parts.sections.begin(), parts.sections.end());
  std::reverse(parts.header.sections.begin(), parts.header.sections.end());
  reversed[1] = made::joined(parts);
  reversed.pop_back();
  vectors.sequence("sections_reversed", "a P packet whose sections stand in another order than a writer's",
                   reversed);
  vectors.sequence("blocks_of_32", "one block", encoded(translatedSphere(), kCell / 8, 5));

  const auto noisy = [](double t) {
    return [t](double x, double y, double z) {
      return std::sin(12.9898 * x + 78.233 * y + 37.719 * z + 0.15 * t) + 0.3 * std::sin(2.1 * x + t);
    };
  };
  made::Wild wildly;
  wildly.header.vector_step = 300;
  vectors.sequence("wild_noise", "noise; random vectors, weights and levels",
                   wild(frames(made::gridOf(11, 9, 10), 4, noisy), wildly, 1));
  Frames empty = frames(made::gridOf(12, 13, 11), 6, [](double t) {
    return made::sphere(5.5 + 0.4 * t, 5.6, 5.2, t == 0 || t == 3 ? -1 : 3.9);
  });
  vectors.sequence("to_and_from_empty", "P packets of empty frames, and from empty frames",
                   wild(empty, {}, 2));
  vectors.sequence("wild_vectors",
                   "vectors of up to 64 cells, most of them to outside the grid; steps of a cell",
                   wildVectors());
  made::Wild residuals;
  residuals.header.block_log2 = 4;
  residuals.header.vector_step = kCell / 64;
  residuals.step = 7;
  residuals.tangential_step = 11;
  residuals.largest = 65535;
  residuals.farthest = kCell / 4;
  vectors.sequence("wild_residuals", "residuals of up to 65535, steps 7 and 11, the smallest vector step",
                   wild(frames(made::gridOf(9, 10, 9), 3,
                               [](double t) { return made::sphere(4 + 0.1 * t, 4.2, 4.1, 2.9); }),
                        residuals, 4));
  made::Wild near;
  near.header.block_log2 = 5;
  near.farthest = kCell / 2;
  near.step = near.tangential_step = kCell / 32;
  near.largest = 1;
  near.still = 1000;
  vectors.sequence("all_confidences", "predictions of all 16 confidences",
                   wild(frames(made::gridOf(15, 16, 14), 3,
                               [](double t) {
                                 return both(
                                     made::torus(7, 7.3, 6.5, 4.4, 1.8 + 0.1 * t),
                                     [=](double x, double, double z) { return z - 2.4 - 0.2 * x - 0.1 * t; });
                               }),
                        near, 5, kConfidences));

  vectors.sequence("main_translated_sphere", "profile main: motion that goes on from packet to packet",
                   encoded(translatedSphere(), kCell / 8, 3, Profile::kMain));
  HeightSettings plain;
  plain.neighbours = plain.mixed_signs = false;
  vectors.sequence("main_p_without_tools", "profile main, tools 1; a component appears, another vanishes",
                   encoded(appearing(3), kCell / 8, 3, Profile::kMain, plain));
  made::Wild main_noise;
  main_noise.header.block_log2 = 2;
  main_noise.header.vector_step = 300;
  vectors.sequence("main_wild_noise", "profile main, noise; random vectors and weights",
                   wild(frames(made::gridOf(9, 8, 9), 3, noisy), main_noise, 7, 0, Profile::kMain));
  made::Wild main_near = near;
  main_near.largest = 65537;
  main_near.step = 5;
  vectors.sequence(
      "main_wild_residuals", "profile main: predictions of many confidences, residuals of up to 65537",
      wild(frames(made::gridOf(13, 12, 11), 3,
                  [](double t) {
                    return both(made::torus(6, 6.3, 5.5, 3.4, 1.7 + 0.1 * t),
                                [=](double x, double, double z) { return z - 1.4 - 0.2 * x - 0.1 * t; });
                  }),
           main_near, 8, 0, Profile::kMain));
}

void rejectSequences(Vectors& vectors) {
  const std::vector<Bytes> good = encoded(translatedSphere());
  const std::string file = "translated_sphere.0.packet";
  const auto after = [&](const char* name, const char* error, const Bytes& packet) {
    vectors.rejectAfter(name, error, {file}, {good[0]}, packet);
  };
  const auto with = [&](const auto& change) {
    made::Parts parts = made::taken(good[1]);
    change(parts, parts.sections[made::largestSection(parts, SectionKind::kMotion)]);
    return made::joined(parts);
  };
  const auto motion = [&](std::size_t at, std::uint8_t value) {
    return with([&](made::Parts&, Bytes& section) { section[at] = value; });
  };
  const auto header = [&](std::size_t at, std::uint8_t value) {
    return made::withHeader(good[1], [&](Bytes& fields) { fields[at] = value; });
  };

  vectors.reject("p_first", "not decoded right before it", good[1]);
  vectors.rejectAfter("p_after_gap", "not decoded right before it", {file}, {good[0]}, good[2]);
  made::Parts without = made::taken(good[0]);
  made::changeRecord(without.header.configuration, 10, 0);
  const Bytes no_tool = made::joined(without);
  vectors.accept("i_without_tool", "what p_without_tool follows", no_tool);
  vectors.rejectAfter("p_without_tool", "packet: ", {"i_without_tool.packet"}, {no_tool}, good[1]);
  // Type 0, number 1, time 2, duration 3, reference count 4, reference 5.
  after("p_reference_0", "reference 0 is below 1", header(5, 0));
  after("p_reference_above_its_number", "reference 2 is above 1", header(5, 2));
  after("p_two_references", "reference count 2 is above 1", made::withHeader(good[1], [](Bytes& fields) {
          fields[4] = 2;
          fields.insert(fields.begin() + 5, 1);
        }));
  after("p_another_reference", "not decoded right before it",
        made::withHeader(good[2], [](Bytes& fields) { fields[5] = 1; }));

  // Length 0, block size 1, vector step 2 and 3, weights from 4 (tangential, normal, error and height of each
  // confidence), levels from 68.
  after("motion_no_header", "its length is above what is left", with([](made::Parts& p, Bytes&) {
          const std::size_t at = made::largestSection(p, SectionKind::kMotion);
          p.sections.erase(p.sections.begin() + static_cast<std::ptrdiff_t>(at));
          p.header.sections.erase(p.header.sections.begin() + static_cast<std::ptrdiff_t>(at));
        }));
  after("motion_header_cut", "its length is above what is left",
        with([](made::Parts&, Bytes& m) { m.resize(70); }));
  after("motion_header_too_short", "ends inside level", motion(0, 69));
  after("block_size_1", "block size 1 is below 2", motion(1, 1));
  after("block_size_6", "block size 6 is above 5", motion(1, 6));
  after("vector_step_128", "vector step 128 is below 256", motion(3, 1));
  after("vector_step_32640", "vector step 32640 is above 16384", with([](made::Parts&, Bytes& m) {
          m[2] = 0x80;
          m[3] = 0xFF;
          m.insert(m.begin() + 4, 1);
          ++m[0];
        }));
  after("weight_129", "height weight 129 is above 128", motion(67, 129));
  after("tangential_weight_129", "tangential weight 129 is above 128", motion(4, 129));
  after("normal_weight_129", "normal weight 129 is above 128", motion(9, 129));
  after("error_weight_129", "error weight 129 is above 128", motion(14, 129));
  after("level_0", "level 0 is below 1", motion(69, 0));
  const std::vector<Bytes> vectors_of_4 = wildVectors();
  made::Parts half = made::taken(vectors_of_4[1]);
  half.sections[made::largestSection(half, SectionKind::kMotion)].resize(86);
  vectors.rejectAfter("motion_too_short", "motion vectors: end too early", {"wild_vectors.0.packet"},
                      {vectors_of_4[0]}, made::joined(half));
  after("motion_left_over", "motion vectors: not used to their end",
        with([](made::Parts&, Bytes& m) { m.resize(m.size() + 9); }));
  after("vector_too_long", "a motion vector of more than 64 cells", with([](made::Parts&, Bytes& m) {
          m.resize(71);
          RangePut coder(m);
          MotionModels models;
          coder.code(models.moves[0], true);
          codeResidual(coder, models.difference[0][0], 513);
          coder.raw(31, 0x55555555);
          coder.finish();
        }));
  const auto signs = [&](const auto& change) {  // the finest, which have temporal context
    return with(
        [&](made::Parts& p, Bytes&) { change(p.sections[made::largestSection(p, SectionKind::kSigns)]); });
  };
  after("p_signs_too_short", "corner signs of level 4 end too early", signs([](Bytes& s) { s.resize(4); }));
  after("p_signs_left_over", "corner signs of level 4: not used to their end",
        signs([](Bytes& s) { s.resize(s.size() + 9); }));
  after("p_vertices_too_short", "vertices: end too early",
        with([](made::Parts& p, Bytes&) { p.sections.back().resize(20); }));
  after("p_vertices_left_over", "vertices: not used to their end",
        with([](made::Parts& p, Bytes&) { p.sections.back().resize(p.sections.back().size() + 9); }));
  after("p_wrong_hash", "does not match its hash",
        with([](made::Parts& p, Bytes&) { p.header.surface_hash ^= 1; }));

  const std::vector<Bytes> main = encoded(translatedSphere(), kCell / 8, 3, Profile::kMain);
  const auto mainMotion = [&](std::size_t at, std::uint8_t value) {
    made::Parts parts = made::taken(main[1]);
    parts.sections[made::largestSection(parts, SectionKind::kMotion)][at] = value;
    return made::joined(parts);
  };
  const auto afterMain = [&](const char* name, const char* error, const Bytes& packet) {
    vectors.rejectAfter(name, error, {"main_translated_sphere.0.packet"}, {main[0]}, packet);
  };
  // Length 0, block size 1, vector step 2 to 4.
  afterMain("main_block_size_6", "block size 6 is above 5", mainMotion(1, 6));
  afterMain("main_motion_header_too_short", "ends inside vector step", mainMotion(0, 2));
}

}  // namespace
}  // namespace isoreel

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: codec_make_vectors FOLDER\n";
    return 2;
  }
  isoreel::Vectors vectors(argv[1]);
  isoreel::acceptAll(vectors);
  isoreel::rejectAll(vectors);
  isoreel::acceptSequences(vectors);
  isoreel::rejectSequences(vectors);
  return vectors.finish() ? 0 : 1;
}
