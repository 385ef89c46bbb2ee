// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>

#include <functional>
#include <optional>

namespace isoreel::cli {

/// Packets that decode one after another: a key and frames that depend on it. What may be worked on beside
/// other GOPs.
struct Gop {
  std::vector<Packet> packets;
};

/// Groups packets, as they come in order, by their keys.
class GopSource {
 public:
  /// `next` fills the next packet; false when there are no more.
  explicit GopSource(std::function<Result<bool>(Packet&)> next) : next_(std::move(next)) {}

  /// False when there are no more. An error comes after the packets before it.
  Result<bool> next(Gop& gop);

 private:
  std::function<Result<bool>(Packet&)> next_;
  std::optional<Packet> ahead_;  // the first of the next GOP
  Status error_;
};

}  // namespace isoreel::cli
