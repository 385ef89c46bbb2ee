// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <span>
#include <string>

namespace isoreel::inspect {

/// Whether a mesh is a 2-manifold, perhaps with a border: each edge has one quad, or two that run along it in
/// opposite directions, and the quads of each vertex are one fan.
struct Manifoldness {
  std::size_t faults = 0;  // vertices at which it is not
  std::string first;       // the first of them and what is wrong there, for people
  std::size_t border = 0;  // edges that have one quad
};

/// Tells it from the corners' numbers alone, all of them below `vertices`. Needs 8 bytes a corner and 4 a
/// vertex.
Manifoldness manifoldness(std::span<const Quad> quads, std::size_t vertices);

}  // namespace isoreel::inspect
