// SPDX-License-Identifier: BSD-3-Clause
// From frames of one or two files to pictures.
#pragma once

#include <isoreel/codec/player.h>

#include "input.h"
#include "render_options.h"

namespace isoreel::cli {

/// One frame of a file, ready to be drawn.
struct Shown {
  Surface surface;
  std::string caption;
  FrameHeader header;
  std::vector<MotionBlock> motion;  // of a P frame, when it is to be drawn
};

/// The files and volumes that pictures are made from. Positions count frames in both files alike.
class Scene {
 public:
  /// `options` must outlive the scene. Errors name the file.
  static Result<Scene> open(const RenderOptions& options);

  const Input& input() const { return sources_.front().input; }
  /// One camera and one box for all frames of the range; the picture's size and style from the options.
  Status prepare(const FrameRange& range, Product product);
  /// One scale of motion for all positions that are going to be drawn, which decodes them; nothing when no
  /// motion is drawn.
  Status measureMotion(const std::vector<std::uint64_t>& drawn);

  struct Item {
    std::vector<Shown> shown;  // left to right
    Volume volume;
    double turn = 0;  // of the camera, as a part of the orbit
    inspect::Image image;
  };
  /// Decodes a frame and reads its volume. One at a time.
  Status read(std::uint64_t position, Item& item);
  /// Draws it. Any thread.
  void draw(Item& item) const;

 private:
  struct Source {
    std::string path;
    Input input;
    std::unique_ptr<Player> player;
    DecodeOptions decode;
  };
  std::optional<inspect::MotionOverlay> motionOf(const Shown& shown) const;
  inspect::Attribute attributeOf(const Shown& shown, const inspect::Mesh& reference) const;

  const RenderOptions* options_ = nullptr;
  std::vector<Source> sources_;
  std::unique_ptr<io::VolumeSequence> volumes_;
  inspect::RenderSettings settings_;
  inspect::MotionRange motion_;
};

}  // namespace isoreel::cli
