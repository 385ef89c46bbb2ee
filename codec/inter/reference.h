// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <span>
#include <vector>

#include "inter/reference_field.h"
#include "lattice/cell_index.h"

namespace isoreel {

/// The decoded surface of the packet before: tangent planes at its vertices, and its distance field.
class Reference {
 public:
  /// `cells`: those of the surface's vertices.
  void build(const Surface& surface, std::span<const Cell> cells) {
    setPlanes(surface, cells);
    buildField();
  }
  /// The same in two steps, since nothing may ever be predicted from a surface: until buildField() the field
  /// is empty.
  void setPlanes(const Surface& surface, std::span<const Cell> cells);
  void buildField() { static_cast<void>(field_.build(planes_)); }
  /// False, and no field, when reference and field would take more than `most` bytes.
  bool buildField(std::uint64_t most) {
    const std::uint64_t planes = bytesOf(planes_);
    return planes <= most && field_.build(planes_, most - planes);
  }

  const std::vector<ReferencePlane>& planes() const { return planes_; }
  const ReferenceField& field() const { return field_; }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return bytesOf(planes_) + field_.bytes(); }

 private:
  std::vector<ReferencePlane> planes_;
  ReferenceField field_;
};

}  // namespace isoreel
