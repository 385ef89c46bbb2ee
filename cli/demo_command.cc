// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/player.h>
#include <isoreel/container/reader.h>
#include <isoreel/io/mesh_writer.h>
#include <zstd.h>

#include <filesystem>
#include <fstream>

#include "command.h"
#include "decoding.h"
#include "options.h"

namespace isoreel::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kZstdLevel = 19;

/// The bundled sequence: in the source tree this was built from, or beside the program, wherever that was
/// moved.
Result<fs::path> bundledSequence() {
  std::error_code ignored;
  const fs::path installed =
      fs::read_symlink("/proc/self/exe", ignored).parent_path() / ISOREEL_DATA_FROM_PROGRAM;
  for (const fs::path& root : {fs::path(ISOREEL_SOURCE_DATA), installed.lexically_normal()}) {
    if (fs::is_directory(root / "droplets", ignored)) return root / "droplets";
  }
  return {ErrorCode::kNotFound, fmt::format("the bundled sequence is neither in {} nor in {}",
                                            ISOREEL_SOURCE_DATA, installed.lexically_normal().string())};
}

/// Prints a step and the command line that does it, then runs that.
Status step(const std::string& what, const std::vector<std::string>& arguments) {
  std::string line = "isoreel";
  for (const std::string& argument : arguments) line += ' ' + argument;
  fmt::print("\n# {}\n$ {}\n", what, line);
  std::fflush(stdout);
  if (run(arguments) != 0) return {ErrorCode::kIo, fmt::format("'{}' failed", line)};
  return {};
}

/// Bytes of every frame as binary PLY, and compressed by zstd.
struct MeshBytes {
  std::uint64_t ply = 0, zstd = 0;
};
Result<MeshBytes> measureMeshes(const fs::path& file, const fs::path& folder) {
  ISOREEL_ASSIGN(const std::unique_ptr<Reader> reader, Reader::open(file));
  Player player(*reader, 0);
  MeshBytes total;
  const fs::path mesh = folder / "measured.ply";
  for (std::uint64_t i = 0; i < player.frameCount(); ++i) {
    ISOREEL_ASSIGN(const Surface surface, player.frame(i, decodeOptions()));
    ISOREEL_TRY(io::writeMesh(surface, mesh));
    std::ifstream in(mesh, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    std::string compressed(ZSTD_compressBound(bytes.size()), '\0');
    total.ply += bytes.size();
    total.zstd += ZSTD_compress(compressed.data(), compressed.size(), bytes.data(), bytes.size(), kZstdLevel);
  }
  fs::remove(mesh);
  return total;
}

Status demo(const std::string& output) {
  ISOREEL_ASSIGN(const fs::path data, bundledSequence());
  const fs::path folder = output;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return {ErrorCode::kIo, fmt::format("{}: {}", output, error.message())};
  const std::string file = (folder / "droplets.isr").string();

  ISOREEL_TRY(step("Volumes of a fluid simulation (OpenVDB level sets) become one file.",
                   {"encode", data.string(), "-o", file, "--force"}));
  ISOREEL_TRY(step("What is in it, without decoding.", {"info", file, "--frames"}));
  ISOREEL_TRY(step("Every checksum, every hash, every surface closed.", {"verify", file}));
  ISOREEL_ASSIGN(const std::unique_ptr<Reader> reader, Reader::open(file));
  const std::string middle = fmt::format("{}", reader->frameCount() / 2);
  ISOREEL_TRY(step("Seek to a frame and write its mesh.", {"decode", file, "--frames", middle, "-o",
                                                           (folder / "frame_%05d.ply").string(), "--force"}));
  const std::string clip = (folder / "clip.isr").string();
  ISOREEL_TRY(step("Cut a clip out, packets bit for bit, and check it.",
                   {"trim", file, "-o", clip, "--from", middle, "--force"}));
  ISOREEL_TRY(step("It plays by itself.", {"verify", clip}));
  ISOREEL_TRY(step("How far are the decoded surfaces from the data?",
                   {"compare", file, data.string(), "--samples", "50000"}));
  ISOREEL_TRY(step("A picture of that frame.",
                   {"render", file, "--frames", middle, "-o", (folder / "frame.png").string(), "--force"}));
  ISOREEL_TRY(step("A contact sheet of the sequence.",
                   {"render", file, "-o", (folder / "contact.png").string(), "--force"}));

  std::uint64_t volumes = 0;
  for (const auto& entry : fs::directory_iterator(data)) {
    if (entry.is_regular_file() && entry.path().extension() == ".vdb") volumes += entry.file_size();
  }
  ISOREEL_ASSIGN(const MeshBytes meshes, measureMeshes(file, folder));
  const std::uint64_t bytes = fs::file_size(file);
  const auto row = [bytes](const std::string& name, std::uint64_t size) {
    fmt::print("  {:<34} {:>11} bytes  {:>6.1f} times the .isr\n", name, size,
               static_cast<double>(size) / static_cast<double>(bytes));
  };
  fmt::print("\n# The same surfaces in bytes\n");
  row("volumes as they came (OpenVDB)", volumes);
  row("meshes, binary PLY", meshes.ply);
  row(fmt::format("meshes, binary PLY + zstd -{}", kZstdLevel), meshes.zstd);
  row("droplets.isr", bytes);
  fmt::print("\nLook at {} and {}\n", (folder / "contact.png").string(), (folder / "frame.png").string());
  return {};
}

}  // namespace

void addDemoCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "demo", "The bundled sequence, from volumes to pictures, as the commands you would type");
  const auto output = std::make_shared<std::string>("demo-output");
  verb->add_option("-o,--output", *output, "Folder for what it makes");
  verb->callback([output, &chosen] { chosen = [output] { return demo(*output); }; });
}

}  // namespace isoreel::cli
