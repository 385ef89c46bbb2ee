#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs examples/push_volumes, examples/gst_packets.py and examples/mesh_areas.py as people do, and looks at what they leave.

usage: example_test.py ISOREEL PUSH_VOLUMES GST_PACKETS.PY MESH_AREAS.PY"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0 or done.stderr:
        sys.exit(f"{words} exits {done.returncode}: {done.stderr}")
    return done.stdout


def main():
    isoreel, push, packets, areas = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "solver.isr"
        run(push, file)
        run(isoreel, "chapter", file, "--add", "0:4=Rise")
        if "10 frames" not in run(isoreel, "verify", file):
            sys.exit("the pushed steps are not ten frames")
        lines = run("/usr/bin/python3", packets, file, 3, 2).splitlines()  # the one that Debian's gi is for
        told = [float(line.split()[-1]) for line in run("/usr/bin/python3", areas, file).splitlines()]
        frames = json.loads(run(isoreel, "info", file, "--frames", "--json"))["frame_list"]
    if len(told) != 10 or any(abs(area / frame["area"] - 1) > 1e-4 for area, frame in zip(told, frames)):
        sys.exit(f"the triangles' areas are {told}")
    wanted = ["10 frames in 0.4 s", "chapter at 0 s: Rise", "frame 3: 0.12 s, P", "frame 4: 0.16 s, P"]
    if len(lines) != 4 or not all(line.startswith(start) for line, start in zip(lines, wanted)):
        sys.exit("the script prints\n" + "\n".join(lines))


if __name__ == "__main__":
    main()
