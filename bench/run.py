#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures Isoreel and other coders on sets of volumes: a Markdown report on the standard output or, with --output, in a
file with JSON and an SVG plot beside it. bench/README.md says how to read them.

DATA is a set, a JSON file {"name": ..., "inputs": [volumes], "grid": ..., "isovalues": [...], "inside": "below"|"above"}
whose paths count from its own folder; or volumes as `isoreel encode` takes them (a file, a folder, a printf pattern),
with --iso, --inside and --grid. The default is the bundled sequence."""

import argparse
import datetime
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import report

BUNDLED = Path(__file__).resolve().parent.parent / "examples" / "data" / "droplets"
CODERS = ["draco", "meshoptimizer", "openctm", "zfp"]


def numbers(kind):
    return lambda text: [kind(part) for part in text.split(",")]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("data", nargs="*", default=[str(BUNDLED)], metavar="DATA", help="sets")
    add("--iso", type=numbers(float), help="isovalues of DATA that is no set file")
    add("--inside", choices=["below", "above"], help="of DATA that is no set file")
    add("--grid", help="of DATA that is no set file: the OpenVDB grid")
    add("--output", metavar="STEM", help="write STEM.md, STEM.json and STEM.svg")
    add("--coders", type=numbers(str), default=CODERS, help=f"besides Isoreel (default: {','.join(CODERS)})")
    add("--steps", type=numbers(Fraction), default="1/2,1/4,1/8,1/16,1/32",
        help="Isoreel's, in cells (default: %(default)s)")
    add("--speeds", type=numbers(int), default="0,3,7,10", help="Draco's (default: %(default)s)")
    add("--bits", type=numbers(int), default="7,8,9,10,11,12,13",
        help="position bits, of Draco and meshoptimizer (default: %(default)s)")
    add("--precisions", type=numbers(Fraction), default="1,1/2,1/4,1/8,1/16,1/32",
        help="OpenCTM's, in cells (default: %(default)s)")
    add("--tolerances", type=numbers(Fraction), default="32,16,8,4,2,1,1/2,1/4,1/8,1/16,1/32,1/64",
        help="zfp's, times the median difference of samples across the surface (default: %(default)s)")
    add("--runs", type=int, default=3, help="timings are medians of so many runs (default: %(default)s)")
    add("--samples", type=int, default=6, help="frames to take distances and timings of (default: %(default)s)")
    add("--program", default="build/bench/isoreel_bench", help="default: %(default)s")
    return parser.parse_args()


def load_set(data, options):
    """A set with paths that stand for themselves."""
    path = Path(data)
    if path.suffix == ".json" and "inputs" in (described := json.loads(path.read_text(encoding="utf-8"))):
        described["inputs"] = [str(path.parent / each) for each in described["inputs"]]
        return {"name": path.stem, **described}
    described = {"name": path.stem if path.is_file() else path.name, "inputs": [data]}
    for key, value in (("isovalues", options.iso), ("inside", options.inside), ("grid", options.grid)):
        if value is not None:
            described[key] = value
    return described


def settings(options):
    """What the program is told besides the set."""
    asked = {"draco": {"speeds": options.speeds, "bits": options.bits},
             "meshoptimizer": {"meshopt_bits": options.bits},
             "openctm": {"precisions": [float(p) for p in options.precisions]},
             "zfp": {"tolerances": [float(t) for t in options.tolerances]}}
    result = {"runs": options.runs, "samples": options.samples,
              "steps": [round(step * 16384) for step in options.steps]}
    for coder in options.coders:
        if coder not in asked:
            sys.exit(f"bench: there is no coder '{coder}'; there are {', '.join(CODERS)}")
        result |= asked[coder]
    return result


def measure(program, job):
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(job, file)
        file.flush()
        done = subprocess.run([program, file.name], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"bench: {job['name']} failed ({done.returncode})")
    return json.loads(done.stdout)


def machine():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name}, {os.cpu_count()} threads"


def rounded(value):
    """Six digits are enough of a measurement, and keep the file small."""
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    return [rounded(each) for each in value] if isinstance(value, list) else value


def main():
    options = arguments()
    results = {"date": datetime.date.today().isoformat(), "command": shlex.join(["./dev", "bench", *sys.argv[1:]]),
               "machine": machine(), "sets": []}
    for data in options.data:
        described = load_set(data, options)
        print(f"bench: {described['name']}", file=sys.stderr)
        measured = {"name": described["name"], **measure(options.program, described | settings(options))}
        report.compare(measured)
        results["sets"].append(measured)
    text = "\n".join(report.markdown(results)) + "\n"
    if not options.output:
        print(text, end="")
        return
    stem = Path(options.output)
    stem.parent.mkdir(parents=True, exist_ok=True)
    stem.with_name(stem.name + ".md").write_text(text, encoding="utf-8")
    stem.with_name(stem.name + ".json").write_text(json.dumps(rounded(results), indent=1) + "\n", encoding="utf-8")
    report.plot(results, stem.with_name(stem.name + ".svg"))


if __name__ == "__main__":
    main()
