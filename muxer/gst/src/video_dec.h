// SPDX-License-Identifier: BSD-3-Clause
// isoreelvideodec: packets to pictures, for players.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

bool registerVideoDecoder(GstPlugin* plugin);

}  // namespace isoreel::gst
