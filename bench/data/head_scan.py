#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the head scan, a set over isovalues, from an InVesalius project (Debian's invesalius-examples has one, GPL-2).

usage: head_scan.py PROJECT.inv3 NODES FOLDER"""

import gzip
import json
import plistlib
import sys
import tarfile
from pathlib import Path

import numpy

EDGE = 218.0  # mm, of the cube that is taken: the head from the first slice on, in the middle of the others
AIR = -1024.0  # Hounsfield units, where the scan has no slice
ISOVALUES = [float(value) for value in range(-500, 1251, 50)]


def read_project(path):
    """Samples as (z, y, x), and their spacing in that order."""
    with tarfile.open(path) as archive:
        members = {Path(member.name).name: member for member in archive.getmembers()}
        facts = plistlib.load(archive.extractfile(members["main.plist"]))
        matrix = facts["matrix"]
        samples = numpy.frombuffer(archive.extractfile(members[matrix["filename"]]).read(), dtype="<i2")
    return samples.reshape(matrix["shape"]).astype(numpy.float32), facts["spacing"][::-1]


def resample(samples, axis, at):
    """Linear along an axis, at positions that count in samples; air outside. Three of these are trilinear."""
    below = numpy.clip(numpy.floor(at).astype(int), 0, samples.shape[axis] - 2)
    shape = [1, 1, 1]
    shape[axis] = -1
    part = (at - below).astype(numpy.float32).reshape(shape)
    result = numpy.take(samples, below, axis) * (1 - part) + numpy.take(samples, below + 1, axis) * part
    outside = ((at < 0) | (at > samples.shape[axis] - 1)).reshape(shape)
    return numpy.where(outside, numpy.float32(AIR), result)


def main():
    project, nodes, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    samples, spacing = read_project(project)
    step = EDGE / (nodes - 1)
    for axis in range(3):
        start = 0 if axis == 0 else ((samples.shape[axis] - 1) * spacing[axis] - EDGE) / 2
        samples = resample(samples, axis, (start + step * numpy.arange(nodes)) / spacing[axis])
    header = (f"NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: {nodes} {nodes} {nodes}\n"
              f"space directions: ({step},0,0) (0,{step},0) (0,0,{step})\nendian: little\nencoding: gzip\n"
              "space origin: (0,0,0)\n\n")
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "headscan.nrrd", "wb") as file:
        file.write(header.encode() + gzip.compress(samples.astype("<f4").tobytes(), mtime=0))
    described = {"name": f"headscan {nodes}³", "inputs": ["headscan.nrrd"], "isovalues": ISOVALUES, "inside": "above"}
    (folder / "set.json").write_text(json.dumps(described, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
