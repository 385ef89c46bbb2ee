#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How much of each folder the fuzzers' corpora reach, by the edges that libFuzzer counts. Of a function that several fuzzers reach, the one
that reaches most of it counts, so that the figures are lower bounds.

usage: coverage.py BUILD_FOLDER CORPUS [FOLDER...]    folders: codec and container, and what else is named; with --missed also the
                                                      functions that are not reached"""

import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

LINE = re.compile(r"^(?:UN)?COVERED_FUNC: hits: \d+ edges: (\d+)/(\d+) (.*) (\S+):(\d+)$")


def functions(fuzzer, folders):
    """Yields place, edges reached, edges and name of every function of the program, from a run over its inputs."""
    run = subprocess.run([fuzzer, "-runs=0", "-print_coverage=1", *map(str, folders)], stderr=subprocess.PIPE, text=True, errors="replace")
    if run.returncode:
        sys.exit(f"{fuzzer} fails:\n{run.stderr[-2000:]}")
    for line in run.stderr.splitlines():
        match = LINE.match(line)
        if match:
            yield match[4] + ":" + match[5], int(match[1]), int(match[2]), match[3]


def main(arguments):
    missed = "--missed" in arguments
    arguments = [a for a in arguments if a != "--missed"]
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    build, corpus = Path(arguments[0]), Path(arguments[1])
    wanted = arguments[2:] or ["codec", "container"]
    here = Path(__file__).resolve().parent
    best = {}
    for inputs in sorted((build / "seeds").iterdir()):
        folders = [f for f in (inputs, corpus / inputs.name, here / "corpus" / inputs.name) if f.is_dir()]
        for place, reached, edges, name in functions(build / f"fuzz_{inputs.name}", folders):
            match = re.search(r"/(\w+)/(?:include/isoreel/\w+|src|\w+)/[\w.]+:\d+$", place)
            if not match or match[1] not in wanted:
                continue
            room = re.search(rf"{match[1]}/(?:include|src|\w+)", place)[0]
            key = room, name, place
            best[key] = max(best.get(key, (0, edges)), (reached, edges))
    rooms = defaultdict(lambda: [0, 0, 0, 0])
    for (room, name, place), (reached, edges) in best.items():
        for total in (rooms[room], rooms[f"{room.split('/')[0]} in all"]):
            for i, value in enumerate((reached > 0, 1, reached, edges)):
                total[i] += value
        if missed and not reached:
            print(f"not reached: {name} {place.split('/../')[-1]}")
    for room, (hit, count, reached, edges) in sorted(rooms.items()):
        print(f"{room:24} {hit:5} of {count:5} functions, {reached:6} of {edges:6} edges ({100 * reached / edges:.1f} %)")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
