// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/player.h>
#include <isoreel/inspect/render.h>

#include <cmath>
#include <filesystem>

#include "command.h"
#include "input.h"
#include "options.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

struct RenderOptions {
  std::string input;
  std::string output;
  std::string frames;
  std::string size;
  std::string camera = "35,25";
  double zoom = 1;
  std::size_t tiles = 12;
  bool facets = false;
  int jobs = 0;
  bool force = false;
};

/// The box of all chosen frames in the world, from their headers: one camera for the whole sequence.
inspect::Box sequenceBox(const Input& input, const FrameRange& range) {
  inspect::Box box;
  for (std::uint64_t i = range.begin; i < range.end; ++i) {
    const FrameHeader& header = input.packets->header(i);
    if (header.faces == 0) continue;
    for (std::size_t c = 0; c < 8; ++c) {
      Vec3d cells{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        cells[axis] = (c >> axis & 1 ? header.box_max : header.box_min)[axis] / double{kCell};
      box.add(input.configuration.grid.world(cells));
    }
  }
  return box;
}

/// The frames of a contact sheet: all, or `tiles` of them evenly spread, first and last among them.
std::vector<std::uint64_t> tileFrames(const FrameRange& range, std::size_t tiles) {
  const std::size_t count = std::min<std::size_t>(tiles, static_cast<std::size_t>(range.size()));
  std::vector<std::uint64_t> frames;
  for (std::size_t i = 0; i < count; ++i) {
    frames.push_back(range.begin +
                     (count == 1 ? 0 : (i * (range.size() - 1) + (count - 1) / 2) / (count - 1)));
  }
  return frames;
}

inspect::RenderSettings settingsOf(const RenderOptions& options, bool sheet) {
  inspect::RenderSettings settings;
  settings.smooth = !options.facets;
  const std::string size = options.size.empty() ? (sheet ? "480x360" : "1280x960") : options.size;
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(size.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 16 || height < 16 ||
      width > 16384 || height > 16384) {
    throw CLI::ValidationError("--size", fmt::format("'{}' is not WIDTHxHEIGHT from 16 to 16384", size));
  }
  settings.width = width;
  settings.height = height;
  const std::vector<double> angles = parseNumbers("--camera", options.camera);
  if (angles.size() != 2)
    throw CLI::ValidationError("--camera",
                               fmt::format("'{}' is not AZIMUTH,ELEVATION in degrees", options.camera));
  settings.camera.azimuth = angles[0];
  settings.camera.elevation = angles[1];
  settings.camera.zoom = options.zoom;
  return settings;
}

Status render(const RenderOptions& options) {
  ISOREEL_ASSIGN(const Input input, openInput(options.input));
  warnOfDamage(input.info, options.input);
  if (input.packets->frameCount() == 0) return {ErrorCode::kNotFound, options.input + ": holds no frame"};
  const FrameRange range = parseFrames(options.frames, input.packets->frameCount());
  const bool numbered = countsFrames(options.output);
  if (CLI::detail::to_lower(std::filesystem::path(options.output).extension().string()) != ".png") {
    throw CLI::ValidationError("--output", fmt::format("'{}' does not end in .png", options.output));
  }
  const bool sheet = !numbered && range.size() > 1;
  inspect::RenderSettings settings = settingsOf(options, sheet);
  settings.frame = sequenceBox(input, range);
  std::error_code ignored;
  if (const std::filesystem::path folder = std::filesystem::path(options.output).parent_path();
      !folder.empty()) {
    std::filesystem::create_directories(folder, ignored);
  }
  std::vector<std::uint64_t> frames;
  if (sheet) {
    frames = tileFrames(range, options.tiles);
  } else {
    for (std::uint64_t i = range.begin; i < range.end; ++i) frames.push_back(i);
  }
  if (!numbered) ISOREEL_TRY(mayWrite(options.output, options.force));

  const ThreadLimit limit(options.jobs);
  Player player(*input.packets);
  Progress progress("render", frames.size());
  std::vector<inspect::Image> images;
  std::vector<std::string> captions;
  for (const std::uint64_t position : frames) {
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
    Result<Surface> surface = player.frame(position);
    if (!surface) return named(surface.status(), options.input);
    inspect::Image image = inspect::render(*surface, settings, parallelFor);
    const FrameHeader& header = input.packets->header(position);
    if (sheet) {
      images.push_back(std::move(image));
      captions.push_back(fmt::format("frame {}   {:.4g} s   {} vertices", header.number,
                                     input.configuration.time_base.seconds(header.time), header.vertices));
    } else {
      const std::string path = frameName(options.output, header.number);
      ISOREEL_TRY(mayWrite(path, options.force));
      ISOREEL_TRY(inspect::writePng(image, path));
    }
    progress.advance();
  }
  if (!sheet) return {};
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(images.size()))));
  return inspect::writePng(inspect::contactSheet(images, captions, columns), options.output);
}

}  // namespace

void addRenderCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("render", "A picture of a frame, pictures of all, or a contact sheet");
  const auto options = std::make_shared<RenderOptions>();
  verb->add_option("input", options->input, "The .isr file; - for standard input")->required();
  verb->add_option("-o,--output", options->output,
                   "PNG file: one frame's picture, a contact sheet of several, or with %05d one a frame")
      ->required();
  verb->add_option("--frames", options->frames,
                   "Only the frames A:B (half-open), A:, :B or A (default: all)");
  verb->add_option("--size", options->size,
                   "WIDTHxHEIGHT in pixels, of each picture (default: 1280x960; in a contact sheet 480x360)");
  verb->add_option("--camera", options->camera,
                   "AZIMUTH,ELEVATION in degrees, around the z axis and above the horizon");
  verb->add_option("--zoom", options->zoom, "1 fits the whole sequence")->check(CLI::Range(0.01, 100.0));
  verb->add_option("--tiles", options->tiles, "Pictures in a contact sheet, at most")
      ->check(CLI::Range(1, 400));
  verb->add_flag("--facets", options->facets, "Flat triangles instead of smooth shading");
  verb->add_option("--jobs", options->jobs, "Threads; 0: one a core")->check(CLI::Range(0, 256));
  verb->add_flag("--force", options->force, "Replace pictures that are there already");
  verb->callback([options, &chosen] { chosen = [options] { return render(*options); }; });
}

}  // namespace isoreel::cli
