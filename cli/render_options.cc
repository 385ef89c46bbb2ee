// SPDX-License-Identifier: BSD-3-Clause
#include "render_options.h"

#include "input.h"

#include <fmt/format.h>

#include <filesystem>

namespace isoreel::cli {
namespace {

const std::map<std::string, Colour> kColours{
    {"none", Colour::kNone}, {"curvature", Colour::kCurvature}, {"error", Colour::kError}};

const std::map<std::string, Overlay> kOverlays{{"none", Overlay::kNone}, {"motion", Overlay::kMotion}};

/// Azimuth and elevation. Left is the side of small x, front that of small y.
const std::map<std::string, std::array<double, 2>> kViews{{"front", {0, 0}},
                                                          {"back", {180, 0}},
                                                          {"left", {-90, 0}},
                                                          {"right", {90, 0}},
                                                          {"top", {0, 90}},
                                                          {"bottom", {0, -90}},
                                                          {"iso", {45, 35.264389682754654}}};

}  // namespace

Product productOf(const RenderOptions& options, std::uint64_t frames) {
  const std::string extension =
      CLI::detail::to_lower(std::filesystem::path(options.output).extension().string());
  const bool numbered = countsFrames(options.output);
  if (extension != ".png" && extension != ".mp4")
    throw CLI::ValidationError("--output", fmt::format("'{}' does not end in .png or .mp4", options.output));
  if (extension == ".mp4" && numbered)
    throw CLI::ValidationError("--output",
                               fmt::format("'{}' counts frames, and a movie holds all", options.output));
  if (extension != ".mp4" && !options.fps.empty()) throw CLI::ValidationError("--fps", "is for movies");
  if ((options.colour == Colour::kError) != !options.volumes.paths.empty())
    throw CLI::ValidationError("--volumes", "and --color error need each other");
  if (options.range && options.colour == Colour::kNone)
    throw CLI::ValidationError("--range", "needs --color curvature or --color error");
  if (options.overlay == Overlay::kMotion && options.level)
    throw CLI::ValidationError("--level", "excludes --overlay motion: vectors belong to the full surface");
  if (options.overlay == Overlay::kNone && options.overlay_scale)
    throw CLI::ValidationError("--overlay-scale", "needs --overlay motion");
  if (extension == ".mp4") return Product::kMovie;
  return numbered ? Product::kPictures : frames > 1 ? Product::kSheet : Product::kPicture;
}

inspect::RenderSettings settingsOf(const RenderOptions& options, Product product) {
  inspect::RenderSettings settings;
  settings.smooth = !options.facets;
  settings.wireframe = options.wireframe;
  const std::string size =
      options.size.empty() ? (product == Product::kSheet ? "480x360" : "1280x960") : options.size;
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
  if (!options.view.empty()) {
    const auto& [azimuth, elevation] = choice("--view", kViews, options.view);
    settings.camera.azimuth = azimuth;
    settings.camera.elevation = elevation;
  }
  settings.camera.zoom = options.zoom;
  settings.camera.turning = options.orbit != 0;
  return settings;
}

void addOptions(CLI::App& verb, RenderOptions& options) {
  verb.add_option("input", options.input, kInputHelp)->required();
  addTrackOption(verb, options.track);
  verb.add_option(
          "-o,--output", options.output,
          "PNG file: one frame's picture, a contact sheet of several, or with %05d one a frame; or .mp4")
      ->required();
  verb.add_option("--frames", options.frames, kFramesHelp);
  verb.add_option("--size", options.size,
                  "WIDTHxHEIGHT in pixels, of each picture (default: 1280x960; in a contact sheet 480x360)");
  CLI::Option* camera = verb.add_option(
      "--camera", options.camera, "AZIMUTH,ELEVATION in degrees, around the z axis and above the horizon");
  verb.add_option("--view", options.view, "A fixed view: front, back, left, right, top, bottom or iso")
      ->excludes(camera);
  verb.add_option("--orbit", options.orbit, "Degrees that the camera turns around over the whole sequence")
      ->check(CLI::Range(-36000.0, 36000.0));
  verb.add_option("--zoom", options.zoom, "1 fits the whole sequence")->check(CLI::Range(0.01, 100.0));
  verb.add_option(
      "--level", options.level,
      "Coarser surface: octree level from the root (0), or from the finest (-1: cells twice as large)");
  verb.add_flag("--wireframe", options.wireframe, "Draw the quads' edges");
  verb.add_flag("--facets", options.facets, "Flat triangles instead of smooth shading");
  verb.add_option_function<std::string>(
          "--color",
          [&options](const std::string& text) { options.colour = choice("--color", kColours, text); },
          "Colour by mean curvature (1/cells), or by the distance to the volume's isosurface (cells)")
      ->default_str("none")
      ->type_name("none|curvature|error");
  verb.add_option(
          "--range", options.range,
          "Where the colours end: curvature from -X to X (default 0.5), error from 0 to X (default 0.1)")
      ->check(CLI::Range(1e-9, 1e9));
  options.volumes.add(verb, "--volumes");
  verb.add_option_function<std::string>(
          "--overlay",
          [&options](const std::string& text) { options.overlay = choice("--overlay", kOverlays, text); },
          "Over P frames: an arrow from each block to where its piece of surface goes, as it has moved since "
          "the frame before, and the I blocks, which are not predicted")
      ->default_str("none")
      ->type_name("none|motion");
  verb.add_option(
          "--overlay-scale", options.overlay_scale,
          "Arrows are N times as long as the motion (default: so that fast ones, of all frames shown, "
          "are one and a half blocks long, and 1 at least)")
      ->check(CLI::Range(1e-3, 1e6));
  verb.add_option("--beside", options.beside, "Another file, shown to the right by the same camera");
  verb.add_option("--fps", options.fps, "Movies: frames a second (default: the sequence's own times)");
  verb.add_option("--tiles", options.tiles, "Pictures in a contact sheet, at most")
      ->check(CLI::Range(1, 400));
  verb.add_option("--jobs", options.jobs, "Threads; 0: one a core")->check(CLI::Range(0, 256));
  verb.add_flag("--force", options.force, "Replace pictures that are there already");
  verb.add_flag("--json", options.json, "End with the totals as one JSON object");
}

}  // namespace isoreel::cli
