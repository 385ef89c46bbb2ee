// SPDX-License-Identifier: BSD-3-Clause
// Isoreel on a whole sequence, since its frames lean on each other.
#pragma once

#include <functional>
#include <span>

#include "coder.h"

namespace isoreel::bench {

class IsoreelCoder {
 public:
  IsoreelCoder(std::string variant, EncoderSettings settings)
      : variant_(std::move(variant)), settings_(std::move(settings)) {}

  Label label() const {
    return {"isoreel", variant_, static_cast<double>(settings_.configuration.step) / kCell};
  }
  /// Codes the frames, in order, in GOPs as the settings say.
  Status encode(std::span<const Frame> frames);
  /// Decodes them all; without visit() also makes triangles, as is measured.
  Status decode(const std::function<void(std::size_t, const Surface&)>& visit = {}) const;
  std::size_t bytes() const;
  const PacketSizes& parts() const { return parts_; }

 private:
  std::string variant_;
  EncoderSettings settings_;
  std::vector<Bytes> packets_;
  PacketSizes parts_;
};

}  // namespace isoreel::bench
