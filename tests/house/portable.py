#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""usage: portable.py SOURCE: builds the decoder with several compilers, levels of optimisation, without vector instructions
and for AArch64 (run by qemu-user), and decodes all vectors of packets with each: every surface has its hash, everywhere."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

WAYS = {  # name: compiler, options, what runs it
    "g++ -O0": ("g++", ["-O0"], []),
    "g++ -O3": ("g++", ["-O3"], []),
    "g++ -O3 -march=native": ("g++", ["-O3", "-march=native"], []),
    "g++ -O2, no vectors": ("g++", ["-O2", "-U__SSE2__", "-DXXH_VECTOR=0"], []),
    "clang++ -O0": ("clang++", ["-O0"], []),
    "clang++ -O3": ("clang++", ["-O3"], []),
    "AArch64, g++ -O2": ("aarch64-linux-gnu-g++", ["-O2", "-static"], ["qemu-aarch64"]),
}
ROOMS = ["base/src", "codec/lattice", "codec/intra", "codec/inter", "codec/syntax", "codec/decode"]


def main():
    source = pathlib.Path(sys.argv[1]).resolve()
    vectors = source / "spec" / "vectors"
    manifest = json.loads((vectors / "manifest.json").read_text())
    runs = [[each] for each in manifest["accept"]] + [each["packets"] for each in manifest["sequences"]]
    expected = {str(vectors / each["file"]): each["hash"] for run in runs for each in run}
    arguments = [word for run in runs for word in ["--", *(str(vectors / each["file"]) for each in run)]]
    files = [str(file) for room in ROOMS for file in sorted((source / room).glob("*.cc"))]
    files.append(str(source / "tests" / "house" / "portable.cc"))
    includes = [f"-I{source / room}" for room in ("base/include", "codec/include", "codec")]
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "portable"
        for name, (compiler, options, runner) in WAYS.items():
            if not all(shutil.which(each) for each in [compiler, *runner[:1]]):
                print(f"{name}: not installed")
                continue
            start = time.monotonic()
            # The hash's library is a header here, so that no other machine's packages are needed.
            subprocess.run([compiler, "-std=c++20", "-DXXH_INLINE_ALL", "-ffp-contract=off", "-w", *options, *includes,
                            *files, "-o", program], check=True)
            done = subprocess.run([*runner, program, *arguments], capture_output=True, text=True, check=False)
            got = dict(line.rsplit(" ", 1) for line in done.stdout.splitlines())
            differing = [file for file, value in expected.items() if got.get(file) != value]
            wrong += len(differing)
            print(f"{name}: {len(expected) - len(differing)} of {len(expected)} surfaces right, {time.monotonic() - start:.0f} s")
            for file in differing[:5]:
                print(f"  {file}: {got.get(file, 'none')}, should be {expected[file]}")
            if done.stderr:
                print("  " + done.stderr.strip().splitlines()[0])
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
