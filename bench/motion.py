#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The experiment of the 2006 paper: frame-by-frame (I packets alone) against motion-predicted, as rate-distortion curves over
quantiser steps, with what leaves out parts of the prediction. Prints Markdown; --output also keeps it, with JSON and a plot.
bench/README.md says how to read it."""

import argparse
import json
import os
import resource
import shlex
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

from curves import Curve, bd_rate, ratio_at

# What the paper's table 1 gives: frames, bytes frame by frame, bytes motion-predicted.
PAPER = {"droplets": (20, 1528932, 1343131), "splash": (20, 2196948, 1841577), "headscan": (36, 7185869, 5935626)}
ABLATIONS = {"blocks of 4": ["--block", "4"], "blocks of 16": ["--block", "16"], "no coarse search": ["--search", "0"],
             "no registration": ["--no-registration"], "no motion": ["--search", "0", "--no-registration"]}


# Profile main, against frame by frame of classic.
MAIN = {"main, I frames": ["--frame-types", "intra"], "main": [], "main to the mesh": ["--fit", "extracted"],
        "main, fast": ["--preset", "fast"]}
# ... without one of its tools each, for --ablations.
MAIN_ABLATIONS = {f"main without {tool}": ["--without", tool] for tool in ("neighbours", "signs", "sheets", "fit", "rate")}
ABLATIONS_OF_MAIN = {f"main, {label}": words for label, words in ABLATIONS.items()}
CLASSIC = ["--profile", "classic"]


def isoreel(options, *words):
    command = [options.isoreel, *map(str, words), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"motion: {shlex.join(command)} failed ({done.returncode}):\n{done.stderr.strip()}")
    return json.loads(done.stdout)


def load_set(path):
    """Name, and the words that `encode` and `compare` take."""
    path = Path(path)
    given = json.loads(path.read_text(encoding="utf-8"))
    inputs = [str(path.parent / name) for name in given["inputs"]]
    encode = [*inputs]
    if "isovalues" in given:
        encode += ["--iso=" + ",".join(f"{value:g}" for value in given["isovalues"])]
    for key, option in (("inside", "--inside"), ("grid", "--grid")):
        if key in given:
            encode += [option, given[key]]
    compare = [*inputs] + (["--grid", given["grid"]] if "grid" in given else [])
    return given.get("name", path.parent.name), encode, compare


def processor_time(call):
    """What the call gives, and the processor time of the programs that it ran."""
    def spent():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime
    before = spent()
    return call(), spent() - before


def point(options, encode, compare, step, words, folder):
    file = os.path.join(folder, "motion.isr")
    totals, encoding = processor_time(lambda: isoreel(options, "encode", *encode, "-o", file, "--force", "--step", step, *words))
    _, decoding = processor_time(lambda: isoreel(options, "decode", file, "--discard"))
    # Distances of some frames, evenly spread.
    every = max(1, totals["frames"] // options.samples)
    squares = {"sheets": [], "cells": [], "volume": []}
    for frame in range(every // 2, totals["frames"], every):
        for mesh in ("sheets", "cells"):
            found = isoreel(options, "compare", file, *compare, "--mesh", mesh, "--frames", frame, "--samples", 50000)
            squares[mesh].append(found["extracted"]["rms"] ** 2)
        squares["volume"].append(found["volume"]["rms"] ** 2)
    return {"step": step, "bytes": totals["bytes"], "vertices": totals["vertices"], "frames": totals["frames"],
            "predicted": totals["predicted_frames"], "seconds": totals["seconds"], "encoding": encoding, "decoding": decoding,
            **{kind: (sum(values) / len(values)) ** 0.5 for kind, values in squares.items()}}


def curve(points, kind="cells"):
    return Curve([(p[kind], p["bytes"]["total"]) for p in points])


def measure(options, path):
    name, encode, compare = load_set(path)
    gop = ["--gop", options.gop]
    variants = {"frame by frame": CLASSIC + ["--frame-types", "intra"], "motion-predicted": CLASSIC + gop}
    if options.ablations:
        variants.update({label: CLASSIC + gop + words for label, words in ABLATIONS.items()})
    if options.main:
        variants.update({label: gop + words for label, words in MAIN.items()})
        if options.ablations:
            variants.update({label: gop + words for label, words in {**MAIN_ABLATIONS, **ABLATIONS_OF_MAIN}.items()})
    if options.only:
        variants = {label: words for label, words in variants.items() if label in ("frame by frame", *options.only.split(";"))}
    result = {}
    with tempfile.TemporaryDirectory(prefix="isoreel-motion-") as folder:
        for label, words in variants.items():
            steps = options.steps.split(",")
            result[label] = [point(options, encode, compare, step, words, folder) for step in steps]
            print(f"{name}: {label}", file=sys.stderr)
    return name, result


def share(value):
    return "-" if value is None else f"{100 * value:.1f} %"


def signed(value):
    return "-" if value is None else f"{100 * value:+.1f} %"


def report(options, sets):
    lines = ["| set | frames | FF bytes | MP bytes | gain | gain at equal distance | BD-rate | BD-rate to the volume | paper: FF | MP | gain |",
             "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for name, result in sets.items():
        if "motion-predicted" not in result:
            continue
        ff, mp = result["frame by frame"], result["motion-predicted"]
        middle = min(range(len(ff)), key=lambda i: abs(Fraction(ff[i]["step"]) - Fraction(1, 16)))
        before, after = ff[middle]["bytes"]["total"], mp[middle]["bytes"]["total"]
        equal = ratio_at(curve(mp), curve(ff), mp[middle]["cells"])
        paper = PAPER.get(name.split("-")[0]) if "slow" not in name else None
        theirs = f"{paper[1]} | {paper[2]} | {share(1 - paper[2] / paper[1])}" if paper else "- | - | -"
        lines.append(f"| {name} | {ff[0]['frames']} | {before} | {after} | {share(1 - after / before)} | "
                     f"{share(None if equal is None else 1 - equal)} | {share(bd_rate(curve(mp), curve(ff)))} | "
                     f"{share(bd_rate(curve(mp, 'volume'), curve(ff, 'volume')))} | {theirs} |")
    lines += ["", f"At step 1/16, GOPs of {options.gop} frames at most. Times are the processor's, of whole runs of the command.", ""]
    for name, result in sets.items():
        lines += [f"### {name}", "", "| variant | step | bytes | signs | motion | vertices | P frames | RMS to volume | to mesh of sheets | to mesh of cells | encoding | decoding |",
                  "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
        for label, points in result.items():
            for p in points:
                b = p["bytes"]
                lines.append(f"| {label} | {p['step']} | {b['total']} | {b['signs']} | {b['motion']} | {b['vertices']} | {p['predicted']} | "
                             f"{p['volume']:.4f} | {p['sheets']:.4f} | {p['cells']:.4f} | {p['encoding']:.1f} s | {p['decoding']:.2f} s |")
        lines += ["", "| variant | BD-rate against frame by frame, to the volume | to the mesh of sheets | to the mesh of cells | each to its own |",
                  "| --- | ---: | ---: | ---: | ---: |"]
        for label, points in result.items():
            if label == "frame by frame":
                continue
            own = "sheets" if label.startswith("main") and label != "main without sheets" else "cells"
            kinds = (("volume", "volume"), ("sheets", "sheets"), ("cells", "cells"), (own, "cells"))
            rates = [share(bd_rate(curve(points, kind), curve(result["frame by frame"], of_all))) for kind, of_all in kinds]
            lines.append(f"| {label} | " + " | ".join(rates) + " |")
        without = [label for label in result if label in MAIN_ABLATIONS or label in ABLATIONS_OF_MAIN]
        if "main" in result and without:
            lines += ["", "| main, left out | bytes at equal distance to the volume | to the mesh of sheets | encoding | decoding |",
                      "| --- | ---: | ---: | ---: | ---: |"]
        for label in without if "main" in result else []:
            rates = [bd_rate(curve(result[label], kind), curve(result["main"], kind)) for kind in ("volume", "sheets")]
            times = [sum(p[kind] for p in result[label]) / sum(p[kind] for p in result["main"]) - 1 for kind in ("encoding", "decoding")]
            lines.append(f"| {label.removeprefix('main without ').removeprefix('main, ')} | " + " | ".join(map(signed, rates + times)) + " |")
        lines.append("")
    return "\n".join(lines)


def plot(sets, path):
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(sets), figsize=(4.2 * len(sets), 3.6), squeeze=False)
    for axis, (name, result) in zip(axes[0], sets.items()):
        # Heights of main are chosen for the volume, not for the extractor's own mesh.
        kind = "volume" if "main" in result else "cells"
        for label in (label for label in ("frame by frame", "motion-predicted", *MAIN) if label in result):
            axis.plot([p["bytes"]["total"] / 1e6 for p in result[label]], [p[kind] for p in result[label]], marker="o", label=label)
        axis.set(title=name, xlabel="megabytes", ylabel=f"RMS to {kind}, cells", yscale="log")
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sets", nargs="+", help="set files (bench/README.md)")
    parser.add_argument("--isoreel", default="build/release/isoreel", help="the command (default: %(default)s)")
    parser.add_argument("--steps", default="1/2,1/4,1/8,1/16,1/32", help="quantiser steps (default: %(default)s)")
    parser.add_argument("--gop", type=int, default=1000, help="frames from key to key, at most (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=5, help="frames to measure distances of (default: %(default)s)")
    parser.add_argument("--ablations", action="store_true", help="measure what leaves out parts of the prediction, too")
    parser.add_argument("--main", action="store_true", help="measure profile main, too")
    parser.add_argument("--only", help="of these, only those with the labels A;B;..., and frame by frame")
    parser.add_argument("--output", help="PATH: also write PATH.md, PATH.json and PATH.svg")
    options = parser.parse_args()
    sets = dict(measure(options, path) for path in options.sets)
    text = report(options, sets)
    print(text)
    if options.output:
        command = "python3 bench/motion.py " + shlex.join(Path(a).name if a in options.sets else a for a in sys.argv[1:])
        Path(options.output + ".md").write_text(f"# Motion prediction\n\n    {command}\n\n{text}", encoding="utf-8")
        Path(options.output + ".json").write_text(json.dumps(sets, indent=None, separators=(",", ":")), encoding="utf-8")
        plot(sets, options.output + ".svg")


if __name__ == "__main__":
    main()
