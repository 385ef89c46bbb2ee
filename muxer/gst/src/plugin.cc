// SPDX-License-Identifier: BSD-3-Clause
// The entry point of libgstisoreel.so. `gst-inspect-1.0 isoreel` lists what is registered here.
#include "common.h"

GST_DEBUG_CATEGORY(isoreel_debug);

namespace {

gboolean initialise(GstPlugin* plugin) {
  GST_DEBUG_CATEGORY_INIT(isoreel_debug, "isoreel", 0, "Time-varying isosurfaces");
  static_cast<void>(plugin);
  return TRUE;
}

}  // namespace

#define PACKAGE "isoreel"
GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, isoreel,
                  "Codec, container and player for time-varying isosurfaces", initialise, ISOREEL_VERSION,
                  "BSD", "Isoreel", "https://isoreel.invalid/")
