#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Encodes, decodes and compares a sequence at several steps with the isoreel command, and prints a Markdown table.
bench/README.md says how to read it."""

import argparse
import json
import os
import platform
import shlex
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

BUNDLED = Path(__file__).resolve().parent.parent / "examples" / "data" / "droplets"


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog="Options behind -- go to `isoreel encode` as they are: -- --iso 500 --inside above")
    parser.add_argument("data", nargs="*", default=[str(BUNDLED)],
                        help="volumes, as `isoreel encode` takes them (default: the bundled sequence)")
    parser.add_argument("--isoreel", default="build/release/isoreel", help="the command (default: %(default)s)")
    parser.add_argument("--steps", default="1/4,1/8,1/16,1/32", help="quantiser steps (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=3, help="timings are medians of so many runs (default: %(default)s)")
    own, encode = sys.argv[1:], []
    if "--" in own:
        split = own.index("--")
        own, encode = own[:split], own[split + 1:]
    return parser.parse_args(own), encode


def isoreel(program, *words):
    """Runs a verb with --json and returns its object."""
    command = [program, *words, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"bench: {shlex.join(command)} failed ({done.returncode}):\n{done.stderr.strip()}")
    return json.loads(done.stdout)


def measure(options, encode, step, folder):
    """One row of the table: the sequence at one step."""
    file = os.path.join(folder, "bench.isr")
    encodes, decodes = [], []
    for _ in range(options.runs):
        totals = isoreel(options.isoreel, "encode", *options.data, "-o", file, "--force", "--step", step,
                         "--frame-types", "intra", "--profile", "classic", *encode)
        encodes.append(totals["seconds"])
        decodes.append(isoreel(options.isoreel, "decode", file, "--discard")["seconds"])
    size = os.path.getsize(file)
    distances = isoreel(options.isoreel, "compare", file, *options.data)
    return {
        "step": step,
        "bytes": size,
        "signs": 8 * totals["bytes"]["signs"] / totals["vertices"],
        "residuals": 8 * totals["bytes"]["vertices"] / totals["vertices"],
        "bits": 8 * size / totals["vertices"],
        "volume": distances["volume"]["rms"],
        "extracted": distances["extracted"]["rms"],
        "encode": statistics.median(encodes),
        "decode": statistics.median(decodes),
        "frames": totals["frames"],
        "vertices": totals["vertices"],
    }


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def main():
    options, encode = arguments()
    with tempfile.TemporaryDirectory(prefix="isoreel-bench-") as folder:
        rows = [measure(options, encode, step, folder) for step in options.steps.split(",")]
    first = rows[0]
    print(f"{' '.join(options.data)}: {first['frames']} frames, {first['vertices']} vertices; "
          f"{processor()}, {os.cpu_count()} threads; medians of {options.runs} runs\n")
    print("| step | bytes | bits/vertex | of it signs | of it residuals | RMS to volume | RMS to extracted | encode s | decode s |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for row in rows:
        print(f"| {row['step']} | {row['bytes']} | {row['bits']:.3f} | {row['signs']:.3f} | {row['residuals']:.3f} | "
              f"{row['volume']:.4f} | {row['extracted']:.4f} | {row['encode']:.3f} | {row['decode']:.3f} |")


if __name__ == "__main__":
    main()
