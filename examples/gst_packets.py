#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Tags, chapters and some packets of an .isr file, through GStreamer (packages python3-gi, gir1.2-gstreamer-1.0).

usage: gst_packets.py FILE.isr [FIRST [COUNT]]"""

import sys

import gi

gi.require_version("Gst", "1.0")
from gi.repository import Gst  # noqa: E402


def main():
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    path, first, count = sys.argv[1], int((sys.argv[2:3] or [0])[0]), int((sys.argv[3:4] or [10])[0])
    Gst.init(None)
    pipeline = Gst.parse_launch("filesrc name=file ! isoreeldemux ! appsink name=sink sync=false max-buffers=4")
    pipeline.get_by_name("file").set_property("location", path)
    sink, bus = pipeline.get_by_name("sink"), pipeline.get_bus()
    pipeline.set_state(Gst.State.PAUSED)
    chapters = []
    wanted = Gst.MessageType.ASYNC_DONE | Gst.MessageType.ERROR | Gst.MessageType.TOC
    while (message := bus.timed_pop_filtered(Gst.CLOCK_TIME_NONE, wanted)).type != Gst.MessageType.ASYNC_DONE:
        if message.type == Gst.MessageType.ERROR:
            pipeline.set_state(Gst.State.NULL)
            sys.exit(message.parse_error()[0].message)
        for edition in message.parse_toc()[0].get_entries():
            chapters += edition.get_sub_entries()

    frames = pipeline.query_duration(Gst.Format.DEFAULT)[1]
    print(f"{frames} frames in {pipeline.query_duration(Gst.Format.TIME)[1] / Gst.SECOND:g} s")
    for chapter in chapters:
        start = chapter.get_start_stop_times()[1]
        print(f"chapter at {start / Gst.SECOND:g} s: {chapter.get_tags().get_string('title')[1]}")

    last = min(first + count, frames)
    pipeline.seek(1.0, Gst.Format.DEFAULT, Gst.SeekFlags.FLUSH | Gst.SeekFlags.ACCURATE,
                  Gst.SeekType.SET, first, Gst.SeekType.SET, last)
    pipeline.set_state(Gst.State.PLAYING)
    while sample := sink.emit("pull-sample"):
        packet = sample.get_buffer()
        kind = "P" if packet.has_flags(Gst.BufferFlags.DELTA_UNIT) else "I"
        print(f"frame {packet.offset}: {packet.pts / Gst.SECOND:g} s, {kind}, {packet.get_size()} bytes")
    pipeline.set_state(Gst.State.NULL)


if __name__ == "__main__":
    main()
