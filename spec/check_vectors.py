#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Decodes the golden packets with decode.py and compares them with their manifest (vectors/README.md).

usage: check_vectors.py [FOLDER]    exit 1 when a packet decodes differently, or one that must be refused is not"""

import json
import sys
from pathlib import Path

sys.dont_write_bytecode = True
from decode import decode, summary  # noqa: E402
from entropy import Refused  # noqa: E402


def check_vectors(folder):
    """Decodes all vectors of a folder; the list of what is wrong."""
    manifest, wrong = json.loads((folder / "manifest.json").read_text()), []

    def refused(data, *options):
        try:
            decode(data, *options)
            return False
        except Refused:
            return True

    for entry in manifest["accept"]:
        data = (folder / entry["file"]).read_bytes()
        found = summary(decode(data))
        wrong += [f"{entry['name']}: {key} {found[key]}" for key in found if found[key] != entry[key]]
        for level, expected in enumerate(entry["levels"]):
            if summary(decode(data, level)) != expected:
                wrong.append(f"{entry['name']}: level {level}")
        for cut in entry.get("prefixes", []):
            short = data[:cut["bytes"]]
            if summary(decode(short, None, True)) != entry["levels"][cut["level"]] or not refused(short):
                wrong.append(f"{entry['name']}: prefix of {cut['bytes']} bytes")
    for entry in manifest["reject"]:
        if not refused((folder / entry["file"]).read_bytes()):
            wrong.append(f"{entry['name']}: was not refused")
    print(f"{len(manifest['accept'])} packets decoded, {len(manifest['reject'])} to refuse, {len(wrong)} wrong")
    return wrong


if __name__ == "__main__":
    breaches = check_vectors(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "vectors")
    print("\n".join(breaches), file=sys.stderr)
    sys.exit(1 if breaches else 0)
