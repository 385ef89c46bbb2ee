// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/base/packet.h>

#include <limits>

namespace isoreel {

std::int64_t TimeBase::tickAt(std::int64_t seconds, std::int64_t parts) const {
  __extension__ using Wide = __int128;
  const Wide dividend = Wide{seconds} * denominator, divisor = Wide{parts} * numerator;
  const Wide quotient = dividend / divisor, floor = quotient - (dividend % divisor < 0 ? 1 : 0);
  using Limits = std::numeric_limits<std::int64_t>;
  if (floor > Limits::max()) return Limits::max();
  if (floor < Limits::min()) return Limits::min();
  return static_cast<std::int64_t>(floor);
}

std::optional<std::uint64_t> frameAt(const PacketSource& source, std::int64_t time) {
  std::uint64_t low = 0, high = source.frameCount();  // the first frame that begins later lies between
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (source.header(middle).time <= time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == 0) return std::nullopt;
  return low - 1;
}

}  // namespace isoreel
