// SPDX-License-Identifier: BSD-3-Clause
// isoreeldemux: an .isr file to packets.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

bool registerDemux(GstPlugin* plugin);

}  // namespace isoreel::gst
