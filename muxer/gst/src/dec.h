// SPDX-License-Identifier: BSD-3-Clause
// isoreeldec: packets to triangle meshes.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

/// Packets as isoreeldemux gives them, and as stock demuxers hand on what they do not know.
inline constexpr char kCodedCaps[] =
    "video/x-isoreel; video/x-gst-fourcc-ISRL; video/x-unknown, fourcc = (string) ISRL";

GType decoderType();
/// isoreeldec's properties, for it and for a bin that has one.
void installDecoderProperties(GObjectClass* klass);
bool registerDecoder(GstPlugin* plugin);

}  // namespace isoreel::gst
