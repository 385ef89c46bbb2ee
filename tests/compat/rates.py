#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""usage: rates.py ISOREEL [--write]: bytes and distance of five frames of examples/data by each profile and kind of frame,
which may differ from rates.json by 1 % and 3 %. A change that means to change them writes the file anew (--write) and says
so in its commit."""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
VOLUMES = [HERE / f"../../examples/data/droplets/frame_{n:04}.vdb" for n in range(12, 17)]
TOLERANCE = {"bytes": 0.01, "rms": 0.03}


def run(*command):
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def measured(isoreel, folder):
    rates = {}
    for profile in ("classic", "main"):
        for frames in ("intra", "auto"):
            file = folder / f"{profile}_{frames}.isr"
            coding = ["--profile", profile, "--frame-types", frames, "--iso", "0"]
            coded = run(isoreel, "encode", *VOLUMES, "-o", file, *coding, "--json")
            rates[file.stem] = {"bytes": coded["bytes"]["total"]}
        command = [isoreel, "compare", file, *VOLUMES, "--frames", "4", "--samples", "2000", "--json"]
        rates[file.stem]["rms"] = round(run(*command)["volume"]["rms"], 6)
    return rates


def main():
    with tempfile.TemporaryDirectory() as folder:
        found = measured(sys.argv[1], pathlib.Path(folder))
    if "--write" in sys.argv:
        (HERE / "rates.json").write_text(json.dumps(found, indent=1) + "\n")
        return
    pinned = json.loads((HERE / "rates.json").read_text())
    wrong = [
        f"{name}: {what} {found[name][what]}, where {value} is pinned"
        for name, values in pinned.items()
        for what, value in values.items()
        if abs(found[name][what] - value) > TOLERANCE[what] * value
    ]
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
