#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Decodes the golden packets with decode.py, reads the files with isr.py, and compares with their manifest (../README.md).

usage: check_vectors.py [FOLDER]    exit 1 when something decodes differently, or what must be refused is not"""

import json
import pickle
import sys
from pathlib import Path

sys.dont_write_bytecode = True
from decode import Decoder, summary  # noqa: E402
from entropy import Refused  # noqa: E402
from isr import Source, attachment, by_pipe, open_file, surfaces  # noqa: E402


def copy_of(decoder):
    """As copy.deepcopy(), and ten times as fast."""
    return pickle.loads(pickle.dumps(decoder))


def without_words(expected):
    """Errors are there or not; how they are worded is each decoder's own."""
    if isinstance(expected, list):
        return [without_words(each) for each in expected]
    if isinstance(expected, dict):
        return {key: "" if key == "error" else without_words(value) for key, value in expected.items()}
    return expected


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

    def expect_full_level(self, entry, full):
        """The last level is the full surface, which needs no decoding twice."""
        if any(full[key] != value for key, value in entry["levels"][-1].items()):
            self.wrong.append(f"{entry['name']}: its last level is not its surface")

    def single(self, entry):
        name, data = entry["name"], self.bytes_of(entry["file"])
        self.expect(name, entry, Decoder(), data)
        self.expect_full_level(entry, entry)
        for level, expected in enumerate(entry["levels"][:-1]):
            self.expect(f"{name}: level {level}", expected, Decoder(), data, level)
        for cut in entry["prefixes"]:
            short = data[:cut["bytes"]]
            self.expect(f"{name}: prefix of {cut['bytes']} bytes", entry["levels"][cut["level"]], Decoder(), short, None, True)
            self.expect_refused(f"{name}: prefix of {cut['bytes']} bytes", Decoder(), short)

    def sequence(self, entry):
        name, decoder, prefix = entry["name"], Decoder(), entry["prefix"]
        for packet in entry["packets"]:
            data = self.bytes_of(packet["file"])
            before = copy_of(decoder) if packet is entry["packets"][-1] else None
            self.expect(packet["file"], packet, decoder, data)
        self.expect_full_level(entry, entry["packets"][-1])
        for level, expected in enumerate(entry["levels"][:-1]):
            at_level = copy_of(before)
            self.expect(f"{name}: level {level}", expected, at_level, data, level)
        for cut in entry["prefixes"]:
            short = copy_of(before), data[:cut["bytes"]], None, True
            self.expect(f"{name}: prefix of {cut['bytes']} bytes", entry["levels"][cut["level"]], *short)
        self.expect(f"{name}: prefix", prefix, before, data[:prefix["bytes"]], None, True)

    def reject_after(self, entry):
        decoder = Decoder()
        for file in entry["after"]:
            decoder.decode(self.bytes_of(file))
        self.expect_refused(entry["name"], decoder, self.bytes_of(entry["file"]))

    def file(self, entry):
        """What readers by index or scan, and by pipe, find in a file."""
        name, data = entry["name"], self.bytes_of(entry["file"])
        source = Source(data)
        try:
            contents = open_file(source)
        except Refused as rule:
            self.wrong.append(f"{name}: refused: {rule}")
            return
        tracks = []
        for track in contents.tracks.values():
            frames = []
            for header, surface in surfaces(source, track):
                frame = {"number": header.number, "time": header.time, "hidden": header.hidden}
                if header.error[0]:
                    frame |= zip(("error_kind", "error_rms", "error_max"), header.error)
                frames.append(frame | ({"error": ""} if isinstance(surface, Refused) else summary(surface)))
            tracks.append({"id": track.id, "name": track.name or "", "frames": frames})
        attachments = []
        for listed in contents.attachments:
            try:
                content = {"content": attachment(source, listed).decode()}
            except Refused:
                content = {"error": ""}
            attachments.append({"name": listed["name"], "media_type": listed["media_type"]} | content)
        packets, pipe = 0, {}
        try:
            for _ in by_pipe(data):
                packets += 1
        except Refused:
            pipe = {"error": ""}
        found = {"indexed": contents.indexed, "tags": contents.tags, "chapters": contents.chapters, "attachments": attachments,
                 "tracks": tracks, "damage": bool(contents.damage), "pipe": {"packets": packets} | pipe}
        for key, value in found.items():
            expected = without_words(entry[key]) if key != "damage" else bool(entry[key])
            if value != expected:
                self.wrong.append(f"{name}: {key} {value} where {expected} is due")

    def reject_file(self, entry):
        try:
            open_file(Source(self.bytes_of(entry["file"])))
            self.wrong.append(f"{entry['name']}: was not refused")
        except Refused:
            pass

    def run(self):
        for entry in self.manifest["accept"]:
            self.single(entry)
        for entry in self.manifest["reject"]:
            self.expect_refused(entry["name"], Decoder(), self.bytes_of(entry["file"]))
        for entry in self.manifest["sequences"]:
            self.sequence(entry)
        for entry in self.manifest["reject_after"]:
            self.reject_after(entry)
        for entry in self.manifest["files"]:
            self.file(entry)
        for entry in self.manifest["reject_files"]:
            self.reject_file(entry)
        counts = ", ".join(f"{len(entries)} {kind}" for kind, entries in self.manifest.items())
        print(f"{counts}; {len(self.wrong)} wrong")
        return self.wrong


if __name__ == "__main__":
    breaches = Checks(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "vectors").run()
    print("\n".join(breaches), file=sys.stderr)
    sys.exit(1 if breaches else 0)
