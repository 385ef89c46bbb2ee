// SPDX-License-Identifier: BSD-3-Clause
#include "gop.h"

namespace isoreel::cli {

Result<bool> GopSource::next(Gop& gop) {
  gop.packets.clear();
  if (ahead_) gop.packets.push_back(*std::move(ahead_));
  ahead_.reset();
  while (error_.ok()) {
    Packet packet;
    const Result<bool> more = next_(packet);
    if (!more) {
      error_ = more.status();
      break;
    }
    if (!*more) break;
    if (!gop.packets.empty() && packet.header.back != gop.packets.back().header.back + 1) {
      ahead_ = std::move(packet);
      return true;
    }
    gop.packets.push_back(std::move(packet));
  }
  if (!gop.packets.empty()) return true;
  if (!error_.ok()) return error_;
  return false;
}

}  // namespace isoreel::cli
