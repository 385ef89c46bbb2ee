// SPDX-License-Identifier: BSD-3-Clause
// What `render` was asked for.
#pragma once

#include <isoreel/inspect/render.h>

#include <optional>
#include <string>

#include "frame_range.h"
#include "options.h"
#include "volume_input.h"

namespace isoreel::cli {

enum class Overlay { kNone, kMotion };
enum class Colour { kNone, kCurvature, kError };

struct RenderOptions {
  std::string input, output, beside;
  std::string frames;
  std::string track;
  std::string size;
  std::string camera = "35,25";
  std::string view;
  double orbit = 0;
  double zoom = 1;
  std::optional<int> level;
  bool wireframe = false;
  bool facets = false;
  Colour colour = Colour::kNone;
  std::optional<double> range;
  VolumeInput volumes;
  Overlay overlay = Overlay::kNone;
  std::optional<double> overlay_scale;
  std::string fps;
  std::size_t tiles = 12;
  int jobs = 0;
  bool force = false;
  bool json = false;
};

enum class Product { kPicture, kPictures, kSheet, kMovie };

/// What the output's name and the number of frames ask for; throws CLI::ValidationError for other names, and
/// for options that contradict each other.
Product productOf(const RenderOptions& options, std::uint64_t frames);

/// Size, camera and style; throws CLI::ValidationError for values that make no sense.
inspect::RenderSettings settingsOf(const RenderOptions& options, Product product);

void addOptions(CLI::App& verb, RenderOptions& options);

}  // namespace isoreel::cli
