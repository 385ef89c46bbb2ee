// SPDX-License-Identifier: BSD-3-Clause
// isoreelrender: triangle meshes to pictures.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

inline constexpr char kPictureCaps[] =
    "video/x-raw, format = (string) RGBA, width = (int) [ 1, 16384 ], height = (int) [ 1, 16384 ], framerate "
    "= "
    "(fraction) [ 0/1, 2147483647/1 ]";

GType rendererType();
/// isoreelrender's properties, for it and for a bin that has one.
void installRendererProperties(GObjectClass* klass);
bool registerRenderer(GstPlugin* plugin);

}  // namespace isoreel::gst
