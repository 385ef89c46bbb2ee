// SPDX-License-Identifier: BSD-3-Clause
// isoreelenc: volumes to packets.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

bool registerEncoder(GstPlugin* plugin);

}  // namespace isoreel::gst
