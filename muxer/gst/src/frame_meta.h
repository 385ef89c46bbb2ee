// SPDX-License-Identifier: BSD-3-Clause
// Facts that travel on buffers.
#pragma once

#include "common.h"

namespace isoreel::gst {

/// On packets: the frame's header, with the facts that a packet by itself does not tell (area, box, errors).
/// The encoder and the demuxer put it there; its number and time are those of the file it came from. Buffers
/// from elsewhere have none.
void addFrameHeader(GstBuffer* buffer, const FrameHeader& header);
/// Null when there is none. Good as long as the buffer.
const FrameHeader* frameHeader(GstBuffer* buffer);

/// On volumes: the isovalue that this buffer is meant for.
void addIsovalue(GstBuffer* buffer, double isovalue);
const double* isovalue(GstBuffer* buffer);

}  // namespace isoreel::gst
