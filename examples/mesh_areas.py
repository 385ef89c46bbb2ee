#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints the area of each frame's surface, from the triangles that GStreamer hands over.

(Packages python3-gi, gir1.2-gst-plugins-base-1.0, python3-numpy.)

usage: mesh_areas.py FILE.isr
"""
import sys

import gi
import numpy

gi.require_version("Gst", "1.0")
gi.require_version("GstApp", "1.0")
from gi.repository import Gst, GstApp  # noqa: E402, F401 (GstApp gives appsinks their methods)


def numbers(mesh, begin, size, kind):
    return numpy.frombuffer(mesh.extract_dup(begin, size), kind).reshape(-1, 3)


def meshes(path):
    pipeline = Gst.parse_launch("filesrc name=file ! isoreeldemux ! isoreeldec ! appsink name=meshes sync=false")
    pipeline.get_by_name("file").set_property("location", path)
    pipeline.set_state(Gst.State.PLAYING)
    sink = pipeline.get_by_name("meshes")
    problem = None
    while not sink.is_eos() and not problem:
        if sample := sink.try_pull_sample(Gst.SECOND // 10):
            yield sample.get_buffer()
        problem = pipeline.get_bus().pop_filtered(Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)
    if problem:
        sys.exit(problem.parse_error().gerror.message)


def main(path):
    for mesh in meshes(path):
        facts = mesh.get_custom_meta("IsoreelSurface").get_structure()
        first, second = (mesh.get_memory(i).size for i in (0, 1))
        points = numbers(mesh, 0, first, "<f4")  # x, y, z in the world
        corners = points[numbers(mesh, first, second, "<u4")]  # of each triangle
        normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = 0.5 * numpy.linalg.norm(normals, axis=1).sum()
        print(f"{facts.get_uint64('frame').value:6} {mesh.pts / Gst.SECOND:9.3f} s {len(points):9} vertices, area {area:.6g}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    Gst.init(None)
    main(sys.argv[1])
