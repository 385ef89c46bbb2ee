// SPDX-License-Identifier: BSD-3-Clause
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include "coder.h"

namespace isoreel::bench {
namespace {

class DracoCoder : public Coder {
 public:
  DracoCoder(int speed, int bits) : speed_(speed), bits_(bits) {}

  Label label() const override {
    return {"draco", "speed " + std::to_string(speed_), static_cast<double>(bits_)};
  }
  void prepare(const Frame& frame) override {
    coded_ = draco::EncoderBuffer();
    decoded_.reset();
    const auto& [points, triangles] = frame.extracted;
    mesh_ = std::make_unique<draco::Mesh>();
    mesh_->set_num_points(static_cast<std::uint32_t>(points.size()));
    draco::GeometryAttribute position;
    position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float),
                  0);
    const int id = mesh_->AddAttribute(position, true, static_cast<std::uint32_t>(points.size()));
    for (std::uint32_t i = 0; i < points.size(); ++i)
      mesh_->attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), points[i].data());
    mesh_->SetNumFaces(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const auto& [a, b, c] = triangles[i];
      mesh_->SetFace(draco::FaceIndex(i), {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
    }
  }
  Status encode() override {
    draco::Encoder encoder;
    encoder.SetSpeedOptions(speed_, speed_);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits_);
    coded_.Clear();
    return status(encoder.EncodeMeshToBuffer(*mesh_, &coded_));
  }
  Status decode() override {
    draco::DecoderBuffer buffer;
    buffer.Init(coded_.data(), coded_.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    ISOREEL_TRY(status(decoded.status()));
    decoded_ = std::move(decoded).value();
    return {};
  }
  std::size_t bytes() const override { return coded_.size(); }
  inspect::Mesh mesh() const override {
    inspect::Mesh result;
    const draco::PointAttribute* position = decoded_->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    result.points.resize(decoded_->num_points());
    for (std::uint32_t i = 0; i < result.points.size(); ++i)
      position->GetMappedValue(draco::PointIndex(i), result.points[i].data());
    for (std::uint32_t i = 0; i < decoded_->num_faces(); ++i) {
      const auto& face = decoded_->face(draco::FaceIndex(i));
      result.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
    }
    return result;
  }

 private:
  static Status status(const draco::Status& status) {
    if (status.ok()) return {};
    return {ErrorCode::kBadData, std::string("draco: ") + status.error_msg()};
  }

  int speed_, bits_;
  std::unique_ptr<draco::Mesh> mesh_;
  draco::EncoderBuffer coded_;
  std::unique_ptr<draco::Mesh> decoded_;
};

}  // namespace

std::unique_ptr<Coder> dracoCoder(int speed, int bits) { return std::make_unique<DracoCoder>(speed, bits); }

}  // namespace isoreel::bench
