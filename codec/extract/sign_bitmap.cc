// SPDX-License-Identifier: BSD-3-Clause
#include "extract/sign_bitmap.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace isoreel {
namespace {

/// isInside() for up to 64 samples at once.
class Comparison {
 public:
  Comparison(double isovalue, Inside inside) : isovalue_(isovalue), inside_(inside) {
    // A float is below a number when it is below the least float that is not.
    side_ = inside == Inside::kBelow ? 1.0f : -1.0f;
    limit_ = side_ * static_cast<float>(isovalue);
    if (static_cast<double>(limit_) < static_cast<double>(side_) * isovalue)
      limit_ = std::nextafter(limit_, std::numeric_limits<float>::infinity());
  }

  /// A bit for each; sets `bad` when one is not finite.
  std::uint64_t operator()(const float* samples, std::size_t count, bool& bad) const {
    Four inside{}, strange{};
    std::size_t i = 0;
    for (; i + 4 <= count; i += 4) {
      FourFloats v;
      std::memcpy(&v, samples + i, sizeof v);
      const Four finite = v - v == 0.0f;
      inside |= (v * side_ < limit_) & finite & (1 << i / 4);
      strange |= ~finite;
    }
    std::uint64_t bits = 0;
    for (std::size_t lane = 0; lane < 4; ++lane)
      bits |= everyFourth(static_cast<std::uint32_t>(inside[lane])) << lane;
    for (; i < count; ++i) {
      bits |= std::uint64_t{isInside(samples[i], isovalue_, inside_)} << i;
      bad |= !(samples[i] - samples[i] == 0.0f);
    }
    bad |= (strange[0] | strange[1] | strange[2] | strange[3]) != 0;
    return bits;
  }

 private:
  using FourFloats = float __attribute__((vector_size(16)));
  using Four = std::int32_t __attribute__((vector_size(16)));

  /// 16 bits, put at 0, 4, 8 and so on.
  static std::uint64_t everyFourth(std::uint64_t bits) {
    bits = (bits | bits << 24) & 0x000000FF000000FF;
    bits = (bits | bits << 12) & 0x000F000F000F000F;
    bits = (bits | bits << 6) & 0x0303030303030303;
    return (bits | bits << 3) & 0x1111111111111111;
  }

  double isovalue_;
  Inside inside_;
  float side_, limit_;
};

/// By all but the lowest byte; digit by digit, as a comparison a digit is wrong half of the time.
void sortCodes(std::vector<std::uint64_t>& codes) {
  constexpr int kDigit = 11;
  std::uint64_t all = 0;
  for (const std::uint64_t code : codes) all |= code;
  std::vector<std::uint64_t> sorted(codes.size());
  for (int shift = 8; shift < 64 && all >> shift != 0; shift += kDigit) {
    const auto digit = [shift](std::uint64_t code) {
      return static_cast<std::size_t>(code >> shift) & ((1u << kDigit) - 1);
    };
    std::array<std::uint32_t, (1u << kDigit) + 1> starts{};
    for (const std::uint64_t code : codes) ++starts[digit(code) + 1];
    for (std::size_t n = 0; n < 1u << kDigit; ++n) starts[n + 1] += starts[n];
    for (const std::uint64_t code : codes) sorted[starts[digit(code)]++] = code;
    codes.swap(sorted);
  }
}

}  // namespace

SignBitmap SignBitmap::empty(const std::array<std::uint32_t, 3>& nodes) {
  SignBitmap result;
  result.nodes_ = nodes;
  result.row_words_ = (nodes[0] + 63) / 64;
  result.words_.assign(result.row_words_ * nodes[1] * nodes[2], 0);
  return result;
}

// Neighbours differ in sign only where an active cell knows both of them. So whatever is not known is as the
// nodes before it in its row, or behind them at the start; a row of which nothing is known is as the row
// beside it.
SignBitmap SignBitmap::fromCells(const std::array<std::uint32_t, 3>& nodes, std::span<const Cell> cells,
                                 bool filled) {
  SignBitmap known = empty(nodes), inside = empty(nodes);
  for (const Cell& cell : cells) {
    for (std::uint32_t j = 0; j < 8; ++j) {
      const std::uint32_t x = cell.x + (j & 1), y = cell.y + (j >> 1 & 1), z = cell.z + (j >> 2);
      known.set(x, y, z);
      if (cell.corners >> j & 1) inside.set(x, y, z);
    }
  }
  const auto firstKnown = [&](std::uint32_t y, std::uint32_t z) {
    const std::uint64_t* row = known.row(y, z);
    for (std::size_t w = 0; w < known.row_words_; ++w) {
      if (row[w] != 0)
        return static_cast<std::uint32_t>(w * 64) + static_cast<std::uint32_t>(std::countr_zero(row[w]));
    }
    return nodes[0];
  };
  std::optional<bool>
      start;  // the sign at the start of the row before; in front of all, that of the first that is known
  for (std::uint32_t row = 0; row < nodes[1] * std::uint64_t{nodes[2]} && !start; ++row) {
    const std::uint32_t x = firstKnown(row % nodes[1], row / nodes[1]);
    if (x < nodes[0]) start = inside.at(x, row % nodes[1], row / nodes[1]);
  }
  for (std::uint32_t z = 0; z < nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < nodes[1]; ++y) {
      const std::uint32_t first = firstKnown(y, z);
      bool sign = start.value_or(filled);
      if (y == 0 && z > 0) sign = inside.at(0, 0, z - 1);
      if (first < nodes[0]) sign = inside.at(first, y, z);
      start = sign;
      for (std::uint32_t x = 0; x < nodes[0]; ++x) {
        if (known.at(x, y, z)) {
          sign = inside.at(x, y, z);
        } else if (sign) {
          inside.set(x, y, z);
        }
      }
    }
  }
  return inside;
}

Result<SignBitmap> SignBitmap::make(const Volume& volume, double isovalue, Inside inside,
                                    NonFinite non_finite, const ParallelFor& parallel) {
  const auto& nodes = volume.grid.nodes;
  SignBitmap result = empty(nodes);
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> first_bad(nodes[2], kNone);
  const Comparison compare(isovalue, inside);
  parallel(nodes[2], [&](std::size_t z) {
    for (std::size_t y = 0; y < nodes[1]; ++y) {
      const std::size_t start = (z * nodes[1] + y) * nodes[0];
      std::uint64_t* words = result.words_.data() + (z * nodes[1] + y) * result.row_words_;
      bool bad = false;
      for (std::size_t x = 0; x < nodes[0]; x += 64)
        words[x / 64] = compare(&volume.samples[start + x], std::min<std::size_t>(64, nodes[0] - x), bad);
      if (!bad || first_bad[z] != kNone) continue;
      for (std::size_t x = 0; x < nodes[0] && first_bad[z] == kNone; ++x) {
        const float sample = volume.samples[start + x];
        if (!(sample - sample == 0.0f)) first_bad[z] = start + x;
      }
    }
  });
  if (non_finite == NonFinite::kRefuse) {
    for (const std::size_t at : first_bad) {
      if (at == kNone) continue;
      const float sample = volume.samples[at];
      return {ErrorCode::kInvalidArgument,
              "sample at node (" + std::to_string(at % nodes[0]) + ", " +
                  std::to_string(at / nodes[0] % nodes[1]) + ", " + std::to_string(at / nodes[0] / nodes[1]) +
                  ") is " +
                  (sample != sample ? "not a number"
                   : sample > 0     ? "+infinity"
                                    : "-infinity") +
                  "; samples must be finite, unless such samples are to be taken as outside"};
    }
  }
  return result;
}

std::vector<Cell> SignBitmap::activeCells(const ParallelFor& parallel) const {
  std::vector<std::vector<std::uint64_t>> layers(nodes_[2] - 1);
  parallel(layers.size(), [&](std::size_t layer) {
    const std::uint32_t z = static_cast<std::uint32_t>(layer);
    for (std::uint32_t y = 0; y + 1 < nodes_[1]; ++y) {
      const std::array<const std::uint64_t*, 4> rows{row(y, z), row(y + 1, z), row(y, z + 1),
                                                     row(y + 1, z + 1)};
      // Whether any, and whether all, of the four nodes at an x are inside: the next word's lowest bit comes
      // along.
      const auto any = [&](std::size_t w) {
        return w < row_words_ ? rows[0][w] | rows[1][w] | rows[2][w] | rows[3][w] : 0;
      };
      const auto all = [&](std::size_t w) {
        return w < row_words_ ? rows[0][w] & rows[1][w] & rows[2][w] & rows[3][w] : 0;
      };
      for (std::size_t w = 0; w < row_words_; ++w) {
        std::uint64_t mixed =
            (any(w) | any(w) >> 1 | any(w + 1) << 63) & ~(all(w) & (all(w) >> 1 | all(w + 1) << 63));
        const std::size_t cells_left = nodes_[0] - 1 - std::min<std::size_t>(nodes_[0] - 1, w * 64);
        if (cells_left < 64) mixed &= (std::uint64_t{1} << cells_left) - 1;
        for (; mixed != 0; mixed &= mixed - 1) {
          const auto bit = static_cast<std::uint32_t>(std::countr_zero(mixed));
          std::uint64_t corners = 0;
          for (std::size_t k = 0; k < 4; ++k) {
            std::uint64_t two = rows[k][w] >> bit;
            if (bit == 63) two |= rows[k][w + 1] << 1;
            corners |= (two & 3) << 2 * k;
          }
          layers[layer].push_back(mortonCode(static_cast<std::uint32_t>(w * 64) + bit, y, z) << 8 | corners);
        }
      }
    }
  });
  std::vector<std::uint64_t> codes;  // Morton codes, and in the lowest byte the corners
  for (std::vector<std::uint64_t>& layer : layers) {
    codes.insert(codes.end(), layer.begin(), layer.end());
    layer = {};
  }
  sortCodes(codes);
  std::vector<Cell> cells(codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const std::uint64_t code = codes[i] >> 8;
    cells[i] = {static_cast<std::uint16_t>(gatherBits(code)),
                static_cast<std::uint16_t>(gatherBits(code >> 1)),
                static_cast<std::uint16_t>(gatherBits(code >> 2)), static_cast<std::uint8_t>(codes[i])};
  }
  return cells;
}

double SignBitmap::insideCells() const {
  double sum = 0;
  for (std::uint32_t z = 0; z < nodes_[2]; ++z) {
    for (std::uint32_t y = 0; y < nodes_[1]; ++y) {
      int count = 0;
      for (std::size_t w = 0; w < row_words_; ++w) count += std::popcount(row(y, z)[w]);
      const double along = count - (at(0, y, z) + at(nodes_[0] - 1, y, z)) / 2.0;
      sum += along * (y == 0 || y + 1 == nodes_[1] ? 0.5 : 1.0) * (z == 0 || z + 1 == nodes_[2] ? 0.5 : 1.0);
    }
  }
  return sum;
}

}  // namespace isoreel
