// SPDX-License-Identifier: BSD-3-Clause
// The entry point of libgstisoreel.so. `gst-inspect-1.0 isoreel` lists what is registered here.
#include "common.h"
#include "dec.h"
#include "demux.h"
#include "enc.h"
#include "mux.h"
#include "render.h"
#include "tags.h"
#include "video_dec.h"
#include "volume_src.h"

GST_DEBUG_CATEGORY(isoreel_debug);

namespace {

gboolean initialise(GstPlugin* plugin) {
  GST_DEBUG_CATEGORY_INIT(isoreel_debug, "isoreel", 0, "Time-varying isosurfaces");
  using namespace isoreel::gst;
  registerTags();
  bool registered = registerVolumeSource(plugin);
  registered = registerEncoder(plugin) && registered;
  registered = registerMux(plugin) && registered;
  registered = registerDemux(plugin) && registered;
  registered = registerDecoder(plugin) && registered;
  registered = registerRenderer(plugin) && registered;
  registered = registerVideoDecoder(plugin) && registered;
  return registered;
}

}  // namespace

#define PACKAGE "isoreel"
GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, isoreel,
                  "Codec, container and player for time-varying isosurfaces", initialise, ISOREEL_VERSION,
                  "BSD", "Isoreel", "isoreel")
