#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Decodes the golden packets with decode.py and compares them with their manifest (README.md).

usage: check_vectors.py [FOLDER]    exit 1 when a packet decodes differently, or one that must be refused is not"""

import json
import sys
from copy import deepcopy
from pathlib import Path

sys.dont_write_bytecode = True
from decode import Decoder, summary  # noqa: E402
from entropy import Refused  # noqa: E402


class Checks:
    """All vectors of a folder; `wrong` lists what is wrong."""

    def __init__(self, folder):
        self.folder, self.wrong = folder, []
        self.manifest = json.loads((folder / "manifest.json").read_text())

    def bytes_of(self, file):
        return (self.folder / file).read_bytes()

    def expect(self, what, expected, decoder, *arguments):
        try:
            found = summary(decoder.decode(*arguments))
            self.wrong += [f"{what}: {key} {found[key]}" for key in found if found[key] != expected[key]]
        except Refused as rule:
            self.wrong.append(f"{what}: refused: {rule}")

    def expect_refused(self, what, decoder, *arguments):
        try:
            decoder.decode(*arguments)
            self.wrong.append(f"{what}: was not refused")
        except Refused:
            pass

    def single(self, entry):
        name, data = entry["name"], self.bytes_of(entry["file"])
        self.expect(name, entry, Decoder(), data)
        for level, expected in enumerate(entry["levels"]):
            self.expect(f"{name}: level {level}", expected, Decoder(), data, level)
        for cut in entry["prefixes"]:
            short = data[:cut["bytes"]]
            self.expect(f"{name}: prefix of {cut['bytes']} bytes", entry["levels"][cut["level"]], Decoder(), short, None, True)
            self.expect_refused(f"{name}: prefix of {cut['bytes']} bytes", Decoder(), short)

    def sequence(self, entry):
        name, decoder, prefix = entry["name"], Decoder(), entry["prefix"]
        for packet in entry["packets"]:
            data, before = self.bytes_of(packet["file"]), deepcopy(decoder)
            self.expect(packet["file"], packet, decoder, data)
        for level, expected in enumerate(entry["levels"]):
            at_level = deepcopy(before)
            self.expect(f"{name}: level {level}", expected, at_level, data, level)
        for cut in entry["prefixes"]:
            short = deepcopy(before), data[:cut["bytes"]], None, True
            self.expect(f"{name}: prefix of {cut['bytes']} bytes", entry["levels"][cut["level"]], *short)
        self.expect(f"{name}: prefix", prefix, before, data[:prefix["bytes"]], None, True)

    def reject_after(self, entry):
        decoder = Decoder()
        for file in entry["after"]:
            decoder.decode(self.bytes_of(file))
        self.expect_refused(entry["name"], decoder, self.bytes_of(entry["file"]))

    def run(self):
        for entry in self.manifest["accept"]:
            self.single(entry)
        for entry in self.manifest["reject"]:
            self.expect_refused(entry["name"], Decoder(), self.bytes_of(entry["file"]))
        for entry in self.manifest["sequences"]:
            self.sequence(entry)
        for entry in self.manifest["reject_after"]:
            self.reject_after(entry)
        counts = ", ".join(f"{len(entries)} {kind}" for kind, entries in self.manifest.items())
        print(f"{counts}; {len(self.wrong)} wrong")
        return self.wrong


if __name__ == "__main__":
    breaches = Checks(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "vectors").run()
    print("\n".join(breaches), file=sys.stderr)
    sys.exit(1 if breaches else 0)
