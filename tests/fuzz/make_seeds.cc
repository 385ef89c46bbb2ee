// SPDX-License-Identifier: BSD-3-Clause
// usage: make_seeds FOLDER VECTORS — first inputs for the fuzzers, made by the encoder and the writer of this
// build: small volumes of several shapes and sizes, as configuration records, packets and .isr files; and the
// first two packets of each golden sequence in VECTORS.
#include <isoreel/codec/encoder.h>
#include <isoreel/container/parity.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>

#include "repair.h"

namespace {

using isoreel::Bytes;
using isoreel::Vec3d;
namespace fs = std::filesystem;

struct Shape {
  const char* name;
  std::array<std::uint32_t, 3> nodes;
  std::function<double(const Vec3d&)> field;  // below 0 inside; coordinates in the unit cube
};

double length(double x, double y, double z) { return std::hypot(x, y, z); }

std::vector<Shape> shapes() {
  return {
      {"nothing", {4, 4, 4}, [](const Vec3d&) { return 1.0; }},
      {"full", {4, 4, 4}, [](const Vec3d&) { return -1.0; }},
      {"smallest", {2, 2, 2}, [](const Vec3d& p) { return p[0] + p[1] + p[2] - 0.5; }},
      {"flat", {9, 2, 5}, [](const Vec3d& p) { return p[0] - 0.4; }},
      {"sphere", {9, 9, 9}, [](const Vec3d& p) { return length(p[0] - 0.5, p[1] - 0.5, p[2] - 0.5) - 0.3; }},
      {"border", {8, 11, 6}, [](const Vec3d& p) { return length(p[0], p[1] - 0.5, p[2] - 0.9) - 0.5; }},
      {"waves",
       {17, 17, 17},
       [](const Vec3d& p) { return std::sin(9 * p[0]) * std::cos(7 * p[1]) + std::sin(8 * p[2]); }},
      {"checkers",
       {6, 6, 6},
       [](const Vec3d& p) { return std::fmod(std::round(5 * (p[0] + p[1] + p[2])), 2.0) - 0.5; }},
  };
}

isoreel::Volume sample(const Shape& shape, double time) {
  isoreel::Grid grid;
  grid.nodes = shape.nodes;
  std::vector<float> samples;
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.nodes[0]; ++x) {
        const Vec3d p{double(x) / (grid.nodes[0] - 1), double(y) / (grid.nodes[1] - 1),
                      double(z) / (grid.nodes[2] - 1)};
        samples.push_back(static_cast<float>(shape.field(p) + time));
      }
    }
  }
  return isoreel::Volume::own(grid, std::move(samples));
}

isoreel::Status save(const fs::path& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary);
  for (const std::uint8_t byte : bytes) out.put(static_cast<char>(byte));
  if (!out.flush()) return {isoreel::ErrorCode::kIo, path.string() + " cannot be written"};
  return {};
}

/// A seed of fuzz_packet: the packet before it may be empty.
isoreel::Status savePackets(const fs::path& path, const Bytes& before, const Bytes& packet) {
  Bytes seed;
  isoreel::ByteWriter out(seed);
  out.fixed(static_cast<std::uint16_t>(before.size()));
  out.bytes(before);
  out.bytes(packet);
  return save(path, seed);
}

Bytes load(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

isoreel::Status makeSequenceSeeds(const fs::path& vectors, const fs::path& folder) {
  int found = 0;
  for (const auto& file : fs::directory_iterator(vectors)) {
    std::string name = file.path().filename().string();
    const std::size_t end = name.rfind(".1.packet");
    if (end == std::string::npos) continue;
    name.resize(end);
    ISOREEL_TRY(savePackets(folder / name, load(vectors / (name + ".0.packet")), load(file.path())));
    ++found;
  }
  if (found == 0) return {isoreel::ErrorCode::kIo, vectors.string() + " has no sequences"};
  return {};
}

isoreel::Status makeSeeds(const Shape& shape, const fs::path& folder) {
  isoreel::EncoderSettings settings;
  settings.configuration.inside = isoreel::Inside::kBelow;
  settings.configuration.grid = sample(shape, 0).grid;
  settings.frame_types = isoreel::FrameTypes::kAuto;
  ISOREEL_ASSIGN(isoreel::Encoder encoder, isoreel::Encoder::create(settings));
  ISOREEL_TRY(save(folder / "configuration" / shape.name, encoder.configurationRecord()));

  isoreel::WriterSettings file;
  file.time_base = settings.configuration.time_base;
  file.configuration = encoder.configurationRecord();
  file.tags = R"({"title":"seed"})";
  file.overwrite = true;
  file.options.parity = isoreel::reedSolomonParity(30);
  ISOREEL_ASSIGN(auto writer, isoreel::Writer::create(folder / "reader" / shape.name, file));
  ISOREEL_TRY(writer->setChapters({{isoreel::Chapter::Kind::kMarker, 0, 0, "here"}}));
  ISOREEL_ASSIGN(const std::uint64_t other, writer->addTrack({{1, 10}, "other", {}}));
  for (int i = 0; i < 2; ++i) {
    const isoreel::FrameTiming timing{static_cast<std::uint64_t>(i), i, 1, 0.0};
    ISOREEL_ASSIGN(const isoreel::Packet packet, encoder.encode(sample(shape, 0.02 * i), timing));
    if (i == 0) ISOREEL_TRY(savePackets(folder / "packet" / shape.name, {}, packet.data));
    ISOREEL_TRY(writer->write(packet));
    isoreel::Packet again = packet;  // as a cut would leave it when only the second is shown
    again.header.number = 0;
    if (i == 0) again.header.flags = isoreel::FrameHeader::kHidden;
    if (i == 0 || packet.header.back > 0) ISOREEL_TRY(writer->write(again, other));
  }
  const auto note = isoreel::openMemory({1, 2, 3});
  ISOREEL_TRY(writer->attach("note", "", *note));
  ISOREEL_TRY(writer->finish());

  const Bytes whole = load(folder / "reader" / shape.name);
  return save(folder / "reader" / (std::string(shape.name) + ".opened"), isoreel::fuzz::openedFile(whole));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: make_seeds FOLDER VECTORS\n"), 2;
  const fs::path folder = argv[1];
  for (const char* kind : {"configuration", "packet", "reader"}) fs::create_directories(folder / kind);
  for (const Shape& shape : shapes()) {
    const isoreel::Status status = makeSeeds(shape, folder);
    if (!status.ok()) return std::fprintf(stderr, "%s: %s\n", shape.name, status.error().message.c_str()), 1;
  }
  const isoreel::Status status = makeSequenceSeeds(argv[2], folder / "packet");
  if (!status.ok()) return std::fprintf(stderr, "%s\n", status.error().message.c_str()), 1;
  return 0;
}
