// SPDX-License-Identifier: BSD-3-Clause
// isoreelvolumesrc: volume files as application/x-volume.
#pragma once

#include <gst/gst.h>

namespace isoreel::gst {

bool registerVolumeSource(GstPlugin* plugin);

}  // namespace isoreel::gst
