// SPDX-License-Identifier: BSD-3-Clause
// The golden sequences: P packets, what they are predicted from, and what must not follow it.
#include "packet_vectors.h"
#include "wild.h"

namespace isoreel {
namespace {

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
                           const HeightSettings& heights = {}, const Slices& slices = {}) {
  EncoderSettings settings = made::settings(frames.front(), step);
  settings.configuration.profile = profile;
  settings.heights = heights;
  settings.configuration.slices = slices;
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

}  // namespace

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
  vectors.sequence("main_p_slices", "profile main: two slices of signs, three of vertices",
                   encoded(frames(made::gridOf(30, 31, 29), 3,
                                  [](double t) { return made::sphere(14.3 + 0.4 * t, 15.2, 13.7, 11.4); }),
                           kCell / 4, 3, Profile::kMain, {}, {3, 256}));
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

}  // namespace isoreel
