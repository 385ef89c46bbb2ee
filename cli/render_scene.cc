// SPDX-License-Identifier: BSD-3-Clause
#include "render_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "decoding.h"
#include "output.h"
#include "packet_list.h"
#include "parallel.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

DecodeOptions optionsOf(const std::optional<int>& level, const Grid& grid) {
  DecodeOptions result = decodeOptions();
  if (!level) return result;
  const std::int64_t from_root = *level >= 0 ? *level : std::int64_t{octreeDepth(grid)} + *level;
  result.level = static_cast<std::uint32_t>(std::max<std::int64_t>(from_root, 0));
  return result;
}

}  // namespace

Result<Scene> Scene::open(const RenderOptions& options) {
  Scene scene;
  scene.options_ = &options;
  if (options.input == "-" && options.beside == "-")
    throw CLI::ValidationError("--beside", "standard input holds one file only");
  for (const std::string& path : {options.input, options.beside}) {
    if (path.empty()) continue;
    ISOREEL_ASSIGN(Input input, openInput(path, options.track));
    warnOfDamage(input.info, path);
    if (input.packets->frameCount() == 0) return {ErrorCode::kNotFound, path + ": holds no frame"};
    Source source{path, std::move(input), nullptr, {}};
    source.player = std::make_unique<Player>(*source.input.packets, 0, parallelWithin);  // forward only
    source.decode = optionsOf(options.level, source.input.configuration.grid);
    scene.sources_.push_back(std::move(source));
  }
  if (options.volumes.paths.empty()) return scene;
  ISOREEL_ASSIGN(scene.volumes_, io::openVolumes(options.volumes.paths, options.volumes.options));
  for (const Source& source : scene.sources_) {
    const std::uint64_t count = source.input.packets->frameCount();
    if (scene.volumes_->size() != 1 && scene.volumes_->size() != count) {
      return {ErrorCode::kInvalidArgument,
              fmt::format("{} has {}, --volumes {}", source.path, counted(count, "frame"),
                          counted(scene.volumes_->size(), "volume"))};
    }
    ISOREEL_TRY(sameBox(*scene.volumes_, source.input.configuration.grid, source.path));
  }
  return scene;
}

Status Scene::prepare(const FrameRange& range, Product product) {
  settings_ = settingsOf(*options_, product);
  for (const Source& source : sources_) {
    if (const std::uint64_t count = source.input.packets->frameCount(); count < range.end) {
      return {ErrorCode::kInvalidArgument,
              fmt::format("{} has {}, too few to stand beside those of {}", source.path,
                          counted(count, "frame"), options_->input)};
    }
    for (std::uint64_t i = range.begin; i < range.end; ++i) {
      settings_.frame.join(
          inspect::boundingBox(source.input.packets->header(i), source.input.configuration.grid));
    }
  }
  return {};
}

Status Scene::measureMotion(const std::vector<std::uint64_t>& drawn) {
  if (options_->overlay != Overlay::kMotion) return {};
  Progress progress("motion", drawn.size() * sources_.size());
  for (Source& source : sources_) {
    for (const std::uint64_t position : drawn) {
      if (interrupted) return {ErrorCode::kIo, "interrupted"};
      progress.advance();
      if (source.input.packets->header(position).type == PacketType::kIntra) continue;
      std::vector<MotionBlock> blocks;
      DecodeOptions options = decodeOptions();
      options.motion = &blocks;
      const Status status = source.player->frame(position, options).status();
      if (!status.ok()) return named(status, source.path);
      motion_.add(blocks);
    }
  }
  return {};
}

Status Scene::read(std::uint64_t position, Item& item) {
  for (Source& source : sources_) {
    const FrameHeader& header = source.input.packets->header(position);
    Shown shown;
    DecodeOptions options = source.decode;
    if (options_->overlay == Overlay::kMotion) options.motion = &shown.motion;
    Result<Surface> surface = source.player->frame(position, options);
    if (!surface) return named(surface.status(), source.path);
    ISOREEL_ASSIGN(const Bytes packet, source.input.packets->packet(position));
    shown.surface = *std::move(surface);
    shown.header = header;
    shown.caption =
        fmt::format("{}   frame {}   {} bytes", std::filesystem::path(source.path).filename().string(),
                    header.number, packet.size());
    item.shown.push_back(std::move(shown));
  }
  if (!volumes_) return {};
  ISOREEL_ASSIGN(item.volume, volumes_->read(volumes_->size() == 1 ? 0 : static_cast<std::size_t>(position)));
  return {};
}

std::optional<inspect::MotionOverlay> Scene::motionOf(const Shown& shown) const {
  if (options_->overlay != Overlay::kMotion) return std::nullopt;
  std::string caption = fmt::format("frame {}   {}", shown.header.number, typeName(shown.header.type));
  if (shown.header.type == PacketType::kPredicted) {
    const auto moving =
        std::count_if(shown.motion.begin(), shown.motion.end(), [](const MotionBlock& b) { return b.moves; });
    caption += fmt::format("   {} of {} blocks predicted", moving, shown.motion.size());
  }
  return inspect::MotionOverlay{shown.motion, options_->overlay_scale.value_or(motion_.scale()),
                                motion_.fastest(), std::move(caption)};
}

inspect::Attribute Scene::attributeOf(const Shown& shown, const inspect::Mesh& reference) const {
  inspect::Attribute attribute;
  switch (options_->colour) {
    case Colour::kNone:
      break;
    case Colour::kCurvature: {
      const double end = options_->range.value_or(0.5);
      attribute = {inspect::meanCurvature(shown.surface),
                   {inspect::Palette::kDiverging, -end, end, "mean curvature, 1/cells"}};
      break;
    }
    case Colour::kError:
      attribute = {
          inspect::vertexDistance(inspect::meshOf(shown.surface, volumes_->grid()), reference, parallelFor),
          {inspect::Palette::kSequential, 0, options_->range.value_or(0.1), "distance to the volume, cells"}};
      break;
  }
  return attribute;
}

void Scene::draw(Item& item) const {
  inspect::Mesh reference;
  std::vector<inspect::Image> images;
  std::vector<std::string> captions;
  for (const Shown& shown : item.shown) {
    if (volumes_ && images.empty()) {
      reference = inspect::volumeIsosurface(item.volume, shown.header.isovalue,
                                            sources_.front().input.configuration.inside);
    }
    inspect::RenderSettings settings = settings_;
    settings.camera.azimuth += options_->orbit * item.turn;
    settings.attribute = attributeOf(shown, reference);
    settings.motion = motionOf(shown);
    images.push_back(inspect::render(shown.surface, settings, parallelFor));
    captions.push_back(shown.caption);
  }
  item.image = images.size() == 1 ? std::move(images.front()) : inspect::contactSheet(images, captions, 2);
  item.shown.clear();
  item.volume = {};
}

}  // namespace isoreel::cli
