// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/decoder.h>

#include "coder.h"

namespace isoreel::bench {
namespace {

class IsoreelCoder : public Coder {
 public:
  explicit IsoreelCoder(const Configuration& configuration) { settings_.configuration = configuration; }

  Label label() const override {
    return {"isoreel", "classic", static_cast<double>(settings_.configuration.step) / kCell};
  }
  void prepare(const Frame& frame) override {
    volume_ = frame.volume;
    timing_.isovalue = frame.isovalue;
    packet_ = Bytes();
    surface_ = {};
    triangles_ = std::vector<Triangle>();
  }
  Status encode() override {
    ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings_));
    ISOREEL_ASSIGN(Packet packet, encoder.encode(volume_, timing_, &sizes_));
    packet_ = std::move(packet.data);
    return {};
  }
  /// The others give triangles, so ours have to be made as well.
  Status decode() override {
    ISOREEL_ASSIGN(surface_, decoder_.decode(packet_));
    triangles_ = surface_.triangles();
    return {};
  }
  std::size_t bytes() const override { return packet_.size(); }
  PacketSizes parts() const override { return sizes_; }
  inspect::Mesh mesh() const override { return inspect::meshOf(surface_); }

 private:
  EncoderSettings settings_;
  Volume volume_;
  FrameTiming timing_;
  PacketSizes sizes_;
  Bytes packet_;
  Decoder decoder_;
  Surface surface_;
  std::vector<Triangle> triangles_;
};

}  // namespace

std::unique_ptr<Coder> isoreelCoder(const Configuration& configuration, std::uint32_t step) {
  Configuration at_step = configuration;
  at_step.step = step;
  return std::make_unique<IsoreelCoder>(at_step);
}

}  // namespace isoreel::bench
