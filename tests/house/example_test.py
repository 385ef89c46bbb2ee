#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Encodes the bundled sequence, runs examples/walk_triangles on it, and compares the areas it adds up from decoded
triangles with those that the encoder wrote into the frame headers.

usage: example_test.py ISOREEL WALK_TRIANGLES SEQUENCE"""

import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{words} exits {done.returncode}: {done.stderr}")
    return done.stdout


def main():
    isoreel, walk, sequence = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "droplets.isr"
        run(isoreel, "encode", sequence, "-o", file)
        walked = [float(area) for area in re.findall(r"area (\S+)", run(walk, file))]
        frames = json.loads(run(isoreel, "info", file, "--frames", "--json"))["frame_list"]
    if len(walked) != len(frames) or not frames:
        sys.exit(f"the example walks {len(walked)} frames of {len(frames)}")
    for number, (area, frame) in enumerate(zip(walked, frames)):
        if area <= 0 or not math.isclose(area, frame["area"], rel_tol=1e-6):
            sys.exit(f"frame {number}: the example's area is {area}, the header's {frame['area']}")
    print(f"{len(frames)} frames walked")


if __name__ == "__main__":
    main()
