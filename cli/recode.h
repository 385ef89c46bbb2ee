// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "copy.h"

namespace isoreel::cli {

/// Packets in the place of others, by entry, and how far their vertices lie from where they were, in cells.
struct Recoded {
  Replacements packets;
  double rms = 0, max = 0;
};

/// The shown frames of a cut's first GOP, coded again from their decoded surfaces so that they need nothing
/// in front of them: the same faces and connections, vertices rounded to the GOP's step once more. Nothing
/// when the cut begins with a shown frame. Takes memory for the packets. Errors name the frame.
Result<Recoded> recode(PacketSource& packets, const Cut& cut);

}  // namespace isoreel::cli
