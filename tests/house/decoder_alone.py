#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""isoreel::decoder needs zstd, xxHash and the C++ runtime, nothing else: looks at the shared libraries of a program that
links it alone, and at the include folders that the decoder's sources were compiled with (Eigen is headers only).

usage: decoder_alone.py PROGRAM COMPILE_COMMANDS_JSON"""

import json
import re
import subprocess
import sys

LIBRARIES = re.compile(
    r"(linux-vdso|linux-gate|ld-linux[\w-]*|libzstd|libxxhash|libstdc\+\+|libc\+\+\w*|libm|libgcc_s|libc|libdl|librt|"
    r"libpthread|libresolv|libasan|libubsan|libtsan)\.so")
HEAVY_INCLUDE = re.compile(r"-(?:I|isystem) ?\S*(eigen|openvdb|embree|teem|assimp|fmt|tbb)\S*", re.IGNORECASE)


def main():
    program, commands = sys.argv[1:]
    wrong = []
    listing = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    names = [line.split()[0].rsplit("/", 1)[-1] for line in listing.splitlines()]
    wrong += [f"links {name}" for name in names if not LIBRARIES.match(name)]
    if not any(name.startswith("libzstd") for name in names):
        wrong.append("does not link libzstd: this test looks at the wrong program")

    checked = 0
    with open(commands, encoding="utf-8") as file:
        entries = json.load(file)
    for entry in entries:
        objects = re.search(r"/(isoreel_(?:base|container_objects|codec_decode))\.dir/", entry.get("command", ""))
        if not objects:
            continue
        checked += 1
        heavy = HEAVY_INCLUDE.search(entry["command"])
        if heavy:
            wrong.append(f"{entry['file']} is compiled with {heavy.group()}")
    if checked == 0:
        wrong.append("found no source of the decoder in compile_commands.json")

    print("\n".join(wrong) if wrong else f"decoder alone: {len(names)} libraries, {checked} sources")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
