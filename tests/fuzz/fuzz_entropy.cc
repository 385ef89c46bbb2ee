// SPDX-License-Identifier: BSD-3-Clause
// The range coder: what is put is what is got, in whatever order calls come; and arbitrary bytes can be got.
#include <cstdlib>

#include "entropy/mixer.h"
#include "entropy/residual.h"

namespace {

using isoreel::ByteReader;
using isoreel::ByteSpan;

struct Models {
  std::array<isoreel::BitModel, 4> bits;
  std::array<isoreel::ResidualModels, 2> residuals;
};

/// One call for two bytes of the input, with what they say to put; the sum of what comes out.
template <class Coder>
std::uint64_t run(Coder& coder, ByteSpan calls) {
  Models models;
  std::uint64_t sum = 0;
  ByteReader in(calls);
  while (in.left() >= 2) {
    const std::uint32_t call = in.fixed<std::uint8_t>(), value = in.fixed<std::uint8_t>();
    std::uint64_t got = 0;
    switch (call & 3) {
      case 0:
        got = coder.code(models.bits[call >> 2 & 3], (value & 1) != 0);
        break;
      case 1: {
        const std::int32_t size = static_cast<std::int32_t>(value << (call >> 3 & 7) | (call >> 6));
        got = static_cast<std::uint32_t>(
            codeResidual(coder, models.residuals[call >> 2 & 1], call & 4 ? -size : size));
        break;
      }
      case 2:
        got = coder.raw(static_cast<int>(call >> 2 & 7) + 1, value & ((2u << (call >> 2 & 7)) - 1));
        break;
      default: {
        const std::uint32_t one = 1 + (call >> 2) * 1040;
        got = coder.codeAt(one, one >= 32768, (value & 1) != 0);
      }
    }
    sum = sum * 31 + got;
  }
  return sum;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan calls(data, size);
  isoreel::Bytes stream;
  isoreel::RangePut put(stream);
  const std::uint64_t wanted = run(put, calls);
  put.finish();
  isoreel::RangeGet get(stream);
  if (run(get, calls) != wanted || !get.finished()) std::abort();
  isoreel::RangeGet wild(calls);
  static_cast<void>(run(wild, calls));
  return 0;
}
