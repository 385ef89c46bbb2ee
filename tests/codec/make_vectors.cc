// SPDX-License-Identifier: BSD-3-Clause
// Makes the golden packets of spec/vectors and their manifest. They are decoded by the tests and by
// spec/reference_decoder, never made again by them: what an encoder writes may change, what these packets
// mean may not.
//
//   usage: codec_make_vectors FOLDER

#include "packet_vectors.h"
#include "wild.h"

namespace isoreel {
namespace {

Bytes packetOf(const char* name, std::uint32_t step = kCell / 16) {
  return made::encoded(made::named(name), step).data;
}

Bytes mainPacketOf(const char* name, std::uint32_t step = kCell / 16, const HeightSettings& heights = {}) {
  return made::encodedMain(made::named(name), step, heights).data;
}

/// A sphere of which the last level and the vertices are in two slices.
Bytes sliced() {
  const made::Made m{"sliced", made::sampled(made::gridOf(30, 31, 29), made::sphere(14.3, 15.2, 13.7, 12.4))};
  EncoderSettings settings = made::settings(m, kCell / 4);
  settings.configuration.profile = Profile::kMain;
  settings.configuration.slices = {2, 256};
  return Encoder::create(settings)->encode(m.volume, {0, 0, 1, m.isovalue})->data;
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
  vectors.accept("main_turned_face", "profile main: a face that is turned, cells with several vertices",
                 mainPacketOf("turned_face"));
  HeightSettings plain;
  plain.sheets = false;
  vectors.accept("main_without_sheets", "profile main, tools 6: one vertex for each active cell",
                 mainPacketOf("turned_face", kCell / 16, plain));
  plain.neighbours = plain.mixed_signs = false;
  vectors.accept("main_without_tools", "profile main, tools 0",
                 mainPacketOf("touching_spheres", kCell / 16, plain));
  vectors.accept(
      "main_wild",
      "profile main: weights from -255 to 255, residuals up to 65537, heights that leave their cells",
      made::wildHeights(made::named("torus"), 7, 65537, 6));
  vectors.accept("main_slices", "profile main: two slices of signs, leaf bits and vertices", sliced());
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
  vectors.reject("wrong_vertices", "vertices, where its header says",
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
  vectors.reject("main_tools", "tools 32 is above 31", mainWith([](made::Parts& p, Bytes&) {
                   made::changeRecord(p.header.configuration, 10, 32);
                 }));
  const Bytes slices = sliced();
  const auto slicedWith = [&](const auto& change) {
    made::Parts parts = made::taken(slices);
    change(parts);
    return made::joined(parts);
  };
  vectors.reject("slices_1", "slices 1 is below 2",
                 slicedWith([](made::Parts& p) { made::changeRecord(p.header.configuration, 11, 1); }));
  vectors.reject("slices_17", "slices 17 is above 16",
                 slicedWith([](made::Parts& p) { made::changeRecord(p.header.configuration, 11, 17); }));
  vectors.reject("slices_of_128_cells", "slice cells 128 is below 256",
                 slicedWith([](made::Parts& p) { made::changeRecord(p.header.configuration, 13, 1); }));
  vectors.reject("slices_too_long", "slices: longer together than the", slicedWith([](made::Parts& p) {
                   p.sections.back()[0] |= 0x80;
                   p.sections.back()[1] |= 0x7F;
                 }));
  vectors.reject("slice_left_over", "corner signs of level 5: not used to their end",
                 slicedWith([](made::Parts& p) {
                   const std::size_t largest = made::largestSection(p, SectionKind::kSigns);
                   p.sections[largest].resize(p.sections[largest].size() + 9);
                 }));
  vectors.reject("main_vertices_too_short", "vertices: end too early",
                 mainWith([](made::Parts&, Bytes& v) { v.resize(40); }));
  vectors.reject("main_vertices_left_over", "vertices: not used to their end",
                 mainWith([](made::Parts&, Bytes& v) { v.resize(v.size() + 9); }));
  made::Parts none = made::taken(packetOf("empty"));
  none.header.vertices = 5;
  vectors.reject("no_tree_but_vertices", "0 vertices, where its header says 5", made::joined(none));
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
