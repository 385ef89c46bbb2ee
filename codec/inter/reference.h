// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <limits>
#include <span>
#include <vector>

#include "inter/reference_field.h"
#include "lattice/cell_index.h"

namespace isoreel {

/// The decoded surface of the packet before: tangent planes at its vertices, and its distance field.
class Reference {
 public:
  /// `cells`: those of the surface's vertices. Fast where the first corners of its quads rise, as
  /// dualQuads() has them.
  void build(const Surface& surface, std::span<const Cell> cells, const ParallelFor& parallel = serialFor) {
    setPlanes(surface, cells, parallel);
    buildField(parallel);
  }
  /// The same in two steps, since nothing may ever be predicted from a surface: until buildField() the field
  /// is empty.
  void setPlanes(const Surface& surface, std::span<const Cell> cells,
                 const ParallelFor& parallel = serialFor);
  void buildField(const ParallelFor& parallel = serialFor) {
    static_cast<void>(field_.build(planes_, std::numeric_limits<std::uint64_t>::max(), parallel));
  }
  /// False, and no field, when reference and field would take more than `most` bytes.
  bool buildField(std::uint64_t most, const ParallelFor& parallel) {
    const std::uint64_t planes = bytesOf(planes_);
    return planes <= most && field_.build(planes_, most - planes, parallel);
  }

  const std::vector<ReferencePlane>& planes() const { return planes_; }
  const ReferenceField& field() const { return field_; }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return bytesOf(planes_) + field_.bytes(); }

 private:
  template <class Chosen>
  void addNormal(const Surface& surface, const Quad& quad, const Chosen& chosen);

  std::vector<ReferencePlane> planes_;
  ReferenceField field_;
};

}  // namespace isoreel
