// SPDX-License-Identifier: BSD-3-Clause
// isoreelmux: packets to an .isr file.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

bool registerMux(GstPlugin* plugin);

}  // namespace isoreel::gst
